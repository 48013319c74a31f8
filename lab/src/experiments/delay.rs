//! At which delay each architecture stops being usable: one operator, one object, one network, every architecture.
//!
//! The plain sweep of the delay at k_p 1000 for all of them, the same at other stiffnesses up to the delays that
//! decide there, and jitter, loss and bursts at a few delays; the full grid on request. And what the operator's
//! picture does beyond 500 ms.

mod choices;
mod crossing;
mod figure;
mod grid_point;
mod limits;
mod tables;
mod tuned;
mod tuning;

use crate::architecture;
use crate::experiment::prelude::*;
use crate::trial::TrialError;
pub(super) use tuned::TUNED;

use grid_point::{GridPoint, Group, all_points, some_points, view_points};

/// The architectures over the delay; pushes come later with it.
pub(super) const DELAY: Experiment = Experiment {
    duration: Duration::from_secs(40),
    arguments: &[Argument {
        name: "full",
        help: "The whole grid of delays, jitter, losses and stiffnesses: about an hour",
        number: None,
    }],
    ..Experiment::new(
        "delay",
        "At which delay each architecture stops being usable",
        5,
        run,
    )
};

/// Keeps `delay.csv`, `delay-limits.csv`, `delay-view.csv`, `delay-crossing.csv` and `delay.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let points = if request.flag("full") {
        all_points()
    } else {
        some_points()
    };
    let groups = measure(runner, request, "delay", points)?;
    let limits = limits::table(&groups);
    runner.keep_table("delay.csv", &tables::runs(&groups, runner.first_seed()))?;
    runner.keep_table("delay-limits.csv", &limits)?;
    runner.keep_figure("delay.svg", &figure::figure(&groups))?;

    let runs = measure(runner, request, "delay-view", view_points())?;
    let views = tables::views(&runs);
    runner.keep_table("delay-view.csv", &views)?;

    let near = measure(runner, request, "delay-crossing", crossing::points())?;
    let [near, crossings] = crossing::tables(&near);
    runner.keep_table("delay-crossing.csv", &near)?;
    Ok(Findings {
        digest: String::new(),
        configuration: vec![WorldConfig::default()],
        tables: vec![tables::replayed(&groups), limits, views, near, crossings],
    })
}

fn measure(
    runner: &Runner,
    request: &Request,
    what: &str,
    points: Vec<GridPoint>,
) -> Result<Vec<Group>, ExperimentError> {
    let extent = request.extent;
    runner.grid(what, extent.seeds, points, |point, seed| {
        let world = point.world()?.seeded(seed);
        let row = architecture::run(point.architecture, &world, extent.duration);
        row.map_err(|error| TrialError::from(error).into())
    })
}
