//! A box that stands in for a body that is none: its touched face is the tangent at the contact.
//!
//! On a disc or a polygon the direction of the force is not that of a face of the bounding box, so touch and
//! vision disagree about theta by far more than their noises. Once they do, the body counts as no box: theta
//! is that of the tangent, the offset is that of this contact, and the centre is vision's. It must never
//! take a box for anything else because of one bad image, and never be asked in paper mode.

use mmt_shared::model::geometry::wrap_angle;
use mmt_shared::time::{TICK, TICK_S, Time};

/// Disagreement about theta that no box causes, rad; six standard deviations of vision's noise if that is more.
const DISAGREEMENT_RAD: f64 = 0.05;
/// Images in a row that must disagree.
const IMAGES: u32 = 3;
/// Time that the normal of a new contact is given to settle, ticks.
const FRESH_TICKS: u32 = 30;
/// Time constant of the rate at which the tangent turns, s.
const RATE_S: f64 = 0.050;
/// Weight of an image in what the stand-in is turned by, and in the rate of that: an alpha-beta filter of
/// critical memory, beta = alpha²/(2 − alpha).
const TURNED_WEIGHT: (f64, f64) = (0.3, 0.053);
/// Least weight of an image in the offset of a contact.
const OFFSET_WEIGHT: f64 = 0.1;

/// What is known of the stand-in.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StandIn {
    disagreeing: u32,
    active: bool,
    /// By how much the stand-in is turned against the body that vision sees, rad.
    turned: f64,
    /// Rate of that, rad/s: 0 on the flat edge of a polygon, but not on a disc.
    slip: f64,
    /// When the last image of this contact was taken.
    seen: Option<Time>,
    /// Ticks until the normal of this contact has settled.
    fresh: u32,
    /// Images since it has.
    images: u32,
    rate: f64,
    /// Least offset of a contact so far, m.
    least: Option<f64>,
}

impl StandIn {
    /// Whether the body was found to be no box.
    pub(super) fn is_active(&self) -> bool {
        self.active
    }

    /// Whether the normal of this contact has not settled yet.
    pub(super) fn is_fresh(&self) -> bool {
        self.fresh > 0
    }

    /// By how much the stand-in is turned against the body that vision sees, rad.
    pub(super) fn turned(&self) -> f64 {
        self.turned
    }

    /// Rate at which the tangent turns, rad/s.
    pub(super) fn rate(&self) -> f64 {
        self.rate
    }

    /// Rate at which the body itself turns under a tangent that turns at `omega`, rad/s.
    pub(super) fn body_rate(&self, omega: f64) -> f64 {
        omega - self.slip
    }

    /// A new contact, or one whose normal jumped.
    pub(super) fn begin(&mut self) {
        self.fresh = FRESH_TICKS;
        self.images = 0;
        self.rate = 0.0;
        self.seen = None;
    }

    /// One tick of touch with the tangent turning at `omega` (rad/s).
    pub(super) fn touch(&mut self, omega: f64) {
        if self.fresh > 0 {
            self.fresh -= 1;
        } else {
            self.rate += (omega - self.rate) * (TICK_S / RATE_S);
        }
    }

    /// Takes the angle (rad) by which an image of a touched body, taken at `taken`, differs from what touch
    /// said then; `noise` is vision's, rad r.m.s. Says whether this image shows that the body is no box.
    pub(super) fn see(&mut self, taken: Time, turn: f64, noise: f64) -> bool {
        if self.active {
            self.follow(taken, turn);
            return false;
        }
        let disagrees = turn.abs() > DISAGREEMENT_RAD.max(6.0 * noise);
        self.disagreeing = if disagrees { self.disagreeing + 1 } else { 0 };
        if self.disagreeing < IMAGES {
            return false;
        }
        self.active = true;
        self.turned = -turn;
        self.begin();
        true
    }

    fn follow(&mut self, taken: Time, turn: f64) {
        if self.is_fresh() {
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
