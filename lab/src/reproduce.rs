//! The paper's experiments and those that go beyond it: which trials, and what is made of them.
//!
//! Pure: trials are handed to a [`Laboratory`], which runs them and keeps the files. An experiment must never
//! depend on the order in which its trials ran, nor on the machine they ran on.

pub mod ablation;
pub mod claims;
pub mod congestion;
pub mod delay;
pub mod fig5;
pub mod netem;
pub mod physics;
pub mod repeats;
pub mod scenarios;
pub mod schemes;
mod setting;
pub mod traces;
pub mod tupdate;

pub use setting::{Curve, DEADBANDS, FIG5_CURVES, mode_name, paper_world};

use std::time::Duration;

use delay::Duel;

use crate::architecture::DelayRow;
use crate::digest::of_runs;
use crate::figure::Figure;
use crate::physics::PhysicsError;
use crate::table::Table;
use crate::transport::{Case, Outcome};
use crate::trial::{Measured, Trial, TrialError};
use crate::world::WorldConfig;
use serde::Serialize;

/// Called with each result as soon as it is there, from any thread; may take the trace out of it.
pub type Each<'a> = &'a (dyn Fn(usize, &mut Measured) -> Result<(), ReproduceError> + Sync);

/// Runs trials and keeps files.
pub trait Laboratory: Sync {
    /// Runs all trials, in any order, and returns the results in the order of the trials.
    ///
    /// # Errors
    /// The first error of a trial or of `each`.
    fn run(
        &self,
        what: &str,
        trials: &[Trial],
        each: Each,
    ) -> Result<Vec<Measured>, ReproduceError>;

    /// Runs every architecture's runs and returns their rows in that order.
    ///
    /// # Errors
    /// The first error of a run.
    fn duel(&self, what: &str, duels: &[Duel]) -> Result<Vec<DelayRow>, ReproduceError>;

    /// Runs every case of the transport and returns what they measured in that order.
    ///
    /// # Errors
    /// The first error of a case.
    fn transfer(&self, what: &str, cases: &[Case]) -> Result<Vec<Outcome>, ReproduceError>;

    /// Keeps a file under a name, which may have folders in it.
    ///
    /// # Errors
    /// When the file cannot be written.
    fn keep(&self, name: &str, bytes: &[u8]) -> Result<(), ReproduceError>;

    /// Draws a figure and keeps it.
    ///
    /// # Errors
    /// As [`Figure::draw`] and [`Self::keep`].
    fn keep_figure(&self, name: &str, figure: &Figure) -> Result<(), ReproduceError> {
        self.keep(name, figure.draw(name)?.as_bytes())
    }

    /// CPU time of one tick of the paper's estimator in contact, ms; none where there is no clock. The one number
    /// that depends on the machine.
    fn estimator_tick_ms(&self) -> Option<f64>;
}

/// Why an experiment could not be done.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReproduceError {
    /// A trial could not be run.
    #[error(transparent)]
    Trial(#[from] TrialError),
    /// A body has no reference motions.
    #[error(transparent)]
    Physics(#[from] PhysicsError),
    /// A network's words were not accepted.
    #[error("network {name}: {why}")]
    Network {
        /// Which network.
        name: String,
        /// What was wrong.
        why: String,
    },
    /// A transport could not be measured.
    #[error("the transport could not be measured: {why}")]
    Transport {
        /// What went wrong.
        why: String,
    },
    /// A file could not be written.
    #[error("cannot write {name}: {why}")]
    Keep {
        /// The file.
        name: String,
        /// What the system said.
        why: String,
    },
    /// A figure could not be drawn.
    #[error("cannot draw {name}: {why}")]
    Draw {
        /// The figure.
        name: String,
        /// What went wrong.
        why: String,
    },
}

/// How much of an experiment is done.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Extent {
    /// Seeds 1 to this.
    pub seeds: u64,
    /// Length of a run.
    #[serde(rename = "duration_s", serialize_with = "seconds")]
    pub duration: Duration,
}

fn seconds<S: serde::Serializer>(duration: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(duration.as_secs_f64())
}

/// What an experiment found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Findings {
    /// The experiment's name.
    pub experiment: &'static str,
    /// How much of it was done.
    pub extent: Extent,
    /// SHA-256 over the digests of all its trials, in their order: equal on every machine.
    pub digest: String,
    /// The configuration that its trials vary, by mode.
    pub configuration: Vec<WorldConfig>,
    /// What is printed.
    pub tables: Vec<Table>,
}

/// SHA-256 over the digests of trials, in hexadecimal digits.
fn digest<'a>(measured: impl IntoIterator<Item = &'a Measured>) -> String {
    of_runs(measured.into_iter().map(|m| m.digest.as_str()))
}

/// For experiments that need nothing done with a single result.
fn nothing(_: usize, _: &mut Measured) -> Result<(), ReproduceError> {
    Ok(())
}
