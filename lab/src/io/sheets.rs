//! The folder of a sweep: part files that runs append to, and the table that is made of them.
//!
//! A run writes to a part file of its own and never changes one that is there, so that shards may work in one
//! folder at the same time and a run that was killed leaves at worst a torn last line.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::Pool;
use crate::sweep::{Line, PartError, Plan, Results, Shard, part_header};
use crate::trial::TrialError;

/// Where the part files are.
const ROWS: &str = "rows";
/// The table of results.
const RESULTS: &str = "results.csv";
/// A copy of the plan.
const PLAN: &str = "plan.toml";

/// Why rows could not be kept or run.
#[derive(Debug, thiserror::Error)]
pub enum SheetError {
    /// A file or folder cannot be read or written.
    #[error("{}: {why}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
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
#[derive(Debug)]
pub struct Sheets {
    path: PathBuf,
}

impl Sheets {
    /// The folder at `path`, made if it is not there.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn open(path: &Path) -> Result<Self, SheetError> {
        let rows = path.join(ROWS);
        fs::create_dir_all(&rows).map_err(told(&rows))?;
        Ok(Self {
            path: path.to_owned(),
        })
    }

    /// The rows of the plan that are done, by whatever run.
    ///
    /// # Errors
    /// A part file cannot be read, or is not of this plan.
    pub fn results(&self, plan: &Plan) -> Result<Results, SheetError> {
        let rows = self.path.join(ROWS);
        let mut parts = Vec::new();
        for entry in fs::read_dir(&rows).map_err(told(&rows))? {
            parts.push(entry.map_err(told(&rows))?.path());
        }
        parts.retain(|part| part.extension() == Some(OsStr::new("csv")));
        parts.sort();
        let mut results = Results::default();
        for part in parts {
            let bytes = fs::read(&part).map_err(told(&part))?;
            let name = part.display().to_string();
            results.add_part(plan, &name, &String::from_utf8_lossy(&bytes))?;
        }
        Ok(results)
    }

    /// Keeps a copy of the plan.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn keep_plan(&self, text: &str) -> Result<(), SheetError> {
        self.keep(PLAN, text.as_bytes()).map(|_| ())
    }

    /// Keeps the table of results, and says where.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn keep_results(&self, csv: &[u8]) -> Result<PathBuf, SheetError> {
        self.keep(RESULTS, csv)
    }

    /// Writes beside the place and moves there: shards that do the same at the same time each leave a whole file.
    fn keep(&self, name: &str, bytes: &[u8]) -> Result<PathBuf, SheetError> {
        let path = self.path.join(name);
        if fs::read(&path).is_ok_and(|there| there == bytes) {
            return Ok(path);
        }
        let (beside, mut file) = self.new_file(&self.path, &format!("{name}.part"), "")?;
        file.write_all(bytes).map_err(told(&beside))?;
        fs::rename(&beside, &path).map_err(told(&path))?;
        Ok(path)
    }

    /// Makes a file that nobody else has: the first free one of `stem-1`, `stem-2`, …
    fn new_file(
        &self,
        folder: &Path,
        stem: &str,
        end: &str,
    ) -> Result<(PathBuf, File), SheetError> {
        let mut number = 1_u64;
        loop {
            let path = folder.join(format!("{stem}-{number}{end}"));
            match File::create_new(&path) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => number += 1,
                Err(why) => return Err(SheetError::File { path, why }),
                Ok(file) => return Ok((path, file)),
            }
        }
    }

    /// Runs these rows of the plan and keeps each as soon as it is done, until `ended` says so; `done` is told the
    /// number of finished rows, from any thread.
    ///
    /// # Errors
    /// A row cannot be run or kept, or the end was asked for. What was done before is kept in any case.
    pub fn run(
        &self,
        plan: &Plan,
        shard: Shard,
        rows: &[u64],
        pool: Pool,
        ended: impl Fn() -> bool + Sync,
        done: impl Fn(usize) + Sync,
    ) -> Result<(), SheetError> {
        if rows.is_empty() {
            return Ok(());
        }
        let folder = self.path.join(ROWS);
        let (path, file) = self.new_file(&folder, &shard.file_stem(), ".csv")?;
        let part = Part {
            path,
            file: Mutex::new(file),
        };
        part.append(&part_header())?;
        let work = |_: usize, number: &u64| {
            if ended() {
                return Err(SheetError::Interrupted);
            }
            let Some(row) = plan.row(*number) else {
                return Ok(());
            };
            let measured = row.trial.run();
            let measured = measured.map_err(|why| SheetError::Trial { row: *number, why })?;
            part.append(&Line::of(&row, &measured).text())
        };
        pool.run(rows, work, done).map(|_: Vec<()>| ())
    }
}

/// The part file of a run.
struct Part {
    path: PathBuf,
    file: Mutex<File>,
}

impl Part {
    /// A line in one write: only a write that the system cuts short can tear it.
    fn append(&self, line: &str) -> Result<(), SheetError> {
        let poisoned = || io::Error::other("another thread failed while it wrote");
        let file = self.file.lock();
        let written = file
            .map_err(|_| poisoned())
            .and_then(|mut file| file.write_all(line.as_bytes()));
        written.map_err(told(&self.path))
    }
}

/// Adds the path to what the system says.
fn told(path: &Path) -> impl FnOnce(io::Error) -> SheetError {
    let path = path.to_owned();
    |why| SheetError::File { path, why }
}

#[cfg(test)]
mod tests {
    use std::num::NonZero;
    use std::sync::atomic::{AtomicUsize, Ordering};

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

        fn sheets(&self) -> Sheets {
            Sheets::open(self.place.path()).unwrap()
        }

        /// Runs what a shard lacks, until `most` rows have begun.
        fn run(&self, shard: &str, threads: usize, most: usize) -> Result<(), SheetError> {
            let (sheets, shard) = (self.sheets(), shard.parse::<Shard>().unwrap());
            let results = sheets.results(&self.plan).unwrap();
            let rows: Vec<u64> = results
                .missing(&self.plan)
                .filter(|row| shard.has(*row))
                .collect();
            let begun = AtomicUsize::new(0);
            let ended = || begun.fetch_add(1, Ordering::Relaxed) >= most;
            let pool = Pool::new(NonZero::new(threads));
            sheets.run(&self.plan, shard, &rows, pool, ended, |_| {})
        }

        fn csv(&self) -> Option<Vec<u8>> {
            self.sheets()
                .results(&self.plan)
                .unwrap()
                .to_csv(&self.plan)
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
            assert!(matches!(cut, Err(SheetError::Interrupted)), "{cut:?}");
        }
        assert_eq!(bench.sheets().results(&bench.plan).unwrap().done(), 4);
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
        let sheets = bench.sheets();
        for text in ["one", "two", "two"] {
            sheets.keep_plan(text).unwrap();
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
        let error = Sheets::open(&file).unwrap_err().to_string();
        assert!(error.contains("file"), "{error}");
    }
}
