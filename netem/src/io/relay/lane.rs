//! One direction of a relay: its link, and what became of what left it. It must never wait.

use quinn::udp::EcnCodepoint;

use super::DirectionCounters;
use super::port::{Received, Sent};
use crate::counters::Tally;
use crate::direction::Direction;
use crate::fate::{Fate, turn_bit};
use crate::io::alarm::now;
use crate::io::log::{Dropped, Log};
use crate::pipe::{Pipe, Released};

/// A datagram on a link.
#[derive(Clone, Debug)]
pub(super) struct Parcel {
    pub(super) client: u64,
    pub(super) ecn: Option<EcnCodepoint>,
    pub(super) contents: Vec<u8>,
    /// Packets in flight when it was offered.
    pub(super) backlog: u32,
}

/// One direction: its link and what became of what left it.
#[derive(Debug)]
pub(super) struct Lane {
    pub(super) pipe: Pipe<Parcel>,
    pub(super) sent: Outcome,
}

/// What became of what left the link.
#[derive(Debug, Default)]
pub(super) struct Outcome {
    forwarded: Tally,
    blocked: Tally,
    failed: Tally,
    orphaned: Tally,
}

impl Outcome {
    pub(super) fn count(&mut self, sent: Option<Sent>, bytes: usize) {
        match sent {
            Some(Sent::Yes) => self.forwarded.count(bytes),
            Some(Sent::Blocked) => self.blocked.count(bytes),
            Some(Sent::Failed) => self.failed.count(bytes),
            None => self.orphaned.count(bytes),
        }
    }
}

impl Lane {
    /// Puts a datagram on the link, and a dropped one on record.
    pub(super) fn offer(
        &mut self,
        log: &Log,
        direction: Direction,
        client: u64,
        received: &Received<'_>,
    ) {
        let (now, bytes) = (now(), received.contents.len());
        let backlog = u32::try_from(self.pipe.in_flight()).unwrap_or(u32::MAX);
        let number = self.pipe.counters().offered.packets;
        let parcel = Parcel {
            client,
            ecn: received.ecn,
            contents: received.contents.to_owned(),
            backlog,
        };
        let capable = parcel.ecn.is_some();
        let fate = self.pipe.push_ecn(now, bytes, capable, parcel);
        if let Fate::Drop(cause) = fate {
            let packet = Dropped {
                number,
                offered_at: now,
                bytes,
                backlog,
                cause,
            };
            log.dropped(direction, &packet);
        }
    }

    pub(super) fn new(pipe: Pipe<Parcel>) -> Self {
        Self {
            pipe,
            sent: Outcome::default(),
        }
    }

    pub(super) fn counters(&self) -> DirectionCounters {
        DirectionCounters {
            link: self.pipe.counters(),
            in_flight: self.pipe.in_flight() as u64,
            forwarded: self.sent.forwarded,
            blocked: self.sent.blocked,
            failed: self.sent.failed,
            orphaned: self.sent.orphaned,
        }
    }
}

/// Turns the bit over that the link says, and marks what met congestion.
pub(super) fn harm(packet: &mut Released<Parcel>) {
    if packet.marked {
        packet.payload.ecn = Some(EcnCodepoint::Ce);
    }
    if let Some(bit) = packet.corrupted_bit {
        turn_bit(&mut packet.payload.contents, bit);
    }
}
