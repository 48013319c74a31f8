//! The folder of a sweep: part files that runs append to, and the table that is made of them.
//!
//! A run writes to a part file of its own and never changes one that is there, so that shards may work in one
//! folder at the same time and a run that was killed leaves at worst a torn last line.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::folder::write_whole;
use super::threads::on_threads;
use crate::sweep::{PartError, Plan, Results, RowResult, Shard, part_header};
use crate::trial::TrialError;

/// Where the part files are.
const ROWS: &str = "rows";
/// The table of results.
const RESULTS: &str = "results.csv";
/// A copy of the plan.
const PLAN: &str = "plan.toml";

/// Why rows could not be kept or run.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// A file or folder cannot be read or written.
    #[error("{}: {why}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What the system reported.
        why: io::Error,
    },
    /// A part file does not belong to the plan.
    #[error(transparent)]
    Part(#[from] PartError),
    /// A row could not be run.
    #[error("row {row}: {why}")]
    Trial {
        /// The row.
        row: u64,
        /// What is wrong with it.
        why: TrialError,
    },
    /// The end was asked for; what was done is kept.
    #[error("interrupted")]
    Interrupted,
}

/// The folder of a sweep.
#[derive(Clone, Debug)]
pub struct SweepDir {
    path: PathBuf,
}

impl SweepDir {
    /// The folder at `path`, made if it is not there.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn open(path: &Path) -> Result<Self, SweepError> {
        let rows = path.join(ROWS);
        fs::create_dir_all(&rows).map_err(at(&rows))?;
        Ok(Self {
            path: path.to_owned(),
        })
    }

    /// The rows of the plan that are done, by whatever run.
    ///
    /// # Errors
    /// A part file cannot be read, or is not of this plan.
    pub fn results(&self, plan: &Plan) -> Result<Results, SweepError> {
        let rows = self.path.join(ROWS);
        let mut parts = Vec::new();
        for entry in fs::read_dir(&rows).map_err(at(&rows))? {
            parts.push(entry.map_err(at(&rows))?.path());
        }
        parts.retain(|part| part.extension() == Some(OsStr::new("csv")));
        parts.sort();
        let mut results = Results::default();
        for part in parts {
            let bytes = fs::read(&part).map_err(at(&part))?;
            let name = part.display().to_string();
            results.add_part(plan, &name, &bytes)?;
        }
        Ok(results)
    }

    /// Keeps a copy of the plan.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn keep_plan(&self, text: &str) -> Result<(), SweepError> {
        self.keep(PLAN, text.as_bytes()).map(|_| ())
    }

    /// Keeps the table of results; its path.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn keep_results(&self, csv: &[u8]) -> Result<PathBuf, SweepError> {
        self.keep(RESULTS, csv)
    }

    /// Shards that do the same at the same time each leave a whole file.
    fn keep(&self, name: &str, bytes: &[u8]) -> Result<PathBuf, SweepError> {
        let path = self.path.join(name);
        if fs::read(&path).is_ok_and(|there| there == bytes) {
            return Ok(path);
        }
        write_whole(&path, bytes).map_err(at(&path))?;
        Ok(path)
    }

    /// Makes a part file that nobody else has: the first free one of `stem-1.csv`, `stem-2.csv`, …
    fn new_part(&self, stem: &str) -> Result<RowFile, SweepError> {
        let mut number = 1_u64;
        loop {
            let path = self.path.join(ROWS).join(format!("{stem}-{number}.csv"));
            match File::create_new(&path) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => number += 1,
                Err(why) => return Err(SweepError::File { path, why }),
                Ok(file) => {
                    let file = Mutex::new(file);
                    return Ok(RowFile { path, file });
                }
            }
        }
    }

    /// Runs these rows of the plan and keeps each as soon as it is done, until `ended` is true; `done` receives the
    /// number of finished rows, from any thread.
    ///
    /// # Errors
    /// A row cannot be run or kept, or the end was asked for. What was done before is kept in any case.
    pub fn run(
        &self,
        plan: &Plan,
        shard: Shard,
        rows: &[u64],
        threads: Option<NonZero<usize>>,
        ended: impl Fn() -> bool + Sync + Send,
        done: impl Fn(usize) + Sync + Send,
    ) -> Result<(), SweepError> {
        if rows.is_empty() {
            return Ok(());
        }
        let part = self.new_part(&shard.file_stem())?;
        part.append(&part_header())?;
        let finished = AtomicUsize::new(0);
        let work = |number: &u64| {
            if ended() {
                return Err(SweepError::Interrupted);
            }
            let Some(row) = plan.row(*number) else {
                return Ok(());
            };
            let measured = row.trial.run();
            let measured = measured.map_err(|why| SweepError::Trial { row: *number, why })?;
            part.append(&RowResult::of(&row, &measured).line())?;
            done(finished.fetch_add(1, Ordering::Relaxed) + 1);
            Ok(())
        };
        on_threads(threads, rows, work).map(|_: Vec<()>| ())
    }
}

/// The part file of a run.
struct RowFile {
    path: PathBuf,
    file: Mutex<File>,
}

impl RowFile {
    /// A line in one write: only a write that the system cuts short can tear it.
    fn append(&self, line: &[u8]) -> Result<(), SweepError> {
        let poisoned = || io::Error::other("another thread failed while it wrote");
        let file = self.file.lock();
        let written = file
            .map_err(|_| poisoned())
            .and_then(|mut file| file.write_all(line));
        written.map_err(at(&self.path))
    }
}

/// Adds the path to what the system reports.
fn at(path: &Path) -> impl FnOnce(io::Error) -> SweepError {
    let path = path.to_owned();
    |why| SweepError::File { path, why }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAN_TEXT: &str = r#"
duration_s = 0.2
seeds = { count = 2 }
[[axis]]
key = "slave.trigger.scheme"
values = ["deadband 5%", "every-sample", "useful 10% 150ms"]
"#;

    struct Bench {
        place: tempfile::TempDir,
        plan: Plan,
    }

    impl Bench {
        fn new() -> Self {
            Self {
                place: tempfile::tempdir().unwrap(),
                plan: Plan::parse(PLAN_TEXT).unwrap(),
            }
        }

        fn dir(&self) -> SweepDir {
            SweepDir::open(self.place.path()).unwrap()
        }

        /// Runs what a shard lacks, until `most` rows have begun.
        fn run(&self, shard: &str, threads: usize, most: usize) -> Result<(), SweepError> {
            let (dir, shard) = (self.dir(), shard.parse::<Shard>().unwrap());
            let results = dir.results(&self.plan).unwrap();
            let rows: Vec<u64> = results
                .missing(&self.plan)
                .filter(|row| shard.has(*row))
                .collect();
            let begun = AtomicUsize::new(0);
            let ended = || begun.fetch_add(1, Ordering::Relaxed) >= most;
            let threads = NonZero::new(threads);
            dir.run(&self.plan, shard, &rows, threads, ended, |_| {})
        }

        fn csv(&self) -> Option<Vec<u8>> {
            self.dir().results(&self.plan).unwrap().to_csv(&self.plan)
        }

        fn parts(&self) -> Vec<PathBuf> {
            let entries = fs::read_dir(self.place.path().join(ROWS)).unwrap();
            entries.map(|entry| entry.unwrap().path()).collect()
        }
    }

    fn whole() -> Vec<u8> {
        let bench = Bench::new();
        bench.run("1/1", 1, usize::MAX).unwrap();
        bench.csv().unwrap()
    }

    #[test]
    fn threads_and_shards_do_not_change_the_bytes() {
        let whole = whole();
        let threaded = Bench::new();
        threaded.run("1/1", 2, usize::MAX).unwrap();
        assert_eq!(threaded.csv().unwrap(), whole);
        let sharded = Bench::new();
        for shard in ["2/3", "3/3"] {
            sharded.run(shard, 2, usize::MAX).unwrap();
            assert_eq!(sharded.csv(), None);
        }
        sharded.run("1/3", 1, usize::MAX).unwrap();
        assert_eq!(sharded.csv().unwrap(), whole);
        // nothing is left: no row runs again, no file is made
        sharded.run("1/1", 1, 0).unwrap();
        assert_eq!(sharded.parts().len(), 3);
    }

    #[test]
    fn an_interrupted_run_keeps_what_is_done_and_goes_on_to_the_same_bytes() {
        let bench = Bench::new();
        for _ in 0..2 {
            let cut = bench.run("1/1", 1, 2);
            assert!(matches!(cut, Err(SweepError::Interrupted)), "{cut:?}");
        }
        assert_eq!(bench.dir().results(&bench.plan).unwrap().done(), 4);
        bench.run("1/1", 1, usize::MAX).unwrap();
        assert_eq!(bench.csv().unwrap(), whole());
    }

    #[test]
    fn a_torn_line_is_done_again_and_its_file_left_alone() {
        let bench = Bench::new();
        bench.run("1/1", 1, usize::MAX).unwrap();
        let part = bench.parts().remove(0);
        let bytes = fs::read(&part).unwrap();
        let torn = &bytes[..bytes.len() - 20];
        fs::write(&part, torn).unwrap();
        assert_eq!(bench.csv(), None);
        bench.run("1/1", 1, 1).unwrap();
        assert_eq!(bench.csv().unwrap(), whole());
        assert_eq!(fs::read(&part).unwrap(), torn);
    }

    #[test]
    fn a_kept_file_is_whole_and_nothing_is_left_beside_it() {
        let bench = Bench::new();
        let dir = bench.dir();
        for text in ["one", "two", "two"] {
            dir.keep_plan(text).unwrap();
            assert_eq!(
                fs::read_to_string(bench.place.path().join(PLAN)).unwrap(),
                text
            );
        }
        assert_eq!(fs::read_dir(bench.place.path()).unwrap().count(), 2);
    }

    #[test]
    fn what_cannot_be_written_is_named() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("file");
        fs::write(&file, b"").unwrap();
        let error = SweepDir::open(&file).unwrap_err().to_string();
        assert!(error.contains("file"), "{error}");
    }
}
