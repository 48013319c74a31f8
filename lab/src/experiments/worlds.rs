//! Random worlds: what the recommended scheme comes to where nothing is as it expects, and the worst worlds by number.
//!
//! What the hand can move is judged by force, the rest by pose, sign and energy.

mod ideal;
mod row;
mod run;
mod tables;

use crate::experiment::prelude::*;
use crate::io::FRESH_SEED;
use crate::worlds::RandomWorld;
use row::Row;
use run::reach;

/// The first world: rules were made with single ones below 30000 in view.
const FIRST: u64 = 30_001;

/// The worlds.
pub(super) const EXPERIMENT: Experiment = Experiment {
    arguments: &[
        Argument {
            name: "world",
            help: "Only the world of this number",
            number: Some(("N", 0.0)),
        },
        Argument {
            name: "first",
            help: "The first world",
            number: Some(("N", FIRST as f64)),
        },
        Argument {
            name: "stiff-tool",
            help: "With a tool that does not give",
            number: None,
        },
        Argument {
            name: "ideal",
            help: "The same worlds with one thing at a time ideal",
            number: None,
        },
    ],
    duration: Duration::from_secs(20),
    seeds_left_out: FIRST - FRESH_SEED,
    ..Experiment::new(
        "worlds",
        "Random worlds by one documented distribution: force error, packets, pose, energy, and the worst ten",
        1000,
        run,
    )
};

/// Keeps `worlds.csv` and `worlds.svg`, or `worlds-ideal.csv`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let one = request.number("world").is_some_and(|number| number >= 1.0);
    let first = EXPERIMENT.first_seed(runner, request);
    let seeds = if one { 1 } else { extent.seeds };
    if request.flag("ideal") {
        return ideal::compare(runner, extent, first);
    }
    let groups = runner.grid_from(first, "worlds", seeds, vec![()], |(), number| {
        let mut world = RandomWorld::new(number);
        if request.flag("stiff-tool") {
            world.config.slave.tool_compliance = None;
        }
        let reached = reach(&world.config, None, extent.duration)?;
        Ok(Row { world, reached })
    })?;
    let rows: Vec<Row> = groups.into_iter().flat_map(|group| group.runs).collect();
    let all = Table::of("Random worlds", &rows, &tables::columns());
    runner.keep_table("worlds.csv", &all)?;
    let digests = rows.iter().map(|row| row.reached.digest.as_str());
    let digest = crate::digest::of_runs(digests);
    if one {
        let tables = vec![all];
        return Ok(Findings {
            digest,
            tables,
            ..Findings::default()
        });
    }
    runner.keep_figure("worlds.svg", &tables::figure(&rows))?;
    Ok(Findings {
        digest,
        tables: vec![
            tables::distribution(&rows, first, extent),
            tables::targets(&rows),
            tables::poses(&rows),
            tables::worst(&rows, &options(request)),
        ],
        ..Findings::default()
    })
}

/// The options that make a world what it is, besides its number.
fn options(request: &Request) -> String {
    let duration = request.extent.duration;
    let mut options = String::new();
    if request.flag("stiff-tool") {
        options.push_str(" --stiff-tool");
    }
    if duration != EXPERIMENT.duration {
        options.push_str(&format!(" --duration {}ms", duration.as_millis()));
    }
    options
}
