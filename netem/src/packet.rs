//! A packet on its way into a link, and on its way out.

use std::time::Duration;

use mmt_shared::time::Time;
use serde::{Deserialize, Serialize};

/// A packet on its way into a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet<T> {
    /// Its length, bytes (UDP payload in the drivers of this crate).
    pub bytes: usize,
    /// Whether its sender takes a mark for a loss (ECN, RFC 3168).
    pub ecn_capable: bool,
    /// What it carries.
    pub payload: T,
}

impl<T> Packet<T> {
    /// A packet whose sender does not understand ECN.
    pub fn new(bytes: usize, payload: T) -> Self {
        Self {
            bytes,
            ecn_capable: false,
            payload,
        }
    }
}

/// A packet on its way out of a link: delivered, or dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Departure<T> {
    /// The how-manieth offer it was, from 0; dropped packets count too.
    pub number: u64,
    /// When it was offered.
    pub offered_at: Time,
    /// Its length, bytes.
    pub bytes: usize,
    /// Packets in flight when it was offered.
    pub backlog: u32,
    /// Whether it is a copy.
    pub copy: bool,
    /// When it left the link or was dropped, in theory: what a link behind this one takes as its `now`.
    pub due: Time,
    /// How long it waited before the bottleneck until its own sending began.
    pub queued: Duration,
    /// What became of it.
    pub fate: Fate,
    /// What it carries.
    pub payload: T,
}

/// What became of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It came through.
    Delivered {
        /// The bit that is flipped on the way, from 0; whoever knows the bytes flips it ([`flip_bit`]), or
        /// treats the packet as its checksum would.
        corrupted_bit: Option<u64>,
        /// Whether it met congestion and is to be marked so (RFC 3168), instead of having been lost.
        marked: bool,
    },
    /// It is gone.
    Dropped(DropCause),
}

impl<T> Departure<T> {
    /// Whether it came through.
    #[must_use]
    pub fn is_delivered(&self) -> bool {
        matches!(self.fate, Fate::Delivered { .. })
    }

    /// Whether a bit of it is flipped.
    #[must_use]
    pub fn is_corrupted(&self) -> bool {
        let Fate::Delivered { corrupted_bit, .. } = self.fate else {
            return false;
        };
        corrupted_bit.is_some()
    }
}

/// Why a link dropped a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DropCause {
    /// Lost on the way by chance, by number, or as the replayed probe was.
    Loss,
    /// Lost in a scheduled outage.
    Outage,
    /// Larger than the MTU.
    Mtu,
    /// No room in the queue before the bottleneck.
    Queue,
    /// Dropped by `CoDel` from the head of the queue.
    Codel,
    /// As many packets in flight as the limit allows.
    Limit,
}

impl DropCause {
    /// Every cause.
    pub const ALL: [Self; 6] = [
        Self::Loss,
        Self::Outage,
        Self::Mtu,
        Self::Queue,
        Self::Codel,
        Self::Limit,
    ];

    /// The cause as reports spell it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Loss => "loss",
            Self::Outage => "outage",
            Self::Mtu => "mtu",
            Self::Queue => "queue",
            Self::Codel => "codel",
            Self::Limit => "limit",
        }
    }
}

/// Flips bit `bit` of a packet; beyond its end nothing happens.
pub fn flip_bit(contents: &mut [u8], bit: u64) {
    let at = usize::try_from(bit / 8).unwrap_or(usize::MAX);
    if let Some(byte) = contents.get_mut(at) {
        *byte ^= 1 << (bit % 8);
    }
}
