//! Where the experiments work: threads for the trials, a folder for the files, a bar for whoever waits.

use std::collections::BTreeMap;
use std::num::NonZero;
use std::path::Path;
use std::sync::Mutex;

use indicatif::{ProgressBar, ProgressStyle};
use mmt_lab::architecture::{self, DelayRow};
use mmt_lab::io::{Folder, Pool, estimator_tick_ms, virtual_time};
use mmt_lab::reproduce::delay::Duel;
use mmt_lab::reproduce::{Each, Laboratory, ReproduceError};
use mmt_lab::transport::{Case, Outcome};
use mmt_lab::trial::{Measured, Trial, TrialError};
use mmt_shared::model::settings::Mode;

use super::manifest::Manifest;
use crate::failure::Failure;

/// The desk. A trial that was run for one experiment is not run again for the next.
pub(super) struct Desk {
    pool: Pool,
    folder: Folder,
    known: Mutex<BTreeMap<String, Measured>>,
}

impl Desk {
    /// A desk with its folder.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub(super) fn open(folder: &Path, threads: Option<NonZero<usize>>) -> Result<Self, Failure> {
        let opened = Folder::open(folder).map_err(|error| {
            Failure::usage(format!(
                "cannot make the folder {}: {error}",
                folder.display()
            ))
            .remedy("give another one with --out")
        })?;
        Ok(Self {
            pool: Pool::new(threads),
            folder: opened,
            known: Mutex::default(),
        })
    }

    /// The folder.
    pub(super) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The files kept so far with their SHA-256.
    pub(super) fn files(&self) -> BTreeMap<String, String> {
        self.folder.kept()
    }

    /// Writes `manifest.json`.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn keep_manifest(&self, manifest: &Manifest) -> Result<(), Failure> {
        let failed = |why: &dyn std::fmt::Display| {
            Failure::failed(format!("cannot write manifest.json: {why}"))
        };
        let mut text = serde_json::to_string_pretty(manifest).map_err(|error| failed(&error))?;
        text.push('\n');
        self.folder
            .keep("manifest.json", text.as_bytes())
            .map_err(|error| failed(&error))
    }

    fn measure(&self, index: usize, trial: &Trial, each: Each) -> Result<Measured, ReproduceError> {
        let key = key(trial);
        let known = |key: &String| self.known.lock().ok()?.get(key).cloned();
        let mut measured = match key.as_ref().and_then(known) {
            Some(measured) => measured,
            None => trial.run()?,
        };
        if let (Some(key), Ok(mut all)) = (key, self.known.lock()) {
            all.entry(key).or_insert_with(|| measured.clone());
        }
        each(index, &mut measured)?;
        Ok(measured)
    }
}

/// What a trial depends on, as text; none for a traced one, whose result is too large to be remembered.
fn key(trial: &Trial) -> Option<String> {
    let all = (&trial.config, trial.duration, &trial.change);
    serde_json::to_string(&all).ok().filter(|_| !trial.traced)
}

/// A bar on stderr; nothing where stderr is no terminal.
fn progress_bar(what: &str, length: usize) -> ProgressBar {
    let bar = ProgressBar::new(length as u64);
    let style = ProgressStyle::with_template("{msg} [{wide_bar}] {pos}/{len} {eta}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.set_message(what.to_owned());
    bar
}

impl Laboratory for Desk {
    fn run(
        &self,
        what: &str,
        trials: &[Trial],
        each: Each,
    ) -> Result<Vec<Measured>, ReproduceError> {
        let bar = progress_bar(what, trials.len());
        let work = |index: usize, trial: &Trial| self.measure(index, trial, each);
        let measured = self
            .pool
            .run(trials, work, |done| bar.set_position(done as u64));
        bar.finish_and_clear();
        measured
    }

    fn duel(&self, what: &str, duels: &[Duel]) -> Result<Vec<DelayRow>, ReproduceError> {
        let bar = progress_bar(what, duels.len());
        let work = |_: usize, duel: &Duel| {
            let row = architecture::run(duel.architecture, &duel.config, duel.duration);
            row.map_err(|error| ReproduceError::from(TrialError::from(error)))
        };
        let rows = self
            .pool
            .run(duels, work, |done| bar.set_position(done as u64));
        bar.finish_and_clear();
        rows
    }

    fn transfer(&self, what: &str, cases: &[Case]) -> Result<Vec<Outcome>, ReproduceError> {
        let bar = progress_bar(what, cases.len());
        let work = |_: usize, case: &Case| virtual_time::run(case).map_err(ReproduceError::from);
        let outcomes = self
            .pool
            .run(cases, work, |done| bar.set_position(done as u64));
        bar.finish_and_clear();
        outcomes
    }

    fn keep(&self, name: &str, bytes: &[u8]) -> Result<(), ReproduceError> {
        self.folder
            .keep(name, bytes)
            .map_err(|error| ReproduceError::Keep {
                name: name.to_owned(),
                why: error.to_string(),
            })
    }

    fn estimator_tick_ms(&self) -> Option<f64> {
        Some(estimator_tick_ms(Mode::Paper))
    }
}
