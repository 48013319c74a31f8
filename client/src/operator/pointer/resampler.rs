//! Readings at the page's irregular times, read at any time between them.
//!
//! It never extrapolates: before its oldest reading and after its newest it holds them.

use std::collections::VecDeque;

use super::sample::PointerSample;
use mmt_shared::model::geometry::Vec2;

/// Readings kept: a quarter of a second at 1 kHz, more than play-out and silence together.
const KEPT: usize = 256;

/// The last readings, oldest first, in strictly increasing time.
#[derive(Clone, Debug)]
pub(super) struct Resampler(VecDeque<PointerSample>);

impl Resampler {
    pub(super) fn new() -> Self {
        Self(VecDeque::with_capacity(KEPT))
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Takes a reading; one that is no newer than the newest is not taken.
    pub(super) fn push(&mut self, sample: PointerSample) {
        if self
            .0
            .back()
            .is_some_and(|newest| sample.page_s <= newest.page_s)
        {
            return;
        }
        if self.0.len() == KEPT {
            self.0.pop_front();
        }
        self.0.push_back(sample);
    }

    /// Where the pointer was at `page_s`, m, linear between two readings; none before the first.
    pub(super) fn at(&self, page_s: f64) -> Option<Vec2> {
        let after = self.0.partition_point(|sample| sample.page_s <= page_s);
        let before = after.checked_sub(1).and_then(|index| self.0.get(index));
        match (before, self.0.get(after)) {
            (Some(a), Some(b)) => {
                let share = (page_s - a.page_s) / (b.page_s - a.page_s);
                Some(a.at + (b.at - a.at) * share)
            }
            (Some(held), None) | (None, Some(held)) => Some(held.at),
            (None, None) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(page_s: f64, x: f64) -> PointerSample {
        PointerSample {
            page_s,
            at: Vec2::new(x, -x),
        }
    }

    #[test]
    fn it_is_linear_between_readings_and_holds_at_both_ends() {
        let mut resampler = Resampler::new();
        assert_eq!(resampler.at(1.0), None);
        resampler.push(sample(1.0, 0.1));
        resampler.push(sample(1.010, 0.2));
        resampler.push(sample(1.012, 0.6));
        for (at, x) in [
            (0.5, 0.1),
            (1.0, 0.1),
            (1.005, 0.15),
            (1.010, 0.2),
            (1.011, 0.4),
            (1.012, 0.6),
            (9.0, 0.6),
        ] {
            let found = resampler.at(at).unwrap();
            assert!((found - Vec2::new(x, -x)).norm() < 1e-9, "{at}: {found}");
        }
    }

    #[test]
    fn a_reading_that_is_not_newer_is_not_taken_and_no_more_than_its_room_is_kept() {
        let mut resampler = Resampler::new();
        let room = resampler.0.capacity();
        resampler.push(sample(1.0, 0.1));
        resampler.push(sample(1.0, 0.9));
        resampler.push(sample(0.9, 0.9));
        assert_eq!(resampler.at(2.0), Some(Vec2::new(0.1, -0.1)));
        for n in 0..10_000 {
            resampler.push(sample(2.0 + f64::from(n) * 1e-3, 0.5));
        }
        assert_eq!((resampler.0.len(), resampler.0.capacity()), (KEPT, room));
    }
}
