//! `mmt sweep`: the rows of a plan on threads, with part files and the table of results in a folder.
//!
//! Whatever ends a run, the rows that are done stay: the same command goes on with the others. Rows under way when a person
//! asks for the end are not waited for.

mod summary;

use std::fmt::Display;
use std::sync::mpsc::Sender;

use mmt_lab::io::{SweepDir, SweepError};
use mmt_lab::layers::Program;
use mmt_lab::sweep::{Plan, Results};

use crate::args::SweepArguments;
use crate::config::{ConfigFile, Flags};
use crate::failure::Failure;
use crate::input::read_text;
use crate::output::{make_folder, print, print_json, unwritten};
use crate::progress::Bar;
use crate::stop::Stop;

use summary::{Preview, Summary};

/// Runs `mmt sweep`.
///
/// # Errors
/// The plan is wrong or not that of the folder; the folder cannot be read or written; rows are missing at the end.
pub(crate) fn run(arguments: &SweepArguments) -> Result<(), Failure> {
    let text = read_text(&arguments.plan, "the plan")?;
    let below = ConfigFile::read(arguments.config.as_deref())?;
    below.with(Program::Sweep, &Flags::default(), |layers| layers.config())?;
    let plan = Plan::parse_over(&text, &below.text).map_err(|error| {
        Failure::usage(format!("the plan {}: {error}", arguments.plan.display()))
            .remedy("correct that place; docs/sweep.md describes what a plan holds")
    })?;
    if arguments.dry_run {
        let preview = Preview::new(&plan, arguments.shard);
        return print_document(arguments.json, &preview);
    }
    if arguments.merge && !arguments.out.is_dir() {
        let what = format!("there is no folder {}", arguments.out.display());
        return Err(Failure::usage(what).remedy("give the folder of the shards with --out"));
    }
    make_folder(&arguments.out)?;
    let explained = |error| explain(error, arguments);
    let dir = SweepDir::open(&arguments.out).map_err(explained)?;
    let before = dir.results(&plan).map_err(explained)?;
    // only now: the plan of a folder that holds another plan's rows stays
    dir.keep_plan(&text).map_err(explained)?;
    let interrupted = !arguments.merge && run_missing(arguments, &plan, &dir, &before)?;
    finish(arguments, &plan, &dir, &before, interrupted)
}

/// Runs the rows of the shard that are not done; whether it was interrupted.
fn run_missing(
    arguments: &SweepArguments,
    plan: &Plan,
    dir: &SweepDir,
    before: &Results,
) -> Result<bool, Failure> {
    let rows: Vec<u64> = before
        .missing(plan)
        .filter(|row| arguments.shard.has(*row))
        .collect();
    let stop = Stop::on_signals()?;
    let bar = Bar::new();
    let (shown, wish) = (bar.clone(), stop.clone());
    let (arguments, plan, dir) = (arguments.clone(), plan.clone(), dir.clone());
    let every_row = move |_: Sender<()>| {
        let done = |done: usize| bar.show("sweep", done, rows.len());
        let ended = || wish.asked();
        match dir.run(&plan, arguments.shard, &rows, arguments.jobs, ended, done) {
            Ok(()) | Err(SweepError::Interrupted) => Ok(()),
            Err(error) => Err(explain(error, &arguments)),
        }
    };
    stop.until_asked(every_row, Ok)?;
    shown.clear();
    Ok(stop.asked())
}

/// Writes the table if every row is there, prints the state, and fails if rows are missing that should be there.
fn finish(
    arguments: &SweepArguments,
    plan: &Plan,
    dir: &SweepDir,
    before: &Results,
    interrupted: bool,
) -> Result<(), Failure> {
    let explained = |error| explain(error, arguments);
    let results = dir.results(plan).map_err(explained)?;
    let table = match results.to_csv(plan) {
        Some(csv) => Some(dir.keep_results(&csv).map_err(explained)?),
        None => None,
    };
    let summary = Summary::new(plan, arguments, before, &results, table.as_deref());
    print_document(arguments.json, &summary)?;
    let Some(missing) = summary.missing_here() else {
        return Ok(());
    };
    let (plan, out) = (arguments.plan.display(), arguments.out.display());
    Err(if interrupted {
        Failure::failed(format!("interrupted: {missing}"))
            .remedy("give the same command again: what is done is kept, and it goes on from there")
    } else {
        Failure::failed(missing).remedy(format!(
            "copy the other shards' rows/*.csv into {out}/rows, or run what is missing: mmt sweep {plan} --out {out}"
        ))
    })
}

fn print_document(json: bool, document: &(impl Display + serde::Serialize)) -> Result<(), Failure> {
    if json {
        print_json(document)
    } else {
        print(document)
    }
}

fn explain(error: SweepError, arguments: &SweepArguments) -> Failure {
    match error {
        SweepError::Part(_) => Failure::usage(error).remedy(
            "give another folder with --out, or remove that file if its rows are not wanted",
        ),
        SweepError::File { path, why } => {
            let what = format!("cannot read or write {}: {why}", path.display());
            unwritten(&arguments.out, what)
        }
        SweepError::Trial { .. } | SweepError::Interrupted => Failure::failed(error),
    }
}
