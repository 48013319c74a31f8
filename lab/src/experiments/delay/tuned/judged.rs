//! An architecture at a delay, untuned and tuned.

use crate::experiments::delay::grid_point::GridPoint;
use crate::experiments::delay::tuning::Tried;

/// An architecture at a delay: what it is run with where nobody tunes it, and tuned.
pub(in crate::experiments::delay) struct Judged<'a> {
    pub(in crate::experiments::delay) untuned: &'a Tried,
    pub(in crate::experiments::delay) tuned: &'a Tried,
}

impl Judged<'_> {
    pub(in crate::experiments::delay) fn point(&self) -> GridPoint {
        self.tuned.case.point
    }
}
