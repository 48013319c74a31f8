//! The master's half of a session.

use serde::{Deserialize, Serialize};

use super::number::{Counts, Number};
use super::session::SessionStats;
use crate::metrics::{AgeOfInformation, ContactBreaks, ForcePeak, PoseError};

/// What the master alone counts and measures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct MasterHalf {
    /// What each end counts.
    pub session: SessionStats,
    /// The operator's work.
    pub pushes: PushesReport,
    /// What became of the updates.
    pub updates: ReceivedUpdates,
    /// The force on the hand.
    pub force: HandForce,
    /// Pose error of the model; absent where the truth is not known.
    pub pose: PoseReport,
    /// Energy at the hand.
    pub passivity: PassivityReport,
}

/// What the operator did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PushesReport {
    /// Pushes that went over their whole length.
    pub completed: Option<u64>,
    /// Contact breaks per completed push, at the master.
    pub contact_breaks_per_push: Number,
}

impl PushesReport {
    /// From the pushes completed and the contact of the master's model.
    pub fn new(completed: u64, breaks: &ContactBreaks) -> Self {
        Self {
            completed: Some(completed),
            contact_breaks_per_push: breaks.per_push(completed).into(),
        }
    }
}

/// Updates as the master received them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ReceivedUpdates {
    /// Updates that the master's model took.
    pub applied: Option<u64>,
    /// Updates that arrived and were not applied, by cause.
    pub dropped: Option<Counts>,
    /// Age of the update that the model rests on.
    pub age_ms: AgeReport,
}

/// Age of information at the master, ms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct AgeReport {
    /// Mean over the ticks.
    pub mean: Number,
    /// Largest.
    pub max: Number,
}

impl From<&AgeOfInformation> for AgeReport {
    fn from(age: &AgeOfInformation) -> Self {
        let ms = |age: std::time::Duration| age.as_secs_f64() * 1e3;
        Self {
            mean: age.mean().map(ms).into(),
            max: age.largest().map(ms).into(),
        }
    }
}

/// The force on the hand, after the limiter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct HandForce {
    /// Largest force on the hand, N.
    pub largest_n: Number,
    /// Largest change of the force on the hand in one tick, N.
    pub largest_step_n: Number,
}

impl From<&ForcePeak> for HandForce {
    fn from(peak: &ForcePeak) -> Self {
        Self {
            largest_n: peak.largest_n().into(),
            largest_step_n: peak.largest_step_n().into(),
        }
    }
}

/// Pose error of the master's model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PoseReport {
    /// Position, root mean square, m.
    pub position_rms_m: Number,
    /// Position, largest, m.
    pub position_max_m: Number,
    /// Orientation, root mean square, rad.
    pub angle_rms_rad: Number,
    /// Orientation, largest, rad.
    pub angle_max_rad: Number,
}

impl From<&PoseError> for PoseReport {
    fn from(error: &PoseError) -> Self {
        Self {
            position_rms_m: error.position_rms_m().into(),
            position_max_m: error.position_max_m().into(),
            angle_rms_rad: error.angle_rms_rad().into(),
            angle_max_rad: error.angle_max_rad().into(),
        }
    }
}

/// Energy at the hand; `docs/passivity.md` explains what the two mean together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PassivityReport {
    /// Energy that updates added to the master's model beyond what its tank paid, J.
    pub energy_injected_j: Number,
    /// The least that the passivity observer at the hand ever showed, J.
    pub observer_min_j: Number,
    /// What it showed at the end, J: the work of the hand.
    pub hand_work_j: Number,
}
