//! `mmt swarm`: random worlds with random faults in virtual time, judged as `mmt check` judges records.

use std::collections::BTreeMap;
use std::num::NonZero;
use std::sync::mpsc::Sender;
use std::time::Duration;

use mmt_lab::check::Verdict;
use mmt_lab::io::{Repeated, swarm_of};
use mmt_lab::swarm::Swarmed;
use serde::Serialize;

use super::check::{Row, rows, show_rows};
use crate::args::SwarmArguments;
use crate::failure::Failure;
use crate::output::{counts, print, print_json};
use crate::progress::Bar;
use crate::stop::Stop;

/// A person who ends a swarm loses no more seeds than this.
const BLOCK: usize = 50;

#[derive(Debug, Serialize)]
struct Document {
    version: &'static str,
    command: &'static str,
    seeds: usize,
    duration_s: f64,
    sessions: u64,
    faults: usize,
    /// How often each kind of fault was there.
    by_fault: BTreeMap<String, u64>,
    /// Seeds that were run twice.
    repeated: usize,
    holds: bool,
    failed: Vec<Failed>,
    invariants: Vec<Row>,
}

/// A seed in which something broke.
#[derive(Debug, Serialize)]
struct Failed {
    seed: u64,
    /// What runs it again.
    again: String,
    what: Vec<String>,
}

/// Runs `mmt swarm`. Whoever asks for its end keeps the seeds that are done.
///
/// # Errors
/// Something that is promised did not hold, or two runs of one seed differ; the end was asked for before the last seed; stdout
/// cannot be written to.
pub(crate) fn run(arguments: &SwarmArguments) -> Result<(), Failure> {
    let all = || (arguments.first..).take(usize::try_from(arguments.seeds).unwrap_or(usize::MAX));
    let seeds: Vec<u64> = arguments
        .seed
        .map_or_else(|| all().collect(), |seed| vec![seed]);
    let wanted = seeds.len();
    let (bar, mut ran) = (Bar::new(), Vec::new());
    let shown = bar.clone();
    let (duration, jobs) = (arguments.duration, arguments.jobs);
    let left = Stop::on_signals()?.until_asked(
        move |done| in_blocks(&seeds, duration, jobs, &bar, &done),
        |block: Vec<Repeated>| {
            ran.extend(block);
            Ok(())
        },
    )?;
    shown.clear();
    let document = document(arguments, &ran);
    if arguments.json {
        print_json(&document)?;
    } else {
        show(arguments, &document, &ran)?;
    }
    if document.holds && !left {
        return Ok(());
    }
    if document.holds {
        return Err(Failure::interrupted(ran.len(), wanted, "seeds")
            .remedy("what is printed is of these; --first begins at the next one"));
    }
    let what = format!(
        "{} of {} seeds broke a promise",
        document.failed.len(),
        document.seeds
    );
    Err(Failure::failed(what).remedy("run a seed again with the command that is printed for it"))
}

/// Runs the seeds in blocks and sends each block that is done.
fn in_blocks(
    seeds: &[u64],
    duration: Duration,
    jobs: Option<NonZero<usize>>,
    bar: &Bar,
    done: &Sender<Vec<Repeated>>,
) -> Result<(), Failure> {
    for (block, before) in seeds.chunks(BLOCK).zip((0..).step_by(BLOCK)) {
        let progress = |what: &str, done: usize, _| bar.show(what, before + done, seeds.len());
        let ran = swarm_of(block, duration, jobs, &progress);
        let ran = ran.map_err(|error| Failure::failed(format!("a random world is none: {error}")));
        if done.send(ran?).is_err() {
            break;
        }
    }
    Ok(())
}

fn document(arguments: &SwarmArguments, ran: &[Repeated]) -> Document {
    let mut sum = Verdict::default();
    ran.iter()
        .for_each(|one| sum.add(one.swarmed.verdict.clone()));
    let failed: Vec<_> = ran
        .iter()
        .filter_map(|one| failed(arguments, one))
        .collect();
    let faults = || ran.iter().flat_map(|one| &one.swarmed.faults);
    let mut by_fault = BTreeMap::new();
    faults().for_each(|of| *by_fault.entry(format!("{:?}", of.fault)).or_default() += 1);
    Document {
        version: env!("CARGO_PKG_VERSION"),
        command: "swarm",
        seeds: ran.len(),
        duration_s: arguments.duration.as_secs_f64(),
        sessions: ran.iter().map(|one| one.swarmed.sessions).sum(),
        faults: faults().count(),
        by_fault,
        repeated: ran.iter().filter(|one| one.same.is_some()).count(),
        holds: failed.is_empty(),
        failed,
        invariants: rows(&sum),
    }
}

fn failed(arguments: &SwarmArguments, one: &Repeated) -> Option<Failed> {
    let Repeated { swarmed, same } = one;
    let broken = swarmed.verdict.broken();
    let mut what: Vec<String> = broken
        .map(|(of, first)| {
            format!(
                "{of} at {:.3} s of its session: {}",
                first.at_s, first.values
            )
        })
        .collect();
    if *same == Some(false) {
        what.push("two runs of this seed differ".to_owned());
    }
    let (seed, seconds) = (swarmed.seed, arguments.duration.as_secs_f64());
    let again = format!("mmt swarm --seed {seed} --duration {seconds}s");
    (!what.is_empty()).then_some(Failed { seed, again, what })
}

fn show(arguments: &SwarmArguments, document: &Document, ran: &[Repeated]) -> Result<(), Failure> {
    if let (Some(_), [one]) = (arguments.seed, ran) {
        show_faults(&one.swarmed)?;
    }
    for Failed { again, what, .. } in &document.failed {
        print(again)?;
        what.iter()
            .try_for_each(|what| print(format_args!("  BROKEN {what}")))?;
    }
    let Document {
        seeds,
        duration_s,
        sessions,
        faults,
        by_fault,
        repeated,
        ..
    } = document;
    print(format_args!(
        "{seeds} seeds of {duration_s} s: {sessions} sessions, {faults} faults, {repeated} seeds run twice"
    ))?;
    print(format_args!("faults: {}\n", counts(by_fault)))?;
    show_rows(&document.invariants)
}

fn show_faults(swarmed: &Swarmed) -> Result<(), Failure> {
    for fault in &swarmed.faults {
        print(fault)?;
    }
    print(format_args!("digest {:016x}", swarmed.digest))
}
