//! What the transport adds to the network's own delay: every case of the grid, the promises, a table and a figure.

mod figure;
mod grid;
mod tables;

use std::time::Duration;

use crate::digest::of_runs;
use crate::experiment::description::{Experiment, Request};
use crate::experiment::findings::{ExperimentError, Findings};
use crate::io::{Runner, virtual_time};
use crate::transport::{Case, Outcome, Stack};

/// Stock quinn against ours.
pub(super) const TRANSPORT: Experiment = Experiment {
    name: "transport",
    about: "What the protocol adds to the network's delay: stock quinn against ours, in exact virtual time",
    seeds: 1,
    // 864 runs, a second of which may be an outage
    duration: Duration::from_secs(20),
    arguments: &[],
    run,
};

/// A case and what it measured.
type Run<'a> = (&'a Case, &'a Outcome);

/// Keeps `transport.csv` and `transport.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let grids = (1..=extent.seeds).map(|seed| grid::cases(extent.duration, seed));
    // a case has its seed, so that the rows of a seed stand together
    let groups = runner.grid("transport", 1, grids.flatten().collect(), |case, _| {
        Ok(virtual_time::run(case)?)
    })?;
    let of_group = groups.iter().map(|group| (&group.case, group.runs.iter()));
    let runs = of_group.flat_map(|(case, runs)| runs.map(move |outcome| (case, outcome)));
    let runs: Vec<Run> = runs.collect();
    runner.keep_table("transport.csv", &tables::all(&runs))?;
    runner.keep_figure("transport.svg", &figure::figure(&runs))?;
    Ok(Findings {
        experiment: TRANSPORT.name,
        extent,
        digest: of_runs(runs.iter().map(|(_, outcome)| outcome.digest.as_str())),
        configuration: Vec::new(),
        tables: vec![
            tables::promises(&runs),
            tables::examples(&runs),
            tables::worst(&runs),
        ],
    })
}

/// The runs of one stack.
fn of<'a>(runs: &[Run<'a>], stack: Stack) -> Vec<Run<'a>> {
    let runs = runs.iter().filter(|(case, _)| case.stack == stack);
    runs.copied().collect()
}

/// The largest of what some runs measured.
fn largest(runs: &[Run], of: impl Fn(&Outcome) -> Option<f64>) -> Option<f64> {
    let values = runs.iter().filter_map(|(_, outcome)| of(outcome));
    values.max_by(f64::total_cmp)
}
