//! The order in which packets leave a link.

use std::cmp::Ordering;

use mmt_shared::time::Time;

use crate::packet::Departure;

/// Which of the copies of a packet it is: for each link passed a binary digit, 1 where it was made; 0 is the packet.
/// A chain has 9 links at most.
pub(super) type Lineage = u16;

/// A packet of an earlier link that is lost, on its way through the later ones: they draw for it, and it keeps the
/// place in their order that it would have had, so that a loss moves no other packet. Ordered as departures are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Lost {
    pub(super) due: Time,
    pub(super) place: u64,
    pub(super) copy: bool,
    pub(super) number: u64,
    pub(super) lineage: Lineage,
    pub(super) bytes: usize,
    pub(super) ecn_capable: bool,
    /// Whether it was lost on the way, and not before a bottleneck or for lack of room: those behind it come earlier.
    pub(super) keeps_place: bool,
}

/// What goes on from one link to the next.
pub(super) enum Next<T> {
    Packet(ByTime<T>),
    Lost(Lost),
}

/// A departure ordered by its time, then by its place among the packets of this link, a copy last.
#[derive(Clone, Debug)]
pub(super) struct ByTime<T> {
    pub(super) departure: Departure<T>,
    pub(super) place: u64,
    pub(super) lineage: Lineage,
    /// Whether its sender takes a mark for a loss: a link behind this one has to know.
    pub(super) ecn_capable: bool,
}

impl<T> ByTime<T> {
    pub(super) fn key(&self) -> (Time, u64, bool) {
        (self.departure.due, self.place, self.departure.copy)
    }
}

impl<T> PartialEq for ByTime<T> {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl<T> Eq for ByTime<T> {}

impl<T> PartialOrd for ByTime<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> Ord for ByTime<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key().cmp(&other.key())
    }
}
