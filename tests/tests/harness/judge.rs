//! Judges what sessions recorded: whatever else a test is about, its sessions keep what is promised.

use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use mmt_lab::check::{CheckError, RecordChecks};
use mmt_shared::io::record::{Ended, RecordError, read};
use tempfile::TempDir;

/// Names the folder in which the program records each of its sessions.
const RECORDS: &str = "MMT_UNDER_TEST_RECORDS";

/// Why a record was not judged.
#[derive(Debug, thiserror::Error)]
enum JudgeError {
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error(transparent)]
    Check(#[from] CheckError),
}

/// What a command, and whatever it starts, records of its sessions.
#[derive(Debug)]
pub(crate) struct Records(TempDir);

impl Records {
    /// Of a command that is to be started.
    ///
    /// # Errors
    /// There is no room for them.
    pub(crate) fn of(command: &mut Command) -> io::Result<Self> {
        let folder = tempfile::tempdir()?;
        command.env(RECORDS, folder.path());
        Ok(Self(folder))
    }

    /// What there is by now.
    ///
    /// # Errors
    /// The folder is gone.
    pub(crate) fn files(&self) -> io::Result<Vec<PathBuf>> {
        std::fs::read_dir(self.0.path())?
            .map(|file| file.map(|file| file.path()))
            .collect()
    }

    /// Judges each of them by itself.
    ///
    /// # Errors
    /// What is broken, or why one cannot be judged.
    pub(crate) fn judge(self) -> Result<(), String> {
        let files = self.files().map_err(|error| error.to_string())?;
        files.iter().try_for_each(|file| judge(file))
    }
}

/// Runs a command to its end and judges what it recorded.
///
/// # Panics
/// It does not start, or a session of it does not keep what is promised.
pub(crate) fn judged(mut command: Command) -> Output {
    let records = Records::of(&mut command);
    let output = command.output();
    let judged = records.map(Records::judge);
    assert!(matches!(judged, Ok(Ok(()))), "{command:?}: {judged:?}");
    match output {
        Ok(output) => output,
        Err(error) => unreachable!("{command:?}: {error}"),
    }
}

/// Judges a record; one without a session holds.
///
/// # Errors
/// What is broken, or why it cannot be judged.
pub(crate) fn judge(record: &Path) -> Result<(), String> {
    let mut checks = RecordChecks::default();
    let ended = read(record, |topic, message| -> Result<(), JudgeError> {
        Ok(checks.take(topic, message)?)
    });
    let ended = ended.map_err(|error| format!("{}: {error}", record.display()))?;
    let verdict = checks.verdict(ended == Ended::Whole);
    if verdict.holds() {
        return Ok(());
    }
    Err(verdict.to_string())
}
