//! An object that is pushed so slowly that the push equals the ground's friction.
//!
//! Nothing is known of its outline, and the tool's own friction tilts the force against the surface. What the hand can feel
//! of it is the line of the force and how hard it is: the model is a small box right behind the tool, whose face is normal
//! to the force and so far back that the model renders the force that was measured. Where nobody touches the object, it is
//! where vision sees it. It must never use an image of a push for more than where the object lies afterwards.

use mmt_shared::model::geometry::Pose;

/// By how much the ripple of the ground turns the force, rad: 0.1 N of 4 N.
pub(super) const DIRECTION_RAD: f64 = 0.025;
/// e/c of a model that does not turn, m: the force of a tool with friction turns with neither the object nor the tool.
pub(super) const RADIUS_M: f64 = 1.0;
/// Ticks of a new contact in which the force may turn as it likes: the contact gives before the object slides.
const SETTLING_TICKS: u32 = 150;
/// A box that has to come round the tool keeps this far from it, m: twice what the master keeps free.
const ASIDE_M: f64 = 1e-3;

/// What is known of a slow push.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SlowTracker {
    /// Ticks until its force has a direction.
    settling: u32,
    /// Updates that brought the box to a master that had not met it.
    approaches: u32,
    /// How far the next one leaves it from the tool, m.
    pub(super) aside_m: f64,
    /// The newest image: where the object lies when it is let go.
    seen: Option<Pose>,
    /// The box that the next contact is expected to be with.
    pub(super) expected: Option<Pose>,
}

impl SlowTracker {
    /// A new contact.
    pub(super) fn begin(&mut self) {
        *self = Self {
            settling: SETTLING_TICKS,
            ..Self::default()
        };
    }

    /// One tick of touch. Returns whether the force has no direction yet.
    pub(super) fn touch(&mut self) -> bool {
        self.aside_m = 0.0;
        let settles = self.settling > 0;
        self.settling = self.settling.saturating_sub(1);
        settles
    }

    /// The master has not met the box that is pushed `depth` (m) deep. Every other time it is sent one that the tool
    /// does not touch: on its way the box may have come to stand beside the tool.
    pub(super) fn approach(&mut self, depth: f64) {
        let aside = self.approaches % 2 == 1;
        self.aside_m = if aside { depth + ASIDE_M } else { 0.0 };
        self.approaches += 1;
    }

    /// Takes in where an image of the push shows the object.
    pub(super) fn see(&mut self, pose: Pose) {
        self.seen = Some(pose);
    }

    /// Where an object that is let go lies, at rest; none if no image of the push came.
    pub(super) fn take_seen(&mut self) -> Option<Pose> {
        self.seen.take()
    }
}
