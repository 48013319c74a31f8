//! What becomes of a packet.

use mmt_shared::time::Time;
use serde::{Deserialize, Serialize};

/// The most deliveries one packet can have: itself and one copy.
pub const DELIVERIES_MAX: usize = 2;

/// What becomes of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It leaves, once or more.
    Deliver(Deliveries),
    /// It never leaves.
    Drop(DropCause),
}

impl Fate {
    /// The time at which the packet itself leaves, if it does.
    #[must_use]
    pub fn due(&self) -> Option<Time> {
        match self {
            Self::Deliver(deliveries) => Some(deliveries.itself().due),
            Self::Drop(_) => None,
        }
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

/// One departure of a packet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Delivery {
    /// The theoretical time of departure, on the clock of the offers.
    pub due: Time,
    /// The bit of the packet that is turned over on the way, from 0; whoever holds the packet turns it.
    pub corrupted_bit: Option<u64>,
    /// Whether it is marked as having met congestion (RFC 3168); whoever holds the packet marks it.
    pub marked: bool,
}

impl Delivery {
    /// An unharmed departure.
    #[must_use]
    pub fn at(due: Time) -> Self {
        Self {
            due,
            corrupted_bit: None,
            marked: false,
        }
    }
}

/// The departures of one packet: at least one, at most [`DELIVERIES_MAX`], the packet itself first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Deliveries {
    itself: Delivery,
    copies: [Option<Delivery>; DELIVERIES_MAX - 1],
}

impl Deliveries {
    /// One unharmed departure, no copy.
    #[must_use]
    pub fn one(due: Time) -> Self {
        Self::of(Delivery::at(due), None)
    }

    /// A departure and perhaps that of a copy.
    #[must_use]
    pub fn of(itself: Delivery, copy: Option<Delivery>) -> Self {
        Self {
            itself,
            copies: [copy],
        }
    }

    /// The departure of the packet itself.
    #[must_use]
    pub fn itself(&self) -> Delivery {
        self.itself
    }

    /// The departures of its copies.
    pub fn copies(&self) -> impl Iterator<Item = Delivery> + '_ {
        self.copies.iter().copied().flatten()
    }
}

/// Turns bit `bit` of a packet over; beyond its end nothing happens.
pub fn turn_bit(contents: &mut [u8], bit: u64) {
    let at = usize::try_from(bit / 8).unwrap_or(usize::MAX);
    if let Some(byte) = contents.get_mut(at) {
        *byte ^= 1 << (bit % 8);
    }
}
