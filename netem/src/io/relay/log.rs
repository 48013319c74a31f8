//! What the thread of a relay puts on record.

use mmt_shared::time::Time;

use super::port::Sent;
use super::worker::Parcel;
use crate::io::record_file::RecordFile;
use crate::link::{Direction, DropCause};
use crate::pipe::Released;
use crate::record::{End, Entry};

/// The record of a relay, if it keeps one. Its times count from the start of the relay.
#[derive(Debug)]
pub(super) struct Log {
    recorder: Option<RecordFile>,
    origin: Time,
}

/// A packet that was offered and dropped at once.
pub(super) struct Dropped {
    pub(super) number: u64,
    pub(super) offered_at: Time,
    pub(super) bytes: usize,
    pub(super) backlog: u32,
    pub(super) cause: DropCause,
}

impl Log {
    pub(super) fn new(recorder: Option<RecordFile>, origin: Time) -> Self {
        Self { recorder, origin }
    }

    pub(super) fn missed(&self) -> u64 {
        self.recorder.as_ref().map_or(0, RecordFile::missed)
    }

    pub(super) fn dropped(&mut self, direction: Direction, packet: &Dropped) {
        let offered = self.since_start(packet.offered_at);
        if let Some(recorder) = &mut self.recorder {
            recorder.push(Entry {
                direction,
                number: packet.number,
                offered,
                bytes: u32::try_from(packet.bytes).unwrap_or(u32::MAX),
                backlog: packet.backlog,
                end: End::Dropped(packet.cause),
            });
        }
    }

    pub(super) fn released(
        &mut self,
        direction: Direction,
        packet: &Released<Parcel>,
        sent: Option<Sent>,
        now: Time,
    ) {
        let (offered, due) = (
            self.since_start(packet.offered_at),
            self.since_start(packet.due),
        );
        let end = match sent {
            Some(Sent::Yes) => End::Sent {
                due,
                sent: self.since_start(now),
                copy: packet.copy,
                corrupted: packet.corrupted_bit.is_some(),
            },
            Some(Sent::Blocked | Sent::Failed) | None => End::Unsent,
        };
        if let Some(recorder) = &mut self.recorder {
            recorder.push(Entry {
                direction,
                number: packet.number,
                offered,
                bytes: u32::try_from(packet.bytes).unwrap_or(u32::MAX),
                backlog: packet.payload.backlog,
                end,
            });
        }
    }

    fn since_start(&self, time: Time) -> Time {
        Time::ZERO + time.saturating_since(self.origin)
    }
}
