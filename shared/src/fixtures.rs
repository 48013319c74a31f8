//! What the tests of every crate build again and again. Behind the feature `fixtures`, for tests alone.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use crate::model::contact::Coupling;
use crate::model::geometry::{BoxFootprint, Face, Pose, Twist};
use crate::model::params::{ModelParams, ModelState};
use crate::model::update::{Cause, Update};
use crate::time::Time;

/// 1000 N/m with its contact damping: the coupling of the default device.
pub const COUPLING: Coupling = Coupling {
    stiffness_n_per_m: 1000.0,
    damping_ns_per_m: 10.0,
};

/// A square of side `side_m`, m, at rest at the origin: m in kg, b in N s/m, c in N.
///
/// # Panics
/// The parameters are not accepted.
pub fn square_at_rest(m: f64, b: f64, c: f64, side_m: f64) -> ModelState {
    let params = ModelParams::of_square(m, b, c, side_m, &COUPLING).unwrap();
    let footprint = BoxFootprint::square(side_m);
    ModelState::try_new(
        params,
        footprint,
        Pose::default(),
        Twist::default(),
        &COUPLING,
    )
    .unwrap()
}

/// An update that answers the sample of so many milliseconds, while the slave's tool touches the west face.
pub fn update(sequence: u32, cause: Cause, answers_ms: u64, state: ModelState) -> Update {
    Update {
        sequence,
        cause,
        answers: Time::from_millis(answers_ms),
        touched_face: Some(Face::West),
        state,
    }
}
