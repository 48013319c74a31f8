//! The paper's experiments and those that go beyond them, one file each, and the list of them.
//!
//! An experiment must never depend on the order in which its runs end, nor on the machine they run on.

mod ablation;
mod bound;
mod claims;
mod congestion;
mod delay;
mod fig5;
mod loss;
mod netem;
mod physics;
mod readings;
mod recovery;
mod repeats;
pub mod scenarios;
mod schemes;
mod sensing;
mod stiffness;
mod touch;
mod traces;
mod transport;
mod tupdate;
mod worlds;

use crate::experiment::description::Experiment;

/// Every experiment, in the order in which they run.
pub const ALL: &[&Experiment] = &[
    &physics::PHYSICS,
    &fig5::FIG5,
    &bound::EXPERIMENT,
    &traces::FIG6,
    &traces::FIG7,
    &claims::CLAIMS,
    &ablation::ABLATION,
    &readings::EXPERIMENT,
    &schemes::SCHEMES,
    &scenarios::EXPERIMENT,
    &sensing::EXPERIMENT,
    &stiffness::EXPERIMENT,
    &touch::EXPERIMENT,
    &tupdate::TUPDATE,
    &repeats::REPEATS,
    &congestion::CONGESTION,
    &netem::NETEM,
    &transport::TRANSPORT,
    &delay::DELAY,
    &delay::TUNED,
    &worlds::EXPERIMENT,
];

#[cfg(test)]
mod tests;
