//! What a driver puts on record of each packet. It must never wait: not for the disk, not for a lock.

use mmt_shared::time::Time;

use super::record_file::RecordWriter;
use crate::direction::Direction;
use crate::fate::DropCause;
use crate::pipe::Released;
use crate::record::{End, Entry};

/// The record of one driver, if it keeps one. Its times count from the start of the record.
#[derive(Debug)]
pub(super) struct Log(Option<RecordWriter>);

/// A packet that was offered and dropped at once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dropped {
    pub(super) number: u64,
    pub(super) offered_at: Time,
    pub(super) bytes: usize,
    pub(super) backlog: u32,
    pub(super) cause: DropCause,
}

impl Log {
    pub(super) fn new(writer: Option<RecordWriter>) -> Self {
        Self(writer)
    }

    /// Packets that the record misses.
    pub(super) fn missed(&self) -> u64 {
        self.0.as_ref().map_or(0, RecordWriter::missed)
    }

    pub(super) fn dropped(&self, direction: Direction, packet: &Dropped) {
        if let Some(writer) = &self.0 {
            writer.push(Entry {
                direction,
                number: packet.number,
                offered: writer.since_start(packet.offered_at),
                bytes: u32::try_from(packet.bytes).unwrap_or(u32::MAX),
                backlog: packet.backlog,
                end: End::Dropped(packet.cause),
            });
        }
    }

    /// A packet that left the link at `now`; `sent`: whether the real socket took it. `backlog` packets
    /// were in flight when it was offered.
    pub(super) fn released<T>(
        &self,
        direction: Direction,
        packet: &Released<T>,
        backlog: u32,
        sent: bool,
        now: Time,
    ) {
        let Some(writer) = &self.0 else {
            return;
        };
        let end = match sent {
            true => End::Sent {
                due: writer.since_start(packet.due),
                sent: writer.since_start(now),
                copy: packet.copy,
                corrupted: packet.corrupted_bit.is_some(),
            },
            false => End::Unsent,
        };
        writer.push(Entry {
            direction,
            number: packet.number,
            offered: writer.since_start(packet.offered_at),
            bytes: u32::try_from(packet.bytes).unwrap_or(u32::MAX),
            backlog,
            end,
        });
    }
}
