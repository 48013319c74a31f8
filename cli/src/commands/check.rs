//! `mmt check`: do recorded sessions keep what is promised? By the judges of `mmt_lab::check`.

use std::path::PathBuf;

use mmt_lab::again::AgainError;
use mmt_lab::check::{CheckError, Invariant, Judged, RecordChecks, Verdict, Violation};
use mmt_shared::io::record::{Ended, RecordError};
use serde::Serialize;

use super::records::{RECORDS, read_run};
use crate::args::CheckArguments;
use crate::failure::Failure;
use crate::output::{print, print_json};

/// Why a record was not judged.
#[derive(Debug, thiserror::Error)]
enum Error {
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error(transparent)]
    Check(#[from] CheckError),
}

#[derive(Debug, Serialize)]
struct Document {
    version: &'static str,
    command: &'static str,
    files: Vec<String>,
    /// Whether all of them are whole; what was cut off is judged up to there.
    is_whole: bool,
    holds: bool,
    sessions: Vec<Session>,
    invariants: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Session {
    side: &'static str,
    session: u32,
    holds: bool,
}

/// An invariant and what was found of it.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    name: &'static str,
    promise: &'static str,
    #[serde(flatten)]
    judged: Judged,
}

/// Runs `mmt check`.
///
/// # Errors
/// A record cannot be read or is of another version; an invariant is broken; stdout cannot be written to.
pub(crate) fn run(arguments: &CheckArguments) -> Result<(), Failure> {
    let (checks, is_whole) = judge(&arguments.files)?;
    let document = document(arguments, &checks, is_whole);
    if arguments.json {
        print_json(&document)?;
    } else {
        show(&document)?;
    }
    judged(&document)
}

/// Judges the records of one run, and whether all of them are whole.
///
/// # Errors
/// One cannot be read or is of another version, or they are not of one run.
pub(super) fn judge(files: &[PathBuf]) -> Result<(RecordChecks, bool), Failure> {
    let mut checks = RecordChecks::default();
    let read = read_run(
        files,
        |topic, message| -> Result<(), Error> { Ok(checks.take(topic, message)?) },
        |path, error| {
            let what = format!("the record {}: {error}", path.display());
            let remedy = match error {
                Error::Check(CheckError::Again(AgainError::OtherProgram { .. })) => {
                    "take the version that made it"
                }
                _ => RECORDS,
            };
            Failure::usage(what).remedy(remedy)
        },
    )?;
    let is_whole = read.ended.iter().all(|ended| *ended == Ended::Whole);
    Ok((checks, is_whole))
}

fn document(arguments: &CheckArguments, checks: &RecordChecks, is_whole: bool) -> Document {
    let verdict = checks.verdict(is_whole);
    let sessions = checks.sessions();
    let sessions = sessions.map(|(side, session, verdict)| Session {
        side,
        session,
        holds: verdict.holds(),
    });
    let files = arguments.files.iter();
    Document {
        version: env!("CARGO_PKG_VERSION"),
        command: "check",
        files: files.map(|path| path.display().to_string()).collect(),
        is_whole,
        holds: verdict.holds(),
        sessions: sessions.collect(),
        invariants: rows(&verdict),
    }
}

/// Each invariant that was looked at.
pub(super) fn rows(verdict: &Verdict) -> Vec<Row> {
    let row = |(invariant, judged): (Invariant, &Judged)| Row {
        name: invariant.name(),
        promise: invariant.promise(),
        judged: judged.clone(),
    };
    verdict.judged().map(row).collect()
}

fn show(document: &Document) -> Result<(), Failure> {
    for Session {
        side,
        session,
        holds,
    } in &document.sessions
    {
        let what = if *holds { "all holds" } else { "BROKEN" };
        print(format_args!("{side}, session {session}: {what}"))?;
    }
    show_rows(&document.invariants)?;
    if !document.is_whole {
        print("a record is cut off: judged up to there")?;
    }
    Ok(())
}

/// Each invariant, and where it was broken first.
pub(super) fn show_rows(rows: &[Row]) -> Result<(), Failure> {
    print(format_args!(
        "{:<18} {:>9}  promise",
        "invariant", "looked at"
    ))?;
    for Row {
        name,
        promise,
        judged,
    } in rows
    {
        print(format_args!("{name:<18} {:>9}  {promise}", judged.checked))?;
        if let Some(Violation { at_s, values }) = &judged.first {
            let times = judged.broken;
            print(format_args!(
                "  BROKEN {times} times, first at {at_s:.3} s: {values}"
            ))?;
        }
    }
    Ok(())
}

/// Succeeds if all holds.
fn judged(document: &Document) -> Result<(), Failure> {
    if document.sessions.is_empty() {
        return Err(Failure::usage("there is no session in these records").remedy(RECORDS));
    }
    let broken = document.invariants.iter();
    let broken: Vec<_> = broken.filter(|row| row.judged.broken > 0).collect();
    if broken.is_empty() {
        return Ok(());
    }
    let names: Vec<_> = broken.iter().map(|row| row.name).collect();
    let what = format!("what is promised does not hold: {}", names.join(", "));
    Err(Failure::failed(what).remedy("report it with the record: it holds no secret"))
}
