//! Baselines at their best: each architecture tuned per delay with an equal budget, and judged on seeds that tuned nothing.

mod figure;
mod judged;
mod tables;

use super::choices::Choice;
use super::grid_point::GridPoint;
use super::tuning::{Tried, best};
use crate::architecture::{ComparedArchitecture, run_tuned};
use crate::experiment::prelude::*;
use crate::trial::TrialError;
pub(super) use judged::Judged;

/// Every architecture at its best.
pub(in crate::experiments) const TUNED: Experiment = Experiment {
    duration: Duration::from_secs(40),
    ..Experiment::new(
        "tuned",
        "Every architecture of `delay`, tuned per delay and judged on other seeds",
        10,
        run,
    )
};

/// One-way delays, ms.
const DELAYS_MS: [u64; 9] = [0, 5, 10, 20, 50, 100, 250, 500, 1000];
/// Most seeds that a value is tried with.
const TUNING_SEEDS: u64 = 3;
/// The first seed that tunes, and the first that judges, whatever the runner's.
const TUNING: u64 = 10_001;
const JUDGING: u64 = 20_001;

/// Keeps `tuned.csv`, `tuned-choices.csv` and `tuned.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let measure = |what, seeds, first: u64, choices| {
        runner.grid_from(first, what, seeds, choices, |choice: &Choice, seed| {
            let (tuning, world) = choice.setting()?;
            let (world, of) = (world.seeded(seed), choice.point.architecture);
            let row = run_tuned(of, &tuning, &world, extent.duration);
            row.map_err(|error| TrialError::from(error).into())
        })
    };
    let points = points();
    let choices = points.iter().copied().flat_map(Choice::at).collect();
    let seeds = extent.seeds.min(TUNING_SEEDS);
    let tried: Vec<Tried> = measure("tuned: tuning", seeds, TUNING, choices)?;

    let mut pairs = Vec::new();
    let mut judged = Vec::new();
    for point in points {
        let tuned = best(&tried, point);
        let mut untuned = None;
        for choice in Choice::at(point) {
            let is_default = choice.is_default()?;
            if is_default || tuned == Some(choice) {
                judged.push(choice);
            }
            if is_default {
                untuned = Some(choice);
            }
        }
        pairs.extend(untuned.zip(tuned));
    }
    let judged: Vec<Tried> = measure("tuned: judging", extent.seeds, JUDGING, judged)?;
    let of = |choice| judged.iter().find(|group| group.case == choice);
    let pairs: Vec<Judged> = pairs
        .into_iter()
        .filter_map(|(untuned, tuned)| {
            Some(Judged {
                untuned: of(untuned)?,
                tuned: of(tuned)?,
            })
        })
        .collect();

    runner.keep_table("tuned-choices.csv", &tables::choices(&tried, &pairs))?;
    runner.keep_table("tuned.csv", &tables::runs(&judged, &pairs, JUDGING))?;
    runner.keep_figure("tuned.svg", &figure::figure(&pairs))?;
    Ok(Findings {
        digest: String::new(),
        configuration: vec![WorldConfig::default()],
        tables: vec![
            tables::at_their_best(&pairs),
            tables::nearest(&pairs, &DELAYS_MS),
        ],
    })
}

/// Every architecture at every delay.
fn points() -> Vec<GridPoint> {
    let at = |of| DELAYS_MS.map(|ms| GridPoint::plain(of, ms));
    ComparedArchitecture::ALL.into_iter().flat_map(at).collect()
}
