//! Figs. 6 and 7: the forces and the packets of one run, over time.

use crate::experiment::prelude::*;
use crate::forces::{figure, forces};

/// The deadband of both figures.
const DEADBAND: f64 = 0.15;

/// Fig. 6.
pub(super) const FIG6: Experiment = Experiment::new(
    "fig6",
    "Fig. 6: forces and packets over time, deadband 15 %",
    1,
    |runner, request| run(runner, request, "fig6", Curve::Deadband),
);

/// Fig. 7.
pub(super) const FIG7: Experiment = Experiment::new(
    "fig7",
    "Fig. 7: the same for hybrid 15 %, 150 ms",
    1,
    |runner, request| run(runner, request, "fig7", Curve::Hybrid(150)),
);

/// Keeps CSV and SVG of the run with the last of the seeds.
fn run(
    runner: &Runner,
    request: &Request,
    name: &str,
    curve: Curve,
) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let seed = runner.first_seed() + extent.seeds.saturating_sub(1);
    let world = paper_world(Mode::Paper, curve.at(DEADBAND)).seeded(seed);
    let groups = runner.grid(name, 1, vec![world.clone()], |world, _| {
        runner.trial(&Trial {
            traced: true,
            ..Trial::new(world.clone(), extent.duration)
        })
    })?;
    let title = format!("{} {} %, paper mode", curve.label(), DEADBAND * 100.0);
    let mut tables = Vec::new();
    for run in groups.iter().flat_map(|group| &group.runs) {
        runner.keep_table(&format!("{name}.csv"), &forces(&run.trace))?;
        runner.keep_figure(&format!("{name}.svg"), &figure(&title, &run.trace))?;
        tables.push(summary(format!("{name}: {title}"), run));
    }
    Ok(Findings {
        digest: digest(&groups),
        configuration: vec![world],
        tables,
    })
}

#[rustfmt::skip]
fn summary(title: String, run: &Measured) -> Table {
    Table::of(
        title,
        [run],
        &[
            column("packets_per_s", "Hz", 1, |run| run.updates.rate_hz()),
            column("contact_packets_per_s", "Hz", 1, |run| run.updates.contact_rate_hz()),
            column("first_contact_second_per_s", "Hz", 1, |run| run.opening_rate_hz),
            column("later_contact_per_s", "Hz", 1, |run| run.later_rate_hz),
            column("pmse", "", 4, |run| run.force.pmse),
            column("relative_error", "", 3, |run| run.force.relative_error),
        ],
    )
}
