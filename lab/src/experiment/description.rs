//! What the command line must know of an experiment: its name, its help, its defaults, its own arguments.

use std::collections::BTreeMap;
use std::time::Duration;

use super::findings::{ExperimentError, Extent, Findings, Section};
use crate::io::Runner;

/// An experiment. All that there is of it stands in one file; the list of them is in `experiments`.
#[derive(Debug)]
pub struct Experiment {
    /// Its name in the command line and in the manifest.
    pub name: &'static str,
    /// What it shows, in one line.
    pub about: &'static str,
    /// Seeds if no other number is asked for.
    pub seeds: u64,
    /// So many seeds are left out from the runner's first one on: somebody has looked at them.
    pub seeds_left_out: u64,
    /// Length of a run if no other is asked for.
    pub duration: Duration,
    /// Arguments that it alone takes.
    pub arguments: &'static [Argument],
    /// Whether it is one of those that run when all are asked for.
    pub in_all: bool,
    /// Runs it and keeps its files.
    pub run: fn(&Runner, &Request) -> Result<Findings, ExperimentError>,
}

impl Experiment {
    /// An experiment of runs as long as most and without arguments of its own.
    pub(crate) const fn new(
        name: &'static str,
        about: &'static str,
        seeds: u64,
        run: fn(&Runner, &Request) -> Result<Findings, ExperimentError>,
    ) -> Self {
        Self {
            name,
            about,
            seeds,
            seeds_left_out: 0,
            duration: DURATION,
            arguments: &[],
            in_all: true,
            run,
        }
    }

    /// Its first seed: that of the request, else on this runner.
    #[must_use]
    pub fn first_seed(&self, runner: &Runner, request: &Request) -> u64 {
        let first = runner.first_seed() + self.seeds_left_out;
        request.first_seed().unwrap_or(first)
    }

    /// Does it: its part of the manifest.
    ///
    /// # Errors
    /// As its [`Self::run`].
    pub fn reproduce(
        &self,
        runner: &Runner,
        request: &Request,
    ) -> Result<Section, ExperimentError> {
        Ok(Section {
            experiment: self.name,
            extent: request.extent,
            first_seed: self.first_seed(runner, request),
            findings: (self.run)(runner, request)?,
        })
    }
}

/// Length of a run of most experiments: four or five pushes.
pub const DURATION: Duration = Duration::from_secs(30);

/// An argument of one experiment: a number, or a flag that is given or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Argument {
    /// Its name, without dashes.
    pub name: &'static str,
    /// What it is or does.
    pub help: &'static str,
    /// Of a number: its unit, as help shows it, and what it is if it is not given.
    pub number: Option<(&'static str, f64)>,
}

/// How an experiment is to be done.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// How much of it.
    pub extent: Extent,
    /// The numbers that were given, by name; a flag that was given is 1.
    pub given: BTreeMap<&'static str, f64>,
}

impl Request {
    /// Whether a flag was given.
    #[must_use]
    pub fn flag(&self, name: &str) -> bool {
        self.given.contains_key(name)
    }

    /// The first seed, if one was given: as `first`, or as `world`, the only one.
    #[must_use]
    pub fn first_seed(&self) -> Option<u64> {
        let given = ["world", "first"].iter().find_map(|name| self.number(name));
        given.filter(|seed| *seed >= 1.0).map(|seed| seed as u64)
    }

    /// A number, if it was given.
    #[must_use]
    pub fn number(&self, name: &str) -> Option<f64> {
        self.given.get(name).copied()
    }
}
