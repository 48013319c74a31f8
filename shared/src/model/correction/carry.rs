//! A box that stands is carried back to its place together with the HIP.
//!
//! The hand was let into what does not move, for a round trip. A box that friction holds has no energy to come back
//! with. Carried with the HIP it needs none: neither moves against the other, the force stays as it is, and the hand stays
//! where it is.

use crate::model::contact::Touch;
use crate::model::geometry::Vec2;
use crate::time::TICK_S;

/// A box that is this far behind its place, m, is carried.
const FROM_M: f64 = 5e-3;
/// It is carried to within this of its place, m.
const TO_M: f64 = 5e-4;
/// How fast, m/s: a tool can follow at 0.6.
const M_PER_S: f64 = 0.5;

/// The way of box and HIP.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Carry {
    /// Whether the box is on its way.
    carries: bool,
    /// The way before the next sample, m.
    shift: Vec2,
}

impl Carry {
    /// Plans the way before the next sample. `remaining` is the shift (m) that the box is to make, `touch` what the HIP
    /// touches, `stands` whether friction holds the box.
    pub(super) fn plan(&mut self, remaining: Vec2, touch: Option<&Touch>, stands: bool) {
        let behind = touch.map_or(0.0, |touch| -touch.inward.dot(&remaining));
        let least = if self.carries { TO_M } else { FROM_M };
        self.carries = stands && behind > least;
        let way = touch.filter(|_| self.carries);
        self.shift = way.map_or(Vec2::zeros(), |touch| {
            -touch.inward * behind.min(M_PER_S * TICK_S)
        });
    }

    /// The planned way, m.
    pub(super) fn shift(&self) -> Vec2 {
        self.shift
    }

    /// The planned way (m), once.
    pub(super) fn take(&mut self) -> Vec2 {
        std::mem::take(&mut self.shift)
    }
}
