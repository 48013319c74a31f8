//! What a soak has seen: processes, faults, judged records, and what is broken.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

use mmt_lab::check::Verdict;
use mmt_lab::swarm::Fault;
use serde::Serialize;

use super::super::check::judge;
use super::process::{Ended, Process};
use super::usage::{Course, Row};

/// A record of a process.
#[derive(Debug)]
pub(super) struct Recorded {
    pub(super) path: PathBuf,
    /// Whether its process came to its own end: then the record is whole.
    pub(super) is_whole: bool,
}

/// A promise that was broken.
#[derive(Debug, Serialize)]
pub(super) struct Broken {
    /// In which cycle, from 1.
    cycle: u64,
    what: String,
    /// Where the cycle's records are.
    kept: PathBuf,
}

impl Broken {
    pub(super) fn line(&self) -> String {
        let Self { cycle, what, kept } = self;
        format!("BROKEN in cycle {cycle}: {what}; see {}", kept.display())
    }
}

/// What a soak has seen so far.
#[derive(Debug)]
pub(super) struct Tally {
    began: Instant,
    /// Cycles that have begun.
    pub(super) cycles: u64,
    /// Where logs and records of the cycle are.
    folder: PathBuf,
    /// How masters ended.
    pub(super) masters: BTreeMap<&'static str, u64>,
    pub(super) faults: BTreeMap<String, u64>,
    /// Sessions that were judged, each end by itself.
    pub(super) sessions: usize,
    pub(super) verdict: Verdict,
    pub(super) broken: Vec<Broken>,
    courses: BTreeMap<&'static str, Course>,
}

impl Tally {
    /// Nothing, from now on.
    pub(super) fn new() -> Self {
        Self {
            began: Instant::now(),
            cycles: 0,
            folder: PathBuf::new(),
            masters: BTreeMap::new(),
            faults: BTreeMap::new(),
            sessions: 0,
            verdict: Verdict::default(),
            broken: Vec::new(),
            courses: BTreeMap::new(),
        }
    }

    /// The next cycle begins, with logs and records in this folder.
    pub(super) fn next_cycle(&mut self, folder: PathBuf) {
        self.cycles += 1;
        self.folder = folder;
    }

    /// A promise is broken.
    pub(super) fn broken(&mut self, what: String) {
        let broken = Broken {
            cycle: self.cycles,
            what,
            kept: self.folder.clone(),
        };
        tracing::error!("{}", broken.line());
        self.broken.push(broken);
    }

    /// Whether a promise was broken in the cycle at work.
    pub(super) fn is_cycle_broken(&self) -> bool {
        let last = self.broken.last();
        last.is_some_and(|broken| broken.cycle == self.cycles)
    }

    pub(super) fn count_fault(&mut self, fault: Fault) {
        *self.faults.entry(format!("{fault:?}")).or_default() += 1;
    }

    pub(super) fn count_master(&mut self, master: &Process, ended: Option<Ended>) {
        if let Some(ended) = ended {
            *self.masters.entry(ended.name()).or_default() += 1;
        }
        self.ended(master, ended);
    }

    /// How many masters ended like this.
    pub(super) fn masters_that(&self, ended: Ended) -> u64 {
        self.masters.get(ended.name()).copied().unwrap_or(0)
    }

    /// A process has ended, or did not although it was asked to: is that as it should be?
    pub(super) fn ended(&mut self, process: &Process, ended: Option<Ended>) {
        let name = process.name();
        match ended {
            None => self.broken(format!("the {name} did not end when it was asked to")),
            Some(Ended::Wrong(status)) => self.broken(format!("the {name} ended with {status}")),
            Some(_) => {}
        }
        if process.panicked() {
            self.broken(format!("the {name} panicked"));
        }
    }

    /// What processes of this kind have, at any moment.
    pub(super) fn sample(&mut self, kind: &'static str, process: &Process) {
        if let Some(usage) = process.usage() {
            self.courses.entry(kind).or_default().sample(usage);
        }
    }

    /// The same when no session has been there for a while.
    pub(super) fn sample_idle(&mut self, kind: &'static str, process: &Process) {
        let at_h = self.hours();
        if let Some(usage) = process.usage() {
            let course = self.courses.entry(kind).or_default();
            course.sample_idle(at_h, usage);
        }
    }

    /// Since the beginning.
    pub(super) fn hours(&self) -> f64 {
        self.began.elapsed().as_secs_f64() / 3600.0
    }

    /// A line for each kind of process.
    pub(super) fn rows(&self) -> Vec<Row> {
        let courses = self.courses.iter();
        courses.map(|(kind, course)| course.row(kind)).collect()
    }

    /// Judges what was recorded, each file by itself.
    pub(super) fn judge(&mut self, records: &[Recorded]) {
        for Recorded { path, is_whole } in records {
            if !path.exists() && !is_whole {
                // killed before it made the file
                continue;
            }
            let shown = path.display();
            match judge(std::slice::from_ref(path)) {
                Err(failure) => self.broken(format!("{shown} cannot be judged: {failure}")),
                Ok((checks, whole)) => {
                    if *is_whole && !whole {
                        self.broken(format!("{shown} is cut off"));
                    }
                    self.sessions += checks.sessions().count();
                    let verdict = checks.verdict(whole);
                    if !verdict.holds() {
                        self.broken(format!("{shown}: {verdict}"));
                    }
                    self.verdict.add(verdict);
                }
            }
        }
    }
}
