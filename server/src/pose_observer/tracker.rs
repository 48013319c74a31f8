//! How the object is followed: as a box with faces; once vision has shown that it is none, by its tangent; pushed slowly,
//! by the force alone.

use mmt_shared::model::params::ModelParams;

use super::ground_moment::{Push, Turning};
use super::slow::{DIRECTION_RAD, SlowTracker};
use super::tangent_tracker::TangentTracker;

/// Disagreement about theta that no box causes, rad; six standard deviations of vision's noise if that is more.
const DISAGREEMENT_RAD: f64 = 0.05;
/// Images in a row that must disagree.
const IMAGES: u32 = 3;

/// Direction error of the force besides its noise (the face is not perfectly smooth), rad.
const DIRECTION_FLOOR_RAD: f64 = 2e-3;

/// What the object is taken for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Tracker {
    /// A box: theta is that of its faces.
    Box(BoxTracker),
    /// Any other body: theta is that of the tangent at the contact.
    Tangent(TangentTracker),
    /// Any body that is pushed slowly: theta is that of the force.
    Slow(SlowTracker),
}

impl Tracker {
    /// Whether the normal of this contact has not settled yet.
    pub(super) fn is_settling(&self) -> bool {
        matches!(self, Self::Tangent(tangent) if tangent.is_settling())
    }

    /// By how much the tracked face is turned against the body that vision sees, rad.
    pub(super) fn turned(&self) -> f64 {
        match self {
            Self::Box(_) | Self::Slow(_) => 0.0,
            Self::Tangent(tangent) => tangent.turned,
        }
    }

    /// Rate of that, rad/s.
    pub(super) fn slip(&self) -> f64 {
        match self {
            Self::Box(_) | Self::Slow(_) => 0.0,
            Self::Tangent(tangent) => tangent.slip,
        }
    }

    /// How far the next update leaves the box from the tool, m.
    pub(super) fn aside_m(&self) -> f64 {
        match self {
            Self::Box(_) | Self::Tangent(_) => 0.0,
            Self::Slow(slow) => slow.aside_m,
        }
    }

    /// Error of the force's direction besides its noise, rad.
    pub(super) fn direction_floor_rad(&self) -> f64 {
        match self {
            Self::Box(_) | Self::Tangent(_) => DIRECTION_FLOOR_RAD,
            Self::Slow(_) => DIRECTION_RAD,
        }
    }
}

/// What is known of a box beside its faces.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BoxTracker {
    pub(super) turning: Turning,
    /// Images in a row that disagree with touch about theta.
    disagreeing: u32,
    /// Something else turns the box in this contact: a wall that it slides along.
    other_moment: bool,
}

impl BoxTracker {
    /// omega (rad/s) after this tick's push, if that is known to be all that turns the box; `obstacle`: something holds it.
    pub(super) fn turned(
        &mut self,
        params: &ModelParams,
        push: &Push,
        obstacle: bool,
    ) -> Option<f64> {
        let push_is_all = !obstacle && !self.other_moment;
        self.turning.step(params, push, push_is_all)
    }

    /// Whether the moment of the push is reckoned with.
    pub(super) fn reckons(&self) -> bool {
        self.turning.is_learned() && !self.other_moment
    }

    /// What turned the box besides the push may be gone in the next contact.
    pub(super) fn let_go(&mut self) {
        self.other_moment = false;
    }

    /// Takes the angle (rad) by which an image of the touched box differs from the direction of the force; `noise` is vision's, rad
    /// r.m.s., and the tool's friction turns the force by up to `friction_angle` (rad). True if the images show that the body is no
    /// box: one bad image does not, and where the moment of the push was reckoned with, the first shows that something else turns it.
    pub(super) fn is_refuted(&mut self, turn: f64, noise: f64, friction_angle: f64) -> bool {
        let disagrees = turn.abs() > friction_angle + DISAGREEMENT_RAD.max(6.0 * noise);
        if disagrees && self.reckons() {
            self.other_moment = true;
            return false;
        }
        self.disagreeing = if disagrees { self.disagreeing + 1 } else { 0 };
        self.disagreeing >= IMAGES
    }
}
