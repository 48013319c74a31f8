//! `mmt soak`: sessions of real processes for hours, with random faults. Does anything break, leak or grow?
//!
//! One slave and its relay live as long as the soak; every other cycle has a slave of its own, which is recorded and may die.
//! Whatever masters and those slaves recorded is judged as `mmt check` judges it. What processes have of the system's is sampled:
//! between the cycles of the slave that lives on, when it has had no session for a while, nothing may have become more.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use mmt_shared::rng::Substream;
use serde::Serialize;

use super::check::{Row as Invariant, rows, show_rows};
use crate::args::SoakArguments;
use crate::failure::Failure;
use crate::output::{counts, make_folder, print, print_json};
use crate::stop::Stop;

mod cycle;
mod process;
mod rig;
mod tally;
mod usage;

use cycle::{Cycle, Slave};
use rig::{Recording, Rig};
use tally::{Broken, Recorded, Tally};
use usage::Row;

/// The length of a cycle, s.
const CYCLE_S: (f64, f64) = (15.0, 45.0);
/// A short soak has so many cycles at least.
const CYCLES_MIN: f64 = 4.0;

#[derive(Debug, Serialize)]
struct Document<'a> {
    version: &'static str,
    command: &'static str,
    seed: u64,
    duration_h: f64,
    ending: &'static str,
    cycles: u64,
    /// How many masters ended how.
    masters: &'a BTreeMap<&'static str, u64>,
    /// How many sessions were judged, each end by itself.
    sessions: usize,
    faults: &'a BTreeMap<String, u64>,
    holds: bool,
    broken: &'a [Broken],
    processes: Vec<Row>,
    invariants: Vec<Invariant>,
}

/// Runs `mmt soak`.
///
/// # Errors
/// A promise is broken, or something grows; a process does not start, or is gone; stdout cannot be written to.
pub(crate) fn run(arguments: &SoakArguments) -> Result<(), Failure> {
    let stop = Stop::on_signals()?;
    let out = &arguments.out;
    make_folder(out)?;
    let out = out.canonicalize().map_err(Failure::usage)?;
    let mut tally = Tally::new();
    let soaked = soak(arguments, &out, &stop, &mut tally);
    tidy(&out);
    let ending = stop.ending().name();
    let processes = tally.rows();
    let grows = processes.iter().any(|row| !row.grows.is_empty());
    let document = Document {
        version: env!("CARGO_PKG_VERSION"),
        command: "soak",
        seed: arguments.seed,
        duration_h: tally.hours(),
        ending,
        cycles: tally.cycles,
        masters: &tally.masters,
        sessions: tally.sessions,
        faults: &tally.faults,
        holds: tally.broken.is_empty() && !grows,
        broken: &tally.broken,
        invariants: rows(&tally.verdict),
        processes,
    };
    if arguments.json {
        print_json(&document)?;
    } else {
        show(&document)?;
    }
    soaked?;
    if document.holds {
        return Ok(());
    }
    let kept = out.display();
    Err(Failure::failed("the soak broke a promise").remedy(format!(
        "see what is broken or grows above, and what is in {kept}"
    )))
}

/// Cycle after cycle until the time is over or somebody asks for the end.
fn soak(
    arguments: &SoakArguments,
    out: &Path,
    stop: &Stop,
    tally: &mut Tally,
) -> Result<(), Failure> {
    let lasting = Folders::make(out, "lasting")?;
    let seed = arguments.seed;
    let mut rig = Rig::start(&lasting.folder, &lasting.state, Recording::Off, seed)?;
    let longest_s = arguments.hours * 3600.0 / CYCLES_MIN;
    let mut lengths = Substream::new(seed, "soak/length", 0);
    while tally.hours() < arguments.hours && !stop.asked() {
        let number = tally.cycles + 1;
        let place = Folders::make(out, &format!("cycle-{number}"))?;
        tally.next_cycle(place.folder.clone());
        let length_s = lengths.uniform_in(CYCLE_S.0, CYCLE_S.1).min(longest_s);
        let length = Duration::from_secs_f64(length_s);
        let seed = Substream::new(seed, "soak/cycle", number).bits();
        if number % 2 == 1 {
            let folders = [&*place.folder, &*lasting.state];
            let cycle = Cycle::new(&mut rig, tally, stop, folders, seed, Slave::Lasting);
            let records = cycle.run(length)?;
            tally.judge(&records);
        } else {
            own_slave(&place, tally, stop, seed, length)?;
            Slave::Lasting.sample_idle(&rig, tally);
        }
        if !tally.is_cycle_broken() {
            place.remove();
        }
    }
    end(rig, tally);
    if tally.broken.is_empty() {
        lasting.remove();
    }
    Ok(())
}

/// A cycle with a slave of its own.
fn own_slave(
    place: &Folders,
    tally: &mut Tally,
    stop: &Stop,
    seed: u64,
    length: Duration,
) -> Result<(), Failure> {
    let folders = [&*place.folder, &*place.state];
    let mut rig = Rig::start(folders[0], folders[1], Recording::On, seed >> 1)?;
    let cycle = Cycle::new(&mut rig, tally, stop, folders, seed, Slave::Mortal);
    let mut records = cycle.run(length)?;
    let slave = rig.records().to_vec();
    end(rig, tally);
    let last = slave.len();
    records.extend(slave.into_iter().enumerate().map(|(n, path)| Recorded {
        path,
        is_whole: n + 1 == last,
    }));
    tally.judge(&records);
    Ok(())
}

/// Ends slave and relay.
fn end(rig: Rig, tally: &mut Tally) {
    for process in rig.into_processes() {
        let (ended, process) = process.end();
        tally.ended(&process, ended);
    }
}

/// Where processes keep things.
struct Folders {
    /// Logs and records.
    folder: PathBuf,
    /// What they keep for themselves, secrets among it.
    state: PathBuf,
}

impl Folders {
    fn make(out: &Path, name: &str) -> Result<Self, Failure> {
        let (folder, state) = (out.join(name), out.join("state").join(name));
        // what an earlier soak left there
        let _ = std::fs::remove_dir_all(&folder);
        make_folder(&folder)?;
        make_folder(&state)?;
        Ok(Self { folder, state })
    }

    /// Nothing of it is worth keeping.
    fn remove(&self) {
        for path in [&self.folder, &self.state] {
            if let Err(error) = std::fs::remove_dir_all(path) {
                tracing::warn!("cannot remove {}: {error}", path.display());
            }
        }
    }
}

/// Removes all secrets, and the folder if nothing is kept in it.
fn tidy(out: &Path) {
    // one that was never made cannot be removed, nor one that keeps something
    let _ = std::fs::remove_dir_all(out.join("state"));
    let _ = std::fs::remove_dir(out);
}

fn show(document: &Document<'_>) -> Result<(), Failure> {
    let Document {
        seed,
        duration_h,
        ending,
        cycles,
        sessions,
        ..
    } = document;
    print(format_args!(
        "{duration_h:.2} h, seed {seed}, {ending}: {cycles} cycles, {sessions} ends of sessions judged"
    ))?;
    print(format_args!("masters: {}", counts(document.masters)))?;
    print(format_args!("faults: {}\n", counts(document.faults)))?;
    print(Row::heading())?;
    for row in &document.processes {
        print(row.line())?;
        row.slope_line().map_or(Ok(()), print)?;
        for what in &row.grows {
            print(format_args!("  BROKEN: the {what} of {} grow", row.process))?;
        }
    }
    print("")?;
    show_rows(&document.invariants)?;
    for broken in document.broken {
        print(broken.line())?;
    }
    Ok(())
}
