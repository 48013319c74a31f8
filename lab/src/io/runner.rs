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

/// The first seed of what documents quote. Tests and defaults were made with seeds below it. A test of a seed from here on asks whether files are
/// complete and the same again, not what was reached. Architectures are tuned on 10001 and judged on 20001 and on; of random worlds
/// single ones below 30000 were looked at, so these begin after them.
pub const FRESH_SEED: u64 = 5001;

/// Threads, a folder, and the results of the trials so far.
pub struct Runner<'a> {
    threads: Option<NonZero<usize>>,
    first_seed: u64,
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
            first_seed: 1,
            folder,
            progress,
            known: Mutex::default(),
        }
    }

    /// The same from another first seed on than 1.
    #[must_use]
    pub fn from_seed(self, first_seed: u64) -> Self {
        Self { first_seed, ..self }
    }

    /// Its first seed.
    #[must_use]
    pub fn first_seed(&self) -> u64 {
        self.first_seed
    }

    /// Where its files go.
    #[must_use]
    pub fn folder(&self) -> &Folder {
        &self.folder
    }

    /// Runs every case with as many seeds, from its first one on, on all threads.
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
        self.grid_from(self.first_seed, what, seeds, cases, run)
    }

    /// The same from a seed on that is not the runner's.
    ///
    /// # Errors
    /// As [`Self::grid`].
    pub fn grid_from<C: Sync, R: Send>(
        &self,
        first_seed: u64,
        what: &str,
        seeds: u64,
        cases: Vec<C>,
        run: impl Fn(&C, u64) -> Result<R, ExperimentError> + Sync + Send,
    ) -> Result<Vec<Group<C, R>>, ExperimentError> {
        let of_case = |case| {
            (first_seed..)
                .zip(0..seeds)
                .map(move |(seed, _)| (case, seed))
        };
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

    /// Runs a trial of every case with as many seeds, as [`Self::grid`].
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::grid::runs;

    #[test]
    fn a_runner_gives_the_seeds_from_its_first_one_on_and_the_runs_have_their_names() {
        let folder = tempfile::tempdir().unwrap();
        let quiet = |_: &str, _: usize, _: usize| {};
        let runner = |first| {
            let folder = Folder::open(folder.path()).unwrap();
            Runner::new(folder, None, &quiet).from_seed(first)
        };
        let seeds = |first| {
            let groups = runner(first).grid("seeds", 3, vec!["a", "b"], |_, seed| Ok(seed));
            let groups = groups.unwrap();
            let named = runs(&groups, first).into_iter();
            named
                .map(|run| (run.seed, *run.measured))
                .collect::<Vec<_>>()
        };
        let fresh = FRESH_SEED;
        let once = [fresh, fresh + 1, fresh + 2].map(|seed| (seed, seed));
        assert_eq!(seeds(fresh), [once, once].concat());
        assert_eq!(seeds(1)[0], (1, 1));
        let own = runner(fresh).grid_from(10_001, "seeds", 2, vec![()], |(), seed| Ok(seed));
        assert_eq!(own.unwrap()[0].runs, [10_001, 10_002]);
    }
}
