//! A body that is no box, followed by the tangent at the contact: the touched face of a box that stands in for it.
//!
//! On a disc or a polygon the direction of the force is not that of a face of the bounding box, so touch and
//! vision disagree about theta by far more than their noises. theta is then that of the tangent, the offset is that of
//! this contact, and the centre is vision's. It must never be used in paper mode.

use mmt_shared::model::geometry::wrap_angle;
use mmt_shared::time::{TICK, TICK_S, Time};

/// Time that the normal of a new contact is given to settle, ticks.
const SETTLING_TICKS: u32 = 30;
/// Time constant of the rate at which the tangent turns, s.
const RATE_S: f64 = 0.050;
/// Weight of an image in what the tangent is turned by, and in the rate of that: an alpha-beta filter of
/// critical memory, beta = alpha²/(2 − alpha).
const TURNED_WEIGHT: (f64, f64) = (0.3, 0.053);
/// Least weight of an image in the offset of a contact.
const OFFSET_WEIGHT: f64 = 0.1;

/// What is known of the tangent.
#[derive(Clone, Copy, Debug)]
pub(super) struct TangentTracker {
    /// By how much the tangent is turned against the body that vision sees, rad.
    pub(super) turned: f64,
    /// Rate of that, rad/s: 0 on the flat edge of a polygon, but not on a disc.
    pub(super) slip: f64,
    /// Rate at which the tangent turns, rad/s.
    pub(super) rate: f64,
    /// When the last image of this contact was taken.
    seen: Option<Time>,
    /// Ticks until the normal of this contact has settled.
    settling: u32,
    /// Images since it has.
    images: u32,
    /// Least offset of a contact so far, m.
    least: Option<f64>,
}

impl TangentTracker {
    /// A new contact with a tangent that is turned against the body by `turned`, rad.
    pub(super) fn new(turned: f64) -> Self {
        Self {
            turned,
            slip: 0.0,
            rate: 0.0,
            seen: None,
            settling: SETTLING_TICKS,
            images: 0,
            least: None,
        }
    }

    /// Whether the normal of this contact has not settled yet.
    pub(super) fn is_settling(&self) -> bool {
        self.settling > 0
    }

    /// A new contact, or one whose normal jumped.
    pub(super) fn begin(&mut self) {
        self.settling = SETTLING_TICKS;
        self.images = 0;
        self.rate = 0.0;
        self.seen = None;
    }

    /// One tick of touch with the tangent turning at `omega` (rad/s).
    pub(super) fn touch(&mut self, omega: f64) {
        if self.is_settling() {
            self.settling -= 1;
        } else {
            self.rate += (omega - self.rate) * (TICK_S / RATE_S);
        }
    }

    /// Takes the angle (rad) by which an image of the touched body, taken at `taken`, differs from touch then.
    pub(super) fn see(&mut self, taken: Time, turn: f64) {
        if self.is_settling() {
            return;
        }
        let Some(before) = self.seen.replace(taken) else {
            self.turned = wrap_angle(self.turned - turn);
            return;
        };
        let seconds = taken.saturating_since(before).max(TICK).as_secs_f64();
        let predicted = self.slip * seconds;
        let (alpha, beta) = TURNED_WEIGHT;
        let error = -turn - predicted;
        self.turned = wrap_angle(self.turned + predicted + alpha * error);
        self.slip += beta * error / seconds;
    }

    /// The least offset (m) of the contacts so far, of which the last had `offset`.
    pub(super) fn least_offset(&mut self, offset: f64) -> f64 {
        let least = self.least.map_or(offset, |least| least.min(offset));
        self.least = Some(least);
        least
    }

    /// Weight of the next image in the offset of this contact.
    pub(super) fn offset_weight(&mut self) -> f64 {
        self.images = self.images.saturating_add(1);
        (1.0 / f64::from(self.images)).max(OFFSET_WEIGHT)
    }
}
