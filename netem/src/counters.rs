//! What became of packets: counts of packets and bytes, drops by cause.
//!
//! The law that holds at any moment: offered + duplicated = delivered + in flight + the sum of the drops.

use serde::Serialize;

use crate::packet::DropCause;

/// A number of packets and the bytes in them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// Packets.
    pub packets: u64,
    /// Bytes in these packets, counted as the offering side gave their lengths.
    pub bytes: u64,
}

impl Tally {
    /// Counts one packet of `bytes` bytes.
    pub fn count(&mut self, bytes: usize) {
        self.packets = self.packets.saturating_add(1);
        self.bytes = self.bytes.saturating_add(bytes as u64);
    }

    /// The sum of two tallies.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            packets: self.packets.saturating_add(other.packets),
            bytes: self.bytes.saturating_add(other.bytes),
        }
    }
}

/// Packets dropped by a link, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Drops {
    /// [`DropCause::Loss`].
    pub loss: Tally,
    /// [`DropCause::Outage`].
    pub outage: Tally,
    /// [`DropCause::Mtu`].
    pub mtu: Tally,
    /// [`DropCause::Queue`].
    pub queue: Tally,
    /// [`DropCause::Codel`].
    pub codel: Tally,
    /// [`DropCause::Limit`].
    pub limit: Tally,
}

impl Drops {
    /// Counts one packet of `bytes` bytes under its cause.
    pub fn count(&mut self, cause: DropCause, bytes: usize) {
        let tally = match cause {
            DropCause::Loss => &mut self.loss,
            DropCause::Outage => &mut self.outage,
            DropCause::Mtu => &mut self.mtu,
            DropCause::Queue => &mut self.queue,
            DropCause::Codel => &mut self.codel,
            DropCause::Limit => &mut self.limit,
        };
        tally.count(bytes);
    }

    /// The sum of two counts.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            loss: self.loss.plus(other.loss),
            outage: self.outage.plus(other.outage),
            mtu: self.mtu.plus(other.mtu),
            queue: self.queue.plus(other.queue),
            codel: self.codel.plus(other.codel),
            limit: self.limit.plus(other.limit),
        }
    }

    /// The count of one cause.
    #[must_use]
    pub fn of(&self, cause: DropCause) -> Tally {
        match cause {
            DropCause::Loss => self.loss,
            DropCause::Outage => self.outage,
            DropCause::Mtu => self.mtu,
            DropCause::Queue => self.queue,
            DropCause::Codel => self.codel,
            DropCause::Limit => self.limit,
        }
    }

    /// All causes together.
    #[must_use]
    pub fn total(&self) -> Tally {
        let causes = DropCause::ALL.into_iter();
        causes
            .map(|cause| self.of(cause))
            .fold(Tally::default(), Tally::plus)
    }
}

/// What became of the packets of a link since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LinkCounters {
    /// Packets offered to the link.
    pub offered: Tally,
    /// Copies that the link made of them.
    pub duplicated: Tally,
    /// Packets and copies that came through.
    pub delivered: Tally,
    /// Those among them with a bit flipped.
    pub corrupted: Tally,
    /// Those among them marked as having met congestion.
    pub marked: Tally,
    /// Packets and copies that the link dropped.
    pub dropped: Drops,
    /// Cross traffic, which is in no other count.
    pub cross: CrossCounters,
}

/// What became of the packets of others before the bottleneck, as far as it mattered to a packet so far:
/// offered = sent + dropped + those that wait.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct CrossCounters {
    /// Packets that came.
    pub offered: Tally,
    /// Those that the bottleneck sent.
    pub sent: Tally,
    /// Those that found no room, or that `CoDel` dropped.
    pub dropped: Tally,
}

impl LinkCounters {
    /// The counts of this link and the one behind it, as those of one link.
    #[must_use]
    pub fn followed_by(self, next: Self) -> Self {
        Self {
            offered: self.offered,
            duplicated: self.duplicated.plus(next.duplicated),
            delivered: next.delivered,
            corrupted: next.corrupted,
            marked: next.marked,
            dropped: self.dropped.plus(next.dropped),
            cross: CrossCounters {
                offered: self.cross.offered.plus(next.cross.offered),
                sent: self.cross.sent.plus(next.cross.sent),
                dropped: self.cross.dropped.plus(next.cross.dropped),
            },
        }
    }
}
