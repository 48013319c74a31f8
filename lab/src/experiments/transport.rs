//! What the transport adds to the network's own delay: every case of the grid, the promises, a table and a figure.

mod figure;
mod grid;
mod tables;

use crate::digest::of_runs;
use crate::experiment::prelude::*;
use crate::io::virtual_time;
use grid::FlowRun;

/// Stock quinn against ours: 864 runs, a second of which may be an outage.
pub(super) const TRANSPORT: Experiment = Experiment {
    duration: Duration::from_secs(20),
    ..Experiment::new(
        "transport",
        "What the protocol adds to the network's delay: stock quinn against ours, in exact virtual time",
        1,
        run,
    )
};

/// Keeps `transport.csv` and `transport.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let seeds = (runner.first_seed()..).zip(0..extent.seeds);
    let grids = seeds.map(|(seed, _)| grid::cases(extent.duration, seed));
    // a case has its seed, so that the rows of a seed stand together
    let groups = runner.grid("transport", 1, grids.flatten().collect(), |case, _| {
        let outcome = virtual_time::run(case);
        outcome.map_err(|why| ExperimentError::Transport(why.to_string()))
    })?;
    let of_group = groups.iter().map(|group| (&group.case, group.runs.iter()));
    let runs = of_group.flat_map(|(case, runs)| runs.map(move |outcome| (case, outcome)));
    let runs: Vec<FlowRun> = runs.collect();
    runner.keep_table("transport.csv", &tables::all(&runs))?;
    runner.keep_figure("transport.svg", &figure::figure(&runs))?;
    Ok(Findings {
        digest: of_runs(runs.iter().map(|(_, outcome)| outcome.digest.as_str())),
        tables: vec![
            tables::promises(&runs),
            tables::examples(&runs),
            tables::worst(&runs),
        ],
        ..Findings::default()
    })
}
