//! Recorded sessions, run again to the same bits.

use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;

use mmt_lab::again::{AgainError, RanAgain, SessionsAgain};
use mmt_lab::what_if::{Otherwise, RecordedRun, WhatIfError};
use mmt_shared::io::record::{Ended, RecordError, is_record};
use mmt_shared::recording::Recording;
use serde::Serialize;

use crate::args::ReplayArguments;
use crate::commands::records::{RECORDS, read_run};
use crate::failure::Failure;
use crate::input::read_text;
use crate::output::{print, print_json};
use crate::stop::Stop;

/// A record that ran again, as the document shows it.
#[derive(Debug, Serialize)]
struct Record {
    file: String,
    /// Whether it is whole; if not, it was cut off.
    is_whole: bool,
    sessions: Vec<Session>,
}

#[derive(Debug, Serialize)]
struct Session {
    side: &'static str,
    session: u32,
    /// Ticks that gave the same bits.
    ticks: u64,
    /// Whether inputs are missing after these ticks.
    has_gap: bool,
    digest: String,
}

#[derive(Debug, Serialize)]
struct Document {
    version: &'static str,
    command: &'static str,
    records: Vec<Record>,
}

/// Why a record was not run again.
#[derive(Debug, thiserror::Error)]
enum Error {
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error(transparent)]
    Again(#[from] AgainError),
    #[error(transparent)]
    WhatIf(#[from] WhatIfError),
}

/// Whether the files are records of sessions and not recorded pushes.
///
/// # Errors
/// There are both, or beside a record one that cannot be read or is neither.
pub(super) fn are_records(files: &[PathBuf]) -> Result<bool, Failure> {
    // who cannot be read is named by who reads it whole
    let is_one = |path: &&PathBuf| is_record(path).unwrap_or(false);
    let (records, others): (Vec<_>, Vec<_>) = files.iter().partition(is_one);
    if records.is_empty() || others.is_empty() {
        return Ok(!records.is_empty());
    }
    for path in others {
        let text = read_text(path, "the file")?;
        Recording::parse(&text).map_err(|error| {
            let shown = path.display();
            let what = format!(
                "{shown} is no record of a session, and no file of recorded pushes: {error}"
            );
            Failure::usage(what).remedy("leave it out, or give a file made with --record")
        })?;
    }
    let what = "some of the files are records of sessions and some are recorded pushes";
    Err(Failure::usage(what).remedy("replay them one kind at a time"))
}

/// Runs every session of every record again.
///
/// # Errors
/// A record cannot be read, is of another version, or gave something else.
pub(super) fn run(arguments: &ReplayArguments) -> Result<(), Failure> {
    let otherwise = otherwise(arguments);
    if otherwise != Otherwise::default() {
        return what_if(arguments, &otherwise);
    }
    let (mut records, files) = (Vec::new(), arguments.files.clone());
    let every_file = move |done: Sender<Record>| {
        for path in &files {
            let record = again(path)?;
            if done.send(record).is_err() {
                break;
            }
        }
        Ok(())
    };
    let left = Stop::on_signals()?.until_asked(every_file, |record| {
        if !arguments.json {
            show(&record)?;
        }
        records.push(record);
        Ok(())
    })?;
    let done = records.len();
    if arguments.json {
        print_json(&Document {
            version: env!("CARGO_PKG_VERSION"),
            command: "replay",
            records,
        })?;
    }
    if left {
        return Err(Failure::interrupted(done, arguments.files.len(), "records")
            .remedy("what is printed is whole; give the other records again"));
    }
    Ok(())
}

/// What the arguments ask to be other than in the record.
pub(super) fn otherwise(arguments: &ReplayArguments) -> Otherwise {
    let both = &arguments.netem;
    Otherwise {
        scheme: arguments.scheme,
        up: arguments.netem_up.clone().or_else(|| both.clone()),
        down: arguments.netem_down.clone().or_else(|| both.clone()),
    }
}

/// The recorded hand in virtual time, as it was and otherwise.
fn what_if(arguments: &ReplayArguments, otherwise: &Otherwise) -> Result<(), Failure> {
    let mut run = RecordedRun::default();
    read_run(
        &arguments.files,
        |topic, message| -> Result<(), Error> { Ok(run.take(topic, message)?) },
        |path, error| failure(path, &error),
    )?
    .with_sessions()?;
    let answer = run.answer(otherwise).map_err(|error| {
        Failure::usage(error).remedy("give the record of a demo, or those of both hosts of one run")
    })?;
    if arguments.json {
        print_json(&answer)
    } else {
        print(answer)
    }
}

fn again(path: &PathBuf) -> Result<Record, Failure> {
    let mut sessions = SessionsAgain::default();
    let read = read_run(
        std::slice::from_ref(path),
        |topic, message| -> Result<(), Error> {
            sessions.take(topic, message)?;
            Ok(())
        },
        |path, error| failure(path, &error),
    )?;
    let ended = read.with_sessions()?;
    let ran = sessions.ran().map(|(side, session, ran)| {
        let RanAgain {
            ticks,
            digest,
            has_gap,
            ..
        } = ran;
        Session {
            side,
            session,
            ticks,
            has_gap,
            digest: format!("{digest:016x}"),
        }
    });
    Ok(Record {
        file: path.display().to_string(),
        is_whole: ended == [Ended::Whole],
        sessions: ran.collect(),
    })
}

fn show(record: &Record) -> Result<(), Failure> {
    print(&record.file)?;
    for of in &record.sessions {
        let Session {
            side,
            session,
            ticks,
            digest,
            ..
        } = of;
        print(format_args!(
            "  {side}, session {session}: {ticks} ticks ran again to the same bits, digest {digest}"
        ))?;
        if of.has_gap {
            print("    then inputs are missing: the disk was too slow for the record")?;
        }
    }
    if !record.is_whole {
        print("  the record is cut off here")?;
    }
    Ok(())
}

fn failure(path: &Path, error: &Error) -> Failure {
    let what = format!("the record {}: {error}", path.display());
    match error {
        Error::Again(AgainError::Difference { .. }) => Failure::failed(what).remedy(
            "see whether the same build made it: a build of other code computes other bits",
        ),
        Error::Again(AgainError::OtherProgram { .. }) => {
            Failure::usage(what).remedy("take the version that made it; mmt export reads it anyway")
        }
        _ => Failure::usage(what).remedy(RECORDS),
    }
}
