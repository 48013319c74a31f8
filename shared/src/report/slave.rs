//! The slave's half of a session.

use serde::{Deserialize, Serialize};

use super::number::{Counts, Number, named};
use super::session::{DelayReport, SessionStats};
use crate::metrics::{ForceSummary, UpdateCounts};

/// What the slave alone counts and measures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SlaveHalf {
    /// What each end counts.
    pub session: SessionStats,
    /// What the trigger sent.
    pub updates: SentUpdates,
    /// The model's force against the measured one.
    pub force: ForceSummary,
    /// The model's force against the true one.
    pub true_force: TrueForce,
    /// What the estimator found.
    pub model: ModelReport,
    /// The tool.
    pub tool: ToolReport,
    /// Delay of the play-out, over the ticks.
    pub playout_delay_ms: DelayReport,
}

fn by_cause(counts: &UpdateCounts) -> Option<Counts> {
    Some(named(counts.by_cause().map(|(cause, n)| (cause.name(), n))))
}

/// Updates as the slave sent them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SentUpdates {
    /// Updates that the slave sent.
    pub sent: Option<u64>,
    /// Per second of the run, 1/s.
    pub rate_hz: Number,
    /// All updates of the run per second of contact, 1/s.
    pub contact_rate_hz: Number,
    /// Sent, by cause.
    pub by_cause: Option<Counts>,
    /// Repeats of them that the slave sent.
    pub repeated: Option<u64>,
    /// Repeats, by the cause of what they repeat.
    pub repeated_by_cause: Option<Counts>,
}

impl SentUpdates {
    /// From what the slave sent for the first time and what it repeated.
    pub fn new(sent: &UpdateCounts, repeated: &UpdateCounts) -> Self {
        Self {
            sent: Some(sent.total()),
            rate_hz: sent.rate_hz().into(),
            contact_rate_hz: sent.contact_rate_hz().into(),
            by_cause: by_cause(sent),
            repeated: Some(repeated.total()),
            repeated_by_cause: by_cause(repeated),
        }
    }
}

/// How near the model's force is to the true one, which only a simulation knows: as [`ForceSummary`] has it of the measured
/// one, with the true force in its place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TrueForce {
    /// PMSE (15).
    pub pmse_true: Number,
    /// Relative vector error.
    pub relative_error_true: Number,
    /// How long the tool pressed with more than F_min, s.
    pub contact_true_s: Number,
}

/// What the estimator found, beside the truth where it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ModelReport {
    /// Mass m, kg.
    pub mass_kg: EstimateReport,
    /// Viscous damping b, N s/m.
    pub damping_ns_per_m: EstimateReport,
    /// Coulomb friction c, N.
    pub friction_n: EstimateReport,
}

/// An estimate and the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EstimateReport {
    /// The last estimate; absent if the data could not show it.
    pub estimate: Number,
    /// The truth; absent outside simulation.
    pub truth: Number,
}

impl EstimateReport {
    /// From numbers that may be absent.
    pub fn new(estimate: impl Into<Number>, truth: impl Into<Number>) -> Self {
        Self {
            estimate: estimate.into(),
            truth: truth.into(),
        }
    }

    /// (estimate − truth)/truth; absent when either is, or the truth is 0.
    pub fn relative_error(&self) -> Number {
        let ratio = |(estimate, truth): (f64, f64)| (estimate - truth) / truth;
        self.estimate.get().zip(self.truth.get()).map(ratio).into()
    }
}

/// The slave's tool and the limits of its force and of its energy.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ToolReport {
    /// For how long the limit shortened its way, s.
    pub held_s: Number,
    /// Largest force that was measured between tool and object, N.
    pub force_peak_n: Number,
    /// Work of the tool on the object by the measured force, J.
    pub work_j: Number,
    /// Work of the hand on the model as the samples show it, J.
    pub hand_work_j: Number,
    /// For how long the limit of its energy shortened its way, s.
    pub energy_held_s: Number,
    /// Measured force over true force, as contacts have shown it; absent where it is not looked for, and before one has.
    pub sensor_gain: Number,
}
