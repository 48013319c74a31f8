//! What an experiment hands back, and why it may fail.

use std::time::Duration;

use serde::Serialize;

use crate::figure::DrawError;
use crate::physics::PhysicsError;
use crate::table::Table;
use crate::trial::TrialError;
use crate::world::WorldConfig;

/// How much of an experiment is done.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Extent {
    /// So many seeds, from the experiment's first one on.
    pub seeds: u64,
    /// Length of a run.
    #[serde(rename = "duration_s", serialize_with = "seconds")]
    pub duration: Duration,
}

fn seconds<S: serde::Serializer>(duration: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(duration.as_secs_f64())
}

/// What an experiment found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Findings {
    /// SHA-256 over the digests of all its runs, in their order: equal on every machine. Empty if its runs have none.
    pub digest: String,
    /// The configuration that its runs vary, by mode.
    pub configuration: Vec<WorldConfig>,
    /// What is printed.
    pub tables: Vec<Table>,
}

/// What an experiment found, with its name and how much of it was done.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Section {
    /// The experiment's name.
    pub experiment: &'static str,
    /// How much of it was done.
    pub extent: Extent,
    /// The first seed; of `tuned`, which has seeds of its own, without meaning.
    pub first_seed: u64,
    /// What it found.
    #[serde(flatten)]
    pub findings: Findings,
}

/// Why an experiment could not be done.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExperimentError {
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
    #[error("the transport could not be measured: {0}")]
    Transport(String),
    /// A file could not be written.
    #[error("cannot write {name}: {why}")]
    Keep {
        /// The file.
        name: String,
        /// What the system reported.
        why: String,
    },
    /// A figure could not be drawn.
    #[error("cannot draw {name}: {why}")]
    Draw {
        /// The figure.
        name: String,
        /// What went wrong.
        why: DrawError,
    },
}

impl ExperimentError {
    /// Of the words of a network that were not accepted.
    pub fn network(name: &str, why: impl ToString) -> Self {
        Self::Network {
            name: name.to_owned(),
            why: why.to_string(),
        }
    }
}
