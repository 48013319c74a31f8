//! Reads the records of one run, for the commands that take several files.

use std::path::{Path, PathBuf};

use mmt_lab::one_run::{NotOneRun, OneRun};
use mmt_shared::io::record::{Ended, RecordError, read};

use crate::failure::Failure;

/// What the commands take that read records of sessions.
pub(super) const RECORDS: &str = "give an MCAP file, made with --record of demo, slave or master; for a record of packets: mmt netem report";

/// Why a record was not read: it is none, or what takes its messages fails.
enum Error<E> {
    Record(RecordError),
    Run(NotOneRun),
    Taker(E),
}

impl<E> From<RecordError> for Error<E> {
    fn from(error: RecordError) -> Self {
        Self::Record(error)
    }
}

/// What was read.
pub(super) struct Read {
    /// How each file ended.
    pub(super) ended: Vec<Ended>,
    /// Whether no session has begun in any of them.
    pub(super) is_empty: bool,
}

impl Read {
    /// The same, where there is a session.
    ///
    /// # Errors
    /// There is none.
    pub(super) fn with_sessions(self) -> Result<Vec<Ended>, Failure> {
        if self.is_empty {
            return Err(Failure::usage("there is no session in these records").remedy(RECORDS));
        }
        Ok(self.ended)
    }
}

/// Hands over each message of the records of one run with its topic, file after file. `failed` turns what `take` fails of into
/// advice.
///
/// # Errors
/// A file cannot be read; the files are not of one run; or what `take` fails of.
pub(super) fn read_run<E: From<RecordError>>(
    files: &[PathBuf],
    mut take: impl FnMut(&str, &[u8]) -> Result<(), E>,
    failed: impl Fn(&Path, E) -> Failure,
) -> Result<Read, Failure> {
    let mut run = OneRun::default();
    let mut ended = Vec::new();
    for path in files {
        let end = read(path, |topic, message| {
            run.take(topic, message).map_err(Error::Run)?;
            take(topic, message).map_err(Error::Taker)
        });
        ended.push(end.map_err(|error| match error {
            Error::Record(error) => failed(path, error.into()),
            Error::Taker(error) => failed(path, error),
            Error::Run(why) => not_one_run(&format!("the record {}: {why}", path.display())),
        })?);
    }
    run.judge().map_err(|why| not_one_run(&why.to_string()))?;
    Ok(Read {
        ended,
        is_empty: run.is_empty(),
    })
}

fn not_one_run(what: &str) -> Failure {
    Failure::usage(what)
        .remedy("give each record of one run once: of a demo, of one host, or of both hosts")
}
