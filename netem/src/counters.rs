//! What became of packets: counts of packets and bytes, drops by cause.
//!
//! The law that holds at any moment: offered = delivered + the sum of the drops.

use serde::Serialize;

use crate::link::DropCause;

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
    /// [`DropCause::Limit`].
    pub limit: Tally,
}

impl Drops {
    /// Counts one packet of `bytes` bytes under its cause.
    pub fn count(&mut self, cause: DropCause, bytes: usize) {
        match cause {
            DropCause::Loss => self.loss.count(bytes),
            DropCause::Limit => self.limit.count(bytes),
        }
    }

    /// All causes together.
    #[must_use]
    pub fn total(&self) -> Tally {
        self.loss.plus(self.limit)
    }
}

/// What a link decided since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LinkCounters {
    /// Packets offered to the link.
    pub offered: Tally,
    /// Packets that the link delivers, now or later; a copy of a packet does not count again.
    pub delivered: Tally,
    /// Packets that the link dropped.
    pub dropped: Drops,
}
