//! How far from the best possible: the updates of a scheme over the fewest that an oracle could have done with.
//!
//! The oracle ([`crate::oracle`]) has the run's own pushes, is allowed the force error that the scheme itself reached, and
//! chooses with hindsight from the truth.

mod case;
mod figure;
mod trace;

use crate::experiment::grid::Run;
use crate::experiment::prelude::*;
use case::{Case, Group, Rule, TARGET, ratio};
use trace::Bounded;

/// The bound, with as many seeds as fig. 5.
pub(super) const EXPERIMENT: Experiment = Experiment::new(
    "bound",
    "How far from the best possible: updates over the fewest of an oracle with hindsight",
    10,
    run,
);

/// Keeps `bound.csv` and `bound.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let groups = runner.grid("bound", extent.seeds, Case::all(), |case, seed| {
        Bounded::of(&case.world().seeded(seed), extent.duration)
    })?;
    let runs = Table::of(
        "Runs",
        &grid::runs(&groups, runner.first_seed()),
        &columns(),
    );
    runner.keep_table("bound.csv", &runs)?;
    runner.keep_figure("bound.svg", &figure::figure(&groups))?;
    let runs = groups.iter().flat_map(|group| &group.runs);
    Ok(Findings {
        digest: crate::digest::of_runs(runs.map(|run| run.digest.as_str())),
        configuration: Rule::ALL
            .map(|rule| paper_world(Mode::Recommended, rule.at(0.10)))
            .to_vec(),
        tables: vec![summary(&groups)],
    })
}

#[rustfmt::skip]
fn columns<'a>() -> Vec<Column<'a, Run<'a, Case, Bounded>>> {
    vec![
        column("scheme", "", 0, |run| run.case.rule.name()),
        column("deadband", "", 3, |run| run.case.deadband),
        column("seed", "", 0, |run| run.seed),
        column("duration_s", "s", 1, |run| run.measured.duration_s),
        column("judged_s", "s", 1, |run| run.measured.judged_s),
        column("epsilon_n", "N", 3, |run| run.measured.epsilon_n),
        column("updates", "", 0, |run| run.measured.updates),
        column("contact_updates", "", 0, |run| run.measured.contact_updates),
        column("judged_updates", "", 0, |run| run.measured.judged_updates),
        column("fewest", "", 0, |run| run.measured.fewest.map(|fewest| fewest as u64)),
        column("when_off", "", 0, |run| run.measured.when_off.map(|updates| updates as u64)),
        column("ratio", "", 2, |run| run.measured.ratio()),
    ]
}

#[rustfmt::skip]
fn summary(groups: &[Group]) -> Table {
    let mut columns = vec![
        column("scheme", "", 0, |group: &Group| group.case.rule.name()),
        column("deadband", "", 2, |group| group.case.deadband),
        mean("epsilon_n", "N", 3, |run| run.epsilon_n),
        mean("updates", "", 1, |run| Some(run.updates as f64)),
        mean("contact_updates", "", 1, |run| Some(run.contact_updates as f64)),
        mean("judged_updates", "", 1, |run| Some(run.judged_updates as f64)),
        mean("fewest", "", 1, |run| run.fewest.map(|fewest| fewest as f64)),
        mean("when_off", "", 1, |run| run.when_off.map(|updates| updates as f64)),
    ];
    columns.extend(interval(["ratio", "ratio_low", "ratio_high"], "", 2, ratio));
    columns.push(column("target", "", 0, |group| ratio(group).map(|ratio| {
        if ratio.mean <= TARGET { "met" } else { "not met" }
    })));
    Table::of("Updates over the fewest of an oracle with hindsight: mean over the seeds", groups, &columns)
}
