//! What the scripted operator sees, and what it is doing.

use mmt_shared::model::geometry::{BoxFootprint, Face, Pose, Vec2, rotate};
use serde::{Deserialize, Serialize};

/// The box as the operator sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// `world_from_object`.
    pub pose: Pose,
    /// How large it is.
    pub footprint: BoxFootprint,
    /// Whether the HIP touches it.
    pub in_contact: bool,
}

impl View {
    pub(super) fn is_finite(&self) -> bool {
        self.pose.is_finite()
            && Face::ALL
                .iter()
                .all(|face| self.footprint.offset(*face).is_finite())
    }

    /// Inward unit normal of a face, world frame.
    pub(super) fn inward(&self, face: Face) -> Vec2 {
        rotate(self.pose.angle, -face.outward())
    }
}

/// What the scripted operator is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// On the way to the stand-off in front of the face.
    Travel,
    /// Slowly towards the face, until it touches.
    Approach,
    /// Rests after a nudge, with a light press.
    Dwell,
    /// Pushes.
    Push,
    /// Rests at the end of a push.
    Hold,
    /// Backs off.
    Retract,
}
