//! What the two sides send each other about the tool and the hand: port energies, force, and the scene for viewers.

use serde::{Deserialize, Serialize};

use crate::model::geometry::{Pose, Vec2};
use crate::model::sample::ForceCounts;
use crate::time::Time;

/// Default of the greatest force with which the tool presses, N. The hand presses with 8 N at the most (`device`'s profiles), so a
/// tool that does what is felt stays below it; and it is the bound that outages are held to (15 N after 60 ms,
/// `lab/src/world/tests/hard.rs`).
pub const TOOL_FORCE_MAX_N: f64 = 15.0;
/// Accepted greatest forces, N: from twice the force that counts as noise up to what no tabletop arm exerts.
pub const TOOL_FORCE_N: (f64, f64) = (0.1, 1000.0);

/// What the hand's port sends to the tool's: time-domain passivity control (TDPA) holds each side to what went in at
/// the other (`docs/baselines.md`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HandPort {
    /// E_in, the energy that went in at the hand so far, J; it only grows.
    pub in_j: f64,
}

/// What the tool feels, where the hand may feel it too.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tool {
    /// Stamp of the HIP sample that the tool was at, by the master's clock: its age is the round trip that the hand
    /// would feel, play-out included.
    pub answers: Time,
    /// f_s, the measured contact force on the object.
    pub force: ForceCounts,
    /// Whether the tool touches the object.
    pub in_contact: bool,
    /// E_in of the tool's port, J; it only grows.
    pub in_j: f64,
}

/// What a viewer sees of the remote scene between updates; the model never uses it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Stamp of the HIP sample that the slave was at, by the master's clock.
    pub answers: Time,
    /// The object as the slave sees it.
    pub object: Pose,
    /// The tool, m.
    pub tool: Vec2,
    /// Measured contact force f_s on the object, N; zero where the tool does not touch it.
    pub force: Vec2,
}
