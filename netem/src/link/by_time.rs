//! The order in which packets leave a link.

use std::cmp::Ordering;

use mmt_shared::time::Time;

use crate::packet::Departure;

/// A departure ordered by its time, then by its place among the packets of this link, a copy last.
#[derive(Clone, Debug)]
pub(super) struct ByTime<T> {
    pub(super) departure: Departure<T>,
    pub(super) place: u64,
    /// Whether its sender takes a mark for a loss: a link behind this one has to know.
    pub(super) ecn_capable: bool,
}

impl<T> ByTime<T> {
    fn key(&self) -> (Time, u64, bool) {
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
