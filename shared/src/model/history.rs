//! The ring of what the local model was at each HIP sample.
//!
//! Delay needs it: an update answers a sample of the past, so its pose must be compared with what the
//! model was *then*. Entries are found by stamp, by search, never by index arithmetic, because ticks may
//! have been skipped. It allocates once, when made.

use std::time::Duration;

use crate::model::contact::GodObject;
use crate::model::dynamics::Motion;
use crate::model::geometry::Vec2;
use crate::time::Time;

/// Length of the ring, ticks: 8.192 s, more than a round trip at 2 s one way and a second to spare.
pub const HISTORY_TICKS: usize = 8192;

/// A change of pose, added up: shift of the centre and turn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseChange {
    /// Shift of the centre, world, m.
    pub shift: Vec2,
    /// Turn, rad.
    pub turn: f64,
}

/// The local model at one HIP sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Stamp of the HIP sample.
    pub stamp: Time,
    /// The HIP, m.
    pub hip: Vec2,
    /// Velocity of the HIP, m/s.
    pub hip_velocity: Vec2,
    /// Pose and velocity that the HIP met, before the step.
    pub motion: Motion,
    /// The proxy's memory, before the step.
    pub god: GodObject,
    /// For how long the HIP had touched the box before.
    pub touched: Duration,
    /// Sum of all corrections applied up to this sample.
    pub corrected: PoseChange,
}

/// A ring of [`Moment`]s in the order of their stamps.
#[derive(Clone, Debug)]
pub struct History {
    moments: Box<[Moment]>,
    /// Where the next moment goes.
    next: usize,
    len: usize,
}

impl History {
    /// An empty ring for `capacity` moments (at least one).
    pub fn with_capacity(capacity: usize) -> Self {
        let moments = vec![Moment::default(); capacity.max(1)].into_boxed_slice();
        Self {
            moments,
            next: 0,
            len: 0,
        }
    }

    /// Number of moments held.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether nothing has been recorded.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Records a moment; the oldest is forgotten when the ring is full. A stamp that is not later than
    /// the newest is ignored, so that the order holds.
    pub fn push(&mut self, moment: Moment) {
        if self
            .newest()
            .is_some_and(|newest| moment.stamp <= newest.stamp)
        {
            return;
        }
        if let Some(slot) = self.moments.get_mut(self.next) {
            *slot = moment;
        }
        self.next = (self.next + 1) % self.moments.len();
        self.len = (self.len + 1).min(self.moments.len());
    }

    /// The newest moment.
    pub fn newest(&self) -> Option<&Moment> {
        self.nth(self.len.checked_sub(1)?)
    }

    /// The newest moment whose stamp is not later than `stamp`; the oldest held if all are later.
    pub fn at(&self, stamp: Time) -> Option<&Moment> {
        self.nth(self.first_after(stamp).saturating_sub(1))
    }

    /// The moment whose stamp is nearest to `stamp`; none if that lies before the oldest held.
    pub fn nearest(&self, stamp: Time) -> Option<&Moment> {
        let after = self.first_after(stamp);
        let before = self.nth(after.checked_sub(1)?)?;
        let closer = self.nth(after).filter(|after| {
            after.stamp.saturating_since(stamp) < stamp.saturating_since(before.stamp)
        });
        closer.or(Some(before))
    }

    /// Number of the first moment, counted from the oldest held, whose stamp is later than `stamp`; the
    /// number of moments held if there is none.
    pub fn first_after(&self, stamp: Time) -> usize {
        self.partition(|moment| moment.stamp <= stamp)
    }

    /// The same for the first moment whose stamp is not before `stamp`.
    pub fn first_not_before(&self, stamp: Time) -> usize {
        self.partition(|moment| moment.stamp < stamp)
    }

    /// Number of the moments at the beginning for which `early` holds.
    fn partition(&self, early: impl Fn(&Moment) -> bool) -> usize {
        let (mut low, mut high) = (0, self.len);
        while low < high {
            let middle = low.midpoint(high);
            if self.nth(middle).is_some_and(&early) {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        low
    }

    /// The moment number `index`, counted from the oldest held.
    pub fn nth(&self, index: usize) -> Option<&Moment> {
        if index >= self.len {
            return None;
        }
        let start = self.next + self.moments.len() - self.len;
        self.moments.get((start + index) % self.moments.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(stamps: &[u64]) -> History {
        let mut history = History::with_capacity(4);
        for &ms in stamps {
            history.push(Moment {
                stamp: Time::from_millis(ms),
                ..Moment::default()
            });
        }
        history
    }

    fn found(history: &History, ms: u64) -> Option<u64> {
        history
            .at(Time::from_millis(ms))
            .map(|moment| moment.stamp.as_nanos() / 1_000_000)
    }

    #[test]
    fn a_stamp_is_found_by_search_although_ticks_were_skipped() {
        let history = ring(&[10, 11, 15, 16]);
        assert_eq!(found(&history, 11), Some(11));
        assert_eq!(found(&history, 14), Some(11));
        assert_eq!(found(&history, 99), Some(16));
        assert_eq!(
            found(&history, 1),
            Some(10),
            "older than all: the oldest held"
        );
    }

    #[test]
    fn the_oldest_is_forgotten_and_the_order_kept() {
        let history = ring(&[1, 2, 3, 4, 5, 6, 6, 2]);
        assert_eq!(history.len(), 4);
        assert_eq!(found(&history, 0), Some(3));
        assert_eq!(found(&history, 6), Some(6));
        assert_eq!(
            history.newest().map(|m| m.stamp),
            Some(Time::from_millis(6))
        );
    }

    #[test]
    fn an_empty_ring_finds_nothing() {
        assert!(ring(&[]).is_empty());
        assert_eq!(found(&ring(&[]), 5), None);
    }
}
