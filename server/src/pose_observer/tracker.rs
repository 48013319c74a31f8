//! How the object is followed: as a box with faces, or, once vision has shown that it is none, by its tangent.

use super::tangent_tracker::TangentTracker;
use super::turning::Turning;

/// Disagreement about theta that no box causes, rad; six standard deviations of vision's noise if that is more.
const DISAGREEMENT_RAD: f64 = 0.05;
/// Images in a row that must disagree.
const IMAGES: u32 = 3;

/// What the object is taken for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Tracker {
    /// A box: theta is that of its faces.
    Box(BoxTracker),
    /// Any other body: theta is that of the tangent at the contact.
    Tangent(TangentTracker),
}

impl Tracker {
    /// Whether the normal of this contact has not settled yet.
    pub(super) fn is_settling(&self) -> bool {
        matches!(self, Self::Tangent(tangent) if tangent.is_settling())
    }

    /// By how much the tracked face is turned against the body that vision sees, rad.
    pub(super) fn turned(&self) -> f64 {
        match self {
            Self::Box(_) => 0.0,
            Self::Tangent(tangent) => tangent.turned,
        }
    }

    /// Rate of that, rad/s.
    pub(super) fn slip(&self) -> f64 {
        match self {
            Self::Box(_) => 0.0,
            Self::Tangent(tangent) => tangent.slip,
        }
    }
}

/// What is known of a box beside its faces.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BoxTracker {
    pub(super) turning: Turning,
    /// Images in a row that disagree with touch about theta.
    disagreeing: u32,
}

impl BoxTracker {
    /// Takes the angle (rad) by which an image of the touched box differs from touch; `noise` is vision's, rad r.m.s.
    /// True if the images show that the body is no box: one bad image does not.
    pub(super) fn is_refuted(&mut self, turn: f64, noise: f64) -> bool {
        let disagrees = turn.abs() > DISAGREEMENT_RAD.max(6.0 * noise);
        self.disagreeing = if disagrees { self.disagreeing + 1 } else { 0 };
        self.disagreeing >= IMAGES
    }
}
