//! How far from the best possible: the updates of a scheme over the fewest that an oracle could have done with.
//!
//! The oracle ([`crate::oracle`]) has the run's own pushes, is allowed the force error that the scheme itself reached, and
//! chooses with hindsight from the truth.

mod figure;
mod trace;

use std::time::Duration;

use mmt_server::trigger::Scheme;

use crate::experiment::grid::Run;
use crate::experiment::prelude::*;
use trace::Bounded;

/// The bound, with as many seeds as fig. 5.
pub(super) const EXPERIMENT: Experiment = Experiment::new(
    "bound",
    "How far from the best possible: updates over the fewest of an oracle with hindsight",
    10,
    run,
);

/// Deadbands, as shares.
const DEADBANDS: [f64; 3] = [0.05, 0.10, 0.20];
/// Demanded: updates over the fewest.
const TARGET: f64 = 2.0;

/// A scheme that is held to the bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rule {
    Useful,
    Adaptive,
}

impl Rule {
    const ALL: [Self; 2] = [Self::Useful, Self::Adaptive];

    const fn name(self) -> &'static str {
        match self {
            Self::Useful => "useful",
            Self::Adaptive => "adaptive",
        }
    }

    /// Each with its default time.
    fn at(self, delta: f64) -> Scheme {
        match self {
            Self::Useful => Curve::Useful(150).at(delta),
            Self::Adaptive => Scheme::Adaptive {
                delta,
                horizon: Duration::from_millis(50),
            },
        }
    }
}

/// A point of the experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Case {
    rule: Rule,
    deadband: f64,
}

impl Case {
    fn all() -> Vec<Self> {
        let of = |rule| DEADBANDS.map(|deadband| Self { rule, deadband });
        Rule::ALL.into_iter().flat_map(of).collect()
    }

    fn world(self) -> WorldConfig {
        paper_world(Mode::Recommended, self.rule.at(self.deadband))
    }
}

type Group = grid::Group<Case, Bounded>;

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
    ];
    columns.extend(interval(["ratio", "ratio_low", "ratio_high"], "", 2, ratio));
    columns.push(column("target", "", 0, |group| ratio(group).map(|ratio| {
        if ratio.mean <= TARGET { "met" } else { "not met" }
    })));
    Table::of("Updates over the fewest of an oracle with hindsight: mean over the seeds", groups, &columns)
}

/// Geometric mean of updates over the fewest.
fn ratio(group: &Group) -> Option<Interval> {
    Interval::of_ratios(group.values(Bounded::ratio))
}
