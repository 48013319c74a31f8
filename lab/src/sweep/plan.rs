//! A plan: the start, the keys laid over it, the axes of the grid and the seeds.
//!
//! Every row's configuration is read and tried before the first row runs, so that a slip in the last one costs no
//! time. A plan that is accepted must never fail in the middle of its rows.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::digest::hex;
use crate::trial::{Change, Trial};
use crate::world::WorldConfig;

/// Most rows of a plan.
pub const ROWS_MAX: u64 = 1_000_000;

/// What the keys of a plan are laid over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// The live system's defaults over a perfect network: ten samples a packet, and a play-out delay.
    #[default]
    Live,
    /// The paper's experiment, as [`crate::setting::paper_world`]: no delay at all.
    PaperExperiment,
}

/// Seeds of the rows: `first`, `first + 1`, …
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Seeds {
    /// The first; 1 if left out.
    #[serde(default = "one")]
    pub first: u64,
    /// How many, at least 1.
    pub count: u64,
}

fn one() -> u64 {
    1
}

/// An axis of the grid.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Axis {
    /// The keys that change together, as the plan writes them.
    pub keys: Vec<String>,
    /// Per step a value for every key, as the plan writes it.
    pub values: Vec<Vec<String>>,
}

/// A plan whose every row can run.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    pub(super) duration: Duration,
    pub(super) seeds: Seeds,
    pub(super) change: Option<Change>,
    pub(super) axes: Vec<Axis>,
    /// The configuration at every point of the grid, before it is seeded.
    pub(super) points: Vec<WorldConfig>,
}

/// A row of a plan: a point of the grid with a seed.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Its number, from 1.
    pub number: u64,
    /// The values of all axes' keys, in the order of [`Plan::keys`], as the plan writes them.
    pub values: Vec<String>,
    /// Its seed.
    pub seed: u64,
    /// What it runs.
    pub trial: Trial,
}

impl Row {
    /// SHA-256 over everything that the row's result depends on, and the version of the program; the first 16
    /// hexadecimal digits.
    #[must_use]
    pub fn key(&self) -> String {
        let trial = (&self.trial.config, self.trial.duration, self.trial.change);
        let parts = (env!("CARGO_PKG_VERSION"), self.number, trial);
        // a configuration is numbers and words: it can always be written
        let text = serde_json::to_string(&parts).unwrap_or_default();
        let hash = Sha256::digest(text);
        hex(hash.get(..8).unwrap_or(&hash))
    }
}

impl Plan {
    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.points.len() as u64 * self.seeds.count
    }

    /// The axes, the slowest first.
    #[must_use]
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// The keys of all axes.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.axes
            .iter()
            .flat_map(|axis| &axis.keys)
            .map(String::as_str)
    }

    /// The row with a number from 1: the axes in their order, the last one fastest, and seeds faster still.
    #[must_use]
    pub fn row(&self, number: u64) -> Option<Row> {
        let index = number.checked_sub(1)?;
        let point = usize::try_from(index / self.seeds.count).ok()?;
        let seed = self.seeds.first + index % self.seeds.count;
        let config = self.points.get(point)?.clone().seeded(seed);
        let sizes: Vec<usize> = self.axes.iter().map(|axis| axis.values.len()).collect();
        let steps = steps(point, &sizes);
        let values = self.axes.iter().zip(steps);
        Some(Row {
            number,
            values: values
                .filter_map(|(axis, step)| axis.values.get(step))
                .flatten()
                .cloned()
                .collect(),
            seed,
            trial: Trial {
                change: self.change,
                ..Trial::new(config, self.duration)
            },
        })
    }
}

/// Where a point of the grid stands on each axis; the last axis is the fastest.
pub(super) fn steps(point: usize, sizes: &[usize]) -> Vec<usize> {
    let mut rest = point;
    let mut steps: Vec<usize> = sizes
        .iter()
        .rev()
        .map(|size| {
            let step = rest % size;
            rest /= size;
            step
        })
        .collect();
    steps.reverse();
    steps
}
