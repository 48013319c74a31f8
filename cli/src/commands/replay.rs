//! `mmt replay`: recorded real pushes through `mmt_lab::replay`, and recorded sessions through their own ends again.
//!
//! The kind of the files decides.

use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;

use mmt_lab::replay::{ReplayConfig, pipeline, pipeline_table, replay};
use mmt_lab::what_if::Otherwise;
use mmt_shared::recording::Recording;

use crate::args::ReplayArguments;
use crate::failure::Failure;
use crate::input::read_text;
use crate::output::{print, print_json};
use crate::progress::Bar;
use crate::stop::Stop;

mod document;
mod session;

use document::{Document, Replayed};

/// Runs `mmt replay`. Whoever asks for its end keeps the files that are done.
///
/// # Errors
/// A file cannot be read or is no recording; stdout cannot be written to; the end was asked for before the last file.
pub(crate) fn run(arguments: &ReplayArguments) -> Result<(), Failure> {
    if session::are_records(&arguments.files)? {
        return session::run(arguments);
    }
    if session::otherwise(arguments) != Otherwise::default() {
        let what =
            "--scheme and --netem are for records of sessions, and these are recorded pushes";
        return Err(
            Failure::usage(what).remedy("leave them out, or give a file made with --record")
        );
    }
    let config = ReplayConfig {
        deadband: arguments.deadband,
        t_update_s: arguments.t_update.0.map(|period| period.as_secs_f64()),
        repeats: arguments.splits,
        seed: arguments.seed,
        ..ReplayConfig::default()
    };
    // All are read before the first is replayed: a slip in the last name costs no time.
    let paths = arguments.files.iter();
    let recordings: Vec<_> = paths
        .map(|path| Ok((path.clone(), recording(path)?)))
        .collect::<Result<_, Failure>>()?;
    let stop = Stop::on_signals()?;
    let (bar, mut replayed) = (Bar::new(), Vec::new());
    let shown = bar.clone();
    let left = stop.until_asked(
        move |done| {
            every_recording(&recordings, &config, &bar, &done);
            Ok(())
        },
        |of: Replayed| {
            if !arguments.json {
                let table = pipeline_table(&of.pipeline);
                shown.step_aside(|| print(format_args!("{}\n{}\n{table}", of.file, of.report)))?;
            }
            replayed.push(of);
            Ok(())
        },
    )?;
    shown.clear();
    let done = replayed.len();
    if arguments.json {
        print_json(&Document::new(&config, replayed, left))?;
    }
    if left {
        return Err(Failure::interrupted(done, arguments.files.len(), "files")
            .remedy("what is printed is whole; give the other files again"));
    }
    Ok(())
}

/// Replays the recordings in their order and sends what each came to.
fn every_recording(
    recordings: &[(PathBuf, Recording)],
    config: &ReplayConfig,
    bar: &Bar,
    done: &Sender<Replayed>,
) {
    for (path, recording) in recordings {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let mut progress = |done: usize, whole: usize| bar.show(&name, done, whole);
        let report = replay(recording, config, &mut progress);
        let pipeline = pipeline(recording).unwrap_or_default();
        bar.clear();
        let replayed = Replayed {
            file: path.display().to_string(),
            report,
            pipeline,
        };
        if done.send(replayed).is_err() {
            return;
        }
    }
}

fn recording(path: &Path) -> Result<Recording, Failure> {
    let text = read_text(path, "the recording")?;
    Recording::parse(&text).map_err(|error| {
        let what = format!("the recording {}: {error}", path.display());
        Failure::usage(what)
            .remedy("give a file of recorded pushes; docs/replay.md has its grammar")
    })
}
