//! Where the experiments run: threads for the runs, a folder for the files.
//!
//! Every run is a pure function, so that the order in which threads take them changes nothing. A trial that ran for
//! one experiment does not run again for the next.

use std::collections::BTreeMap;
use std::num::NonZero;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::Folder;
use super::threads::on_threads;
use crate::experiment::findings::ExperimentError;
use crate::experiment::grid::Group;
use crate::figure::Figure;
use crate::table::Table;
use crate::trial::{Measured, Trial};

/// Receives what runs, how many runs are done and how many there are; from any thread.
pub type Progress<'a> = &'a (dyn Fn(&str, usize, usize) + Sync);

/// Threads, a folder, and the results of the trials so far.
pub struct Runner<'a> {
    threads: Option<NonZero<usize>>,
    folder: Folder,
    progress: Progress<'a>,
    /// By seed: trials of different seeds have different results.
    known: Mutex<BTreeMap<u64, Vec<(Trial, Measured)>>>,
}

impl<'a> Runner<'a> {
    /// A runner on so many threads, all cores if none; its files go to `folder`.
    #[must_use]
    pub fn new(folder: Folder, threads: Option<NonZero<usize>>, progress: Progress<'a>) -> Self {
        Self {
            threads,
            folder,
            progress,
            known: Mutex::default(),
        }
    }

    /// Where its files go.
    #[must_use]
    pub fn folder(&self) -> &Folder {
        &self.folder
    }

    /// Runs every case with the seeds from 1 to `seeds`, on all threads.
    ///
    /// # Errors
    /// An error of a run. After it no new run begins.
    pub fn grid<C: Sync, R: Send>(
        &self,
        what: &str,
        seeds: u64,
        cases: Vec<C>,
        run: impl Fn(&C, u64) -> Result<R, ExperimentError> + Sync + Send,
    ) -> Result<Vec<Group<C, R>>, ExperimentError> {
        let of_case = |case| (1..=seeds).map(move |seed| (case, seed));
        let items: Vec<(&C, u64)> = cases.iter().flat_map(of_case).collect();
        let done = AtomicUsize::new(0);
        let work = |(case, seed): &(&C, u64)| -> Result<R, ExperimentError> {
            let measured = run(case, *seed)?;
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            (self.progress)(what, done, items.len());
            Ok(measured)
        };
        let mut measured = on_threads(self.threads, &items, work)?.into_iter();
        let seeds = usize::try_from(seeds).unwrap_or(usize::MAX);
        let group = |case| Group {
            case,
            runs: measured.by_ref().take(seeds).collect(),
        };
        Ok(cases.into_iter().map(group).collect())
    }

    /// Runs a trial of every case with the seeds from 1 to that of the extent, as [`Self::grid`].
    ///
    /// # Errors
    /// When a trial cannot be run. After it no new run begins.
    pub fn trials<C: Sync>(
        &self,
        what: &str,
        seeds: u64,
        cases: Vec<C>,
        trial: impl Fn(&C) -> Trial + Sync + Send,
    ) -> Result<Vec<Group<C, Measured>>, ExperimentError> {
        self.grid(what, seeds, cases, |case, seed| {
            self.trial(&trial(case).seeded(seed))
        })
    }

    /// Runs a trial, or takes what an equal one came to before. The result of a traced one is too large to be
    /// remembered.
    ///
    /// # Errors
    /// When the trial cannot be run.
    pub fn trial(&self, trial: &Trial) -> Result<Measured, ExperimentError> {
        if trial.traced {
            return Ok(trial.run()?);
        }
        let seed = trial.config.seed;
        let known = self.known.lock().ok().and_then(|known| {
            let mut same_seed = known.get(&seed)?.iter();
            same_seed.find_map(|(other, found)| (other == trial).then(|| found.clone()))
        });
        if let Some(known) = known {
            return Ok(known);
        }
        let measured = trial.run()?;
        if let Ok(mut known) = self.known.lock() {
            let of_seed = known.entry(seed).or_default();
            of_seed.push((trial.clone(), measured.clone()));
        }
        Ok(measured)
    }

    /// Keeps a file under a name, which may have folders in it.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn keep(&self, name: &str, bytes: &[u8]) -> Result<(), ExperimentError> {
        let kept = self.folder.keep(name, bytes);
        kept.map_err(|error| ExperimentError::Keep {
            name: name.to_owned(),
            why: error.to_string(),
        })
    }

    /// Keeps a table as CSV.
    ///
    /// # Errors
    /// As [`Self::keep`].
    pub fn keep_table(&self, name: &str, table: &Table) -> Result<(), ExperimentError> {
        self.keep(name, &table.to_csv())
    }

    /// Draws a figure and keeps it.
    ///
    /// # Errors
    /// When it cannot be drawn; as [`Self::keep`].
    pub fn keep_figure(&self, name: &str, figure: &Figure) -> Result<(), ExperimentError> {
        let svg = figure.draw().map_err(|why| ExperimentError::Draw {
            name: name.to_owned(),
            why,
        })?;
        self.keep(name, svg.as_bytes())
    }
}
