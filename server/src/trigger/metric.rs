//! What a mismatch is measured by: the three metrics that section III-B names.
//!
//! The paper uses the force (12). The other two are made comparable to it: each is 1 where the model is
//! as wrong as it can usefully be, so that one Delta serves all three.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::params::ModelParams;
use serde::{Deserialize, Serialize};

/// Least m, b and c that a change is divided by: kg, N s/m, N. Below, nobody feels a relative change.
const PARAMETER_FLOORS: [f64; 3] = [0.05, 0.5, 0.1];
/// A shift (m) and a turn (rad) that count as 100 %: at 10 % they are 2 mm and 10 mrad.
const POSE_SCALES: (f64, f64) = (0.020, 0.100);

/// What the trigger compares with Delta.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MismatchMetric {
    /// (12): |f_s − f_m|/|f_s|, while both sides are in contact.
    #[default]
    Force,
    /// Largest relative change of m, b and c since the last update.
    Parameters,
    /// Larger of the shift over 20 mm and the turn over 100 mrad, between the shadow and the object as
    /// the slave sees it.
    Pose,
}

/// Largest relative change of m, b, c from `sent` to `now`, dimensionless.
pub(super) fn parameters(now: &ModelParams, sent: &ModelParams) -> f64 {
    [
        (now.m(), sent.m()),
        (now.b(), sent.b()),
        (now.c(), sent.c()),
    ]
    .into_iter()
    .zip(PARAMETER_FLOORS)
    .map(|((is, was), floor)| (is - was).abs() / was.abs().max(floor))
    .fold(0.0, f64::max)
}

/// Size of a shift (m) and a turn (rad) of the shadow, dimensionless.
pub(super) fn pose(shift: Vec2, turn: f64) -> f64 {
    (shift.norm() / POSE_SCALES.0).max(turn.abs() / POSE_SCALES.1)
}
