//! What becomes of the paper's claims in each reading of its text.
//!
//! The text leaves choices open, or a reader may take it otherwise. Every combination of them runs the whole of section
//! IV-B. A claim that holds in all of them does not hang on how the paper is read.

use mmt_client::operator::scripted::VisualFeedback;
use mmt_server::estimator::{EstimatorConfig, ObjectMotion, PaperConfig};

use super::claims::{Claim, Runs, Verdict, claims, points, verdicts};
use crate::experiment::prelude::*;
use crate::setting::Point;

/// A choice of the paper's experiment made otherwise: its name and what it makes of the world.
pub(super) type Variant = (&'static str, fn(&mut WorldConfig));

/// The choices that can be read out of the paper's text, each made otherwise. `docs/model.md` has the sentences.
pub(super) static READINGS: [Variant; 5] = [
    ("estimates from the first instant of contact", |world| {
        paper_estimator(world, |paper| paper.stable_after_s = 0.0);
    }),
    ("motion of the tool", |world| {
        paper_estimator(world, |paper| paper.motion = ObjectMotion::Tool);
    }),
    ("timer packets carry no pose", |world| {
        world.slave.trigger.timer_carries_pose = false;
    }),
    ("rest of 0.4 s after a push", |world| {
        world.operator.hold_s = 0.4;
    }),
    ("operator sees the local model", |world| {
        world.operator.view = VisualFeedback::Model;
    }),
];

/// Changes the paper's estimator in a world of paper mode.
pub(super) fn paper_estimator(world: &mut WorldConfig, change: impl FnOnce(&mut PaperConfig)) {
    let mut paper = match world.slave.estimator {
        Some(EstimatorConfig::Paper(paper)) => paper,
        _ => PaperConfig::default(),
    };
    change(&mut paper);
    world.slave.estimator = Some(EstimatorConfig::Paper(paper));
}

/// The readings: 75 minutes of one core, and so no part of `all`.
pub(super) const EXPERIMENT: Experiment = Experiment {
    in_all: false,
    ..Experiment::new(
        "readings",
        "The claims in every reading of the paper's text (75 minutes of one core; not in `all`)",
        40,
        run,
    )
};

/// One reading: which of [`READINGS`] are made otherwise, and what came of it.
struct Reading {
    otherwise: usize,
    claims: Vec<Claim>,
    verdicts: Vec<Option<(Option<f64>, Verdict)>>,
    digest: String,
}

impl Reading {
    fn has(otherwise: usize, choice: usize) -> bool {
        otherwise >> choice & 1 == 1
    }

    /// What is otherwise than in the text; empty for the text itself.
    fn words(&self) -> String {
        let choices = READINGS.iter().enumerate();
        let otherwise = choices.filter(|(k, _)| Self::has(self.otherwise, *k));
        let names: Vec<&str> = otherwise.map(|(_, (name, _))| *name).collect();
        names.join("; ")
    }

    fn measured(&self, id: &str) -> Option<Interval> {
        self.claims.iter().find(|claim| claim.id == id)?.measured
    }
}

/// Keeps `readings.csv`, `readings-claims.csv` and `readings.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let mut readings = Vec::new();
    for otherwise in 0..1 << READINGS.len() {
        let groups = runner.trials("readings", extent.seeds, points(), |point: &Point| {
            let mut trial = point.trial(extent.duration);
            let choices = READINGS.iter().enumerate();
            for (_, (_, change)) in choices.filter(|(k, _)| Reading::has(otherwise, *k)) {
                change(&mut trial.config);
            }
            trial
        })?;
        let claims = claims(&Runs {
            groups: &groups,
            seeds: extent.seeds,
        });
        readings.push(Reading {
            otherwise,
            verdicts: verdicts(&claims),
            claims,
            digest: digest(&groups),
        });
    }
    let all = Table::of("Each claim in each reading", &rows(&readings), &columns());
    runner.keep_table("readings.csv", &all)?;
    let title = format!(
        "Claims of section IV-B in {} readings of the text, {} seeds",
        readings.len(),
        extent.seeds
    );
    let summary = Table::of(title, &tallies(&readings), &tally_columns());
    runner.keep_table("readings-claims.csv", &summary)?;
    runner.keep_figure("readings.svg", &figure(&readings))?;
    Ok(Findings {
        digest: crate::digest::of_runs(readings.iter().map(|reading| reading.digest.as_str())),
        configuration: vec![paper_world(Mode::Paper, Curve::Hybrid(150).at(0.10))],
        tables: vec![summary],
    })
}

/// A claim in a reading.
type Row<'a> = (&'a Reading, &'a Claim, Option<Verdict>);

fn rows(readings: &[Reading]) -> Vec<Row<'_>> {
    let mut rows = Vec::new();
    for reading in readings {
        let claims = reading.claims.iter().zip(&reading.verdicts);
        rows.extend(
            claims.map(|(claim, judged)| (reading, claim, judged.map(|(_, verdict)| verdict))),
        );
    }
    rows
}

#[rustfmt::skip]
fn columns<'a>() -> Vec<Column<'a, Row<'a>>> {
    let mut columns: Vec<Column<Row>> = vec![
        column("otherwise", "", 0, |(reading, ..)| reading.words()),
        column("claim", "", 0, |(_, claim, _)| claim.id.clone()),
    ];
    columns.extend(interval(["value", "low", "high"], "", 4, |(_, claim, _): &Row| claim.measured));
    columns.push(column("verdict", "", 0, |(.., verdict): &Row| verdict.map_or("", Verdict::word)));
    columns
}

/// A claim, in how many readings it has each verdict, and its value over all of them.
struct Tally {
    claim: String,
    verdicts: [u64; Verdict::ALL.len()],
    values: Vec<f64>,
}

fn tallies(readings: &[Reading]) -> Vec<Tally> {
    let first = readings.first();
    let tested = first.into_iter().flat_map(|reading| {
        let tested = reading.verdicts.iter().enumerate();
        tested
            .filter(|(_, verdict)| verdict.is_some())
            .map(|(k, _)| k)
    });
    let tally = |k: usize| {
        let verdicts = || {
            readings
                .iter()
                .filter_map(|reading| Some((*reading.verdicts.get(k)?)?.1))
        };
        let claims = || readings.iter().filter_map(|reading| reading.claims.get(k));
        Tally {
            claim: claims()
                .next()
                .map(|claim| claim.id.clone())
                .unwrap_or_default(),
            verdicts: Verdict::ALL
                .map(|wanted| verdicts().map(|verdict| u64::from(verdict == wanted)).sum()),
            values: claims()
                .filter_map(|claim| Some(claim.measured?.mean))
                .collect(),
        }
    };
    tested.map(tally).collect()
}

#[rustfmt::skip]
fn tally_columns<'a>() -> Vec<Column<'a, Tally>> {
    vec![
        column("claim", "", 0, |tally| tally.claim.clone()),
        column("holds", "", 0, |tally| tally.verdicts[0]),
        column("tie", "", 0, |tally| tally.verdicts[1]),
        column("undecided", "", 0, |tally| tally.verdicts[2]),
        column("fails", "", 0, |tally| tally.verdicts[3]),
        column("least", "", 3, |tally| tally.values.iter().copied().reduce(f64::min)),
        column("most", "", 3, |tally| tally.values.iter().copied().reduce(f64::max)),
    ]
}

/// Each reading as a dot: the ranking of the schemes over the knee.
fn figure(readings: &[Reading]) -> Figure {
    let dots = |without_pose: bool| {
        let of = readings
            .iter()
            .filter(move |reading| Reading::has(reading.otherwise, 2) == without_pose);
        let dots = of.filter_map(|reading| {
            let knee = reading.measured("knee, hybrid 150 ms")?;
            let ratio = reading.measured("at equal deadband, hybrid 150 ms against deadband")?;
            Some(Dot {
                x_interval: Some((knee.low, knee.high)),
                y_interval: Some((ratio.low, ratio.high)),
                ..Dot::at(knee.mean, ratio.mean)
            })
        });
        dots.collect::<Vec<Dot>>()
    };
    let series = [
        Series::line("timer packets carry the pose", Colour::BLUE, dots(false))
            .marked(Mark::Circle)
            .stroked(Stroke::Solid, 0),
        Series::line("timer packets carry no pose", Colour::VERMILION, dots(true))
            .marked(Mark::Square)
            .stroked(Stroke::Solid, 0),
    ];
    let panel = Panel::new(
        "hybrid 150 ms in every reading of the text",
        Axis::linear("knee: exponent of PMSE over Delta, 30 to 10 % less 10 to 2.5 %"),
        Axis::linear("PMSE over that of the deadband scheme"),
        series,
    );
    Figure::of_alike([panel], Legend::LowerRight, 1, (560, 420))
}
