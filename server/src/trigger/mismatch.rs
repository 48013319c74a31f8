//! How far the model that the master has is from what the slave sees: the metrics that III-B names.
//!
//! Holds the left side of (12). Every metric is a pure function of one tick's input and has no unit, so
//! that one Delta bounds any of them.

use mmt_shared::geometry::wrap_angle;
use serde::{Deserialize, Serialize};

use super::TriggerInput;

/// Acceleration (m/s²) and speed (m/s) of a typical push, at which parameters are compared: 30 % of
/// 0.15 m/s at 1 Hz, and 0.15 m/s.
const TYPICAL: (f64, f64) = (0.3, 0.15);
/// What counts as a mismatch of 1 in position, m: Delta = 10 % is then 1 mm.
const POSITION_SCALE_M: f64 = 0.010;
/// What counts as a mismatch of 1 in orientation, rad: Delta = 10 % is then 10 mrad.
const ANGLE_SCALE_RAD: f64 = 0.100;

/// By what the mismatch is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Metric {
    /// (12): the force error relative to the measured force.
    #[default]
    Force,
    /// The change of m, b and c since the last update, as the force it makes in a typical push relative
    /// to the force of that push.
    Parameters,
    /// The larger of the position error over 10 mm and the orientation error over 100 mrad.
    Pose,
}

impl Metric {
    /// The mismatch, without unit, not negative; NaN if the input is not finite.
    ///
    /// `floor_n` (N) bounds the denominator of (12) from below.
    #[must_use]
    pub fn mismatch(self, input: &TriggerInput, floor_n: f64) -> f64 {
        match self {
            Self::Force => force_mismatch(input, floor_n),
            Self::Parameters => parameter_mismatch(input),
            Self::Pose => pose_mismatch(input),
        }
    }
}

fn force_mismatch(input: &TriggerInput, floor_n: f64) -> f64 {
    // (12)
    (input.f_s - input.f_m).norm() / input.f_s.norm().max(floor_n)
}

fn parameter_mismatch(input: &TriggerInput) -> f64 {
    let (now, sent, (a, v)) = (&input.candidate, &input.sent, TYPICAL);
    let change = (now.m() - sent.m()).abs() * a
        + (now.b() - sent.b()).abs() * v
        + (now.c() - sent.c()).abs();
    // a mass is never zero, so neither is the force
    change / (sent.m() * a + sent.b() * v + sent.c())
}

fn pose_mismatch(input: &TriggerInput) -> f64 {
    let apart = (input.object.position - input.model.position).norm();
    (apart / POSITION_SCALE_M).max(turned(input) / ANGLE_SCALE_RAD)
}

/// Orientation error of the master's model, rad, not negative.
pub(super) fn turned(input: &TriggerInput) -> f64 {
    wrap_angle(input.object.angle - input.model.angle).abs()
}

/// Force (N) by which the update would change what the model renders in the present motion.
pub(super) fn force_change(input: &TriggerInput) -> f64 {
    let (now, sent) = (&input.candidate, &input.sent);
    (now.m() - sent.m()).abs() * input.acceleration.abs()
        + ((now.b() - sent.b()) * input.speed + (now.c() - sent.c())).abs()
}
