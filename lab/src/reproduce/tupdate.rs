//! The best T_update, which the paper leaves open: fixed periods and an adaptive rule, over trajectories and grounds.
//!
//! Recommended mode, Delta 10 %, the timer in contact only, so that the period alone decides. At equal packet rate the
//! adaptive rule is held against the lower envelope of all fixed periods of both fixed schemes.

use std::time::Duration;

use mmt_server::environment::Ripple;
use mmt_server::trigger::Scheme;
use mmt_shared::model::settings::Mode;

use super::claims::log_ratio;
use super::scenarios::strips;
use super::{Curve, Extent, Findings, Laboratory, ReproduceError, digest, nothing, paper_world};
use crate::figure::{Axis, Colour, Dot, Figure, Legend, Mark, Panel, Series, Stroke};
use crate::statistics::Interval;
use crate::table::{Cell, Table};
use crate::trial::{Measured, Trial};
use crate::world::WorldConfig;

/// T_update, ms.
const PERIODS_MS: [u64; 10] = [10, 20, 50, 100, 150, 200, 300, 500, 1000, 2000];
/// Horizons of the adaptive rule, ms.
const HORIZONS_MS: [u64; 8] = [1, 2, 5, 10, 20, 50, 100, 200];
const DELTA: f64 = 0.10;

/// A name and what it makes of the world.
type Named = (&'static str, fn(&mut WorldConfig));

/// A way to push.
const TRAJECTORIES: [Named; 3] = [
    ("slow", |world| {
        world.operator.push_speed_m_per_s = (0.06, 0.10)
    }),
    ("default", |_| {}),
    ("lively", |world| {
        world.operator.push_speed_m_per_s = (0.15, 0.25);
        world.operator.slow_share = 0.45;
        world.operator.fast_share = 0.25;
    }),
];

/// A friction map.
const GROUNDS: [Named; 3] = [
    ("plain", |_| {}),
    ("ripple", |world| {
        world.slave.environment.ripple = Some(Ripple::default())
    }),
    ("patches", |world| {
        world.slave.environment.patches = strips()
    }),
];

/// A family of schemes with one time as its parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Family {
    Hybrid,
    Useful,
    Adaptive,
}

impl Family {
    const ALL: [Self; 3] = [Self::Hybrid, Self::Useful, Self::Adaptive];

    fn name(self) -> &'static str {
        match self {
            Self::Hybrid => "hybrid",
            Self::Useful => "useful",
            Self::Adaptive => "adaptive",
        }
    }

    fn times_ms(self) -> &'static [u64] {
        match self {
            Self::Hybrid | Self::Useful => &PERIODS_MS,
            Self::Adaptive => &HORIZONS_MS,
        }
    }

    fn at(self, ms: u64) -> Scheme {
        match self {
            Self::Hybrid => Curve::Hybrid(ms).at(DELTA),
            Self::Useful => Curve::Useful(ms).at(DELTA),
            Self::Adaptive => Scheme::Adaptive {
                delta: DELTA,
                horizon: Duration::from_millis(ms),
            },
        }
    }
}

/// One place of the sweep.
struct Case {
    trajectory: &'static str,
    ground: &'static str,
    family: Family,
    ms: u64,
    world: WorldConfig,
}

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (trajectory, push) in TRAJECTORIES {
        for (ground, lay) in GROUNDS {
            for family in Family::ALL {
                cases.extend(family.times_ms().iter().map(|ms| {
                    let mut world = paper_world(Mode::Recommended, family.at(*ms));
                    world.slave.trigger.timer_in_free_space = false;
                    push(&mut world);
                    lay(&mut world);
                    Case {
                        trajectory,
                        ground,
                        family,
                        ms: *ms,
                        world,
                    }
                }));
            }
        }
    }
    cases
}

/// What the seeds of a case came to.
struct Knot<'a> {
    case: &'a Case,
    rate: Option<Interval>,
    pmse: Option<Interval>,
    relative_error: Option<Interval>,
}

/// Runs the sweep and keeps `tupdate.csv`, `tupdate-adaptive.csv` and `tupdate.svg`.
///
/// # Errors
/// As [`Laboratory::run`] and [`Laboratory::keep`].
pub fn reproduce(laboratory: &dyn Laboratory, extent: Extent) -> Result<Findings, ReproduceError> {
    let cases = cases();
    let trials: Vec<Trial> = cases
        .iter()
        .flat_map(|case| {
            (1..=extent.seeds)
                .map(|seed| Trial::new(case.world.clone().seeded(seed), extent.duration))
        })
        .collect();
    let measured = laboratory.run("tupdate", &trials, &nothing)?;
    let runs = measured.chunks(extent.seeds.max(1) as usize);
    let knots: Vec<Knot> = cases
        .iter()
        .zip(runs)
        .map(|(case, runs)| knot(case, runs))
        .collect();
    let (all, verdict) = (table(&knots), verdicts(&knots));
    laboratory.keep("tupdate.csv", &all.to_csv())?;
    laboratory.keep("tupdate-adaptive.csv", &verdict.to_csv())?;
    laboratory.keep_figure("tupdate.svg", &figure(&knots))?;
    Ok(Findings {
        experiment: "tupdate",
        extent,
        digest: digest(&measured),
        configuration: vec![paper_world(Mode::Recommended, Curve::Useful(150).at(DELTA))],
        tables: vec![verdict],
    })
}

fn knot<'a>(case: &'a Case, runs: &[Measured]) -> Knot<'a> {
    let over = |of: &dyn Fn(&Measured) -> Option<f64>| Interval::of(runs.iter().filter_map(of));
    Knot {
        case,
        rate: over(&|run| run.updates.rate_hz()),
        pmse: over(&|run| run.force.pmse),
        relative_error: over(&|run| run.force.relative_error),
    }
}

fn table(knots: &[Knot]) -> Table {
    let mut table = Table::new(
        "Rate and PMSE over T_update",
        &[
            ("trajectory", 0),
            ("ground", 0),
            ("scheme", 0),
            ("time_ms", 0),
            ("packet_rate_hz", 2),
            ("pmse", 4),
            ("pmse_low", 4),
            ("pmse_high", 4),
            ("relative_error", 3),
        ],
    );
    for knot in knots {
        table.push([
            Cell::from(knot.case.trajectory),
            knot.case.ground.into(),
            knot.case.family.name().into(),
            knot.case.ms.into(),
            knot.rate.map(|i| i.mean).into(),
            knot.pmse.map(|i| i.mean).into(),
            knot.pmse.map(|i| i.low).into(),
            knot.pmse.map(|i| i.high).into(),
            knot.relative_error.map(|i| i.mean).into(),
        ]);
    }
    table
}

/// Trajectory and ground of every panel.
fn places() -> impl Iterator<Item = (&'static str, &'static str)> {
    TRAJECTORIES
        .into_iter()
        .flat_map(|(trajectory, _)| GROUNDS.map(|(ground, _)| (trajectory, ground)))
}

fn of<'a>(
    knots: &'a [Knot<'a>],
    place: (&'static str, &'static str),
    family: Family,
) -> impl Iterator<Item = (&'a Case, f64, Interval)> {
    let there = move |knot: &&Knot| {
        (knot.case.trajectory, knot.case.ground) == place && knot.case.family == family
    };
    let whole = |knot: &'a Knot<'a>| Some((knot.case, knot.rate?.mean, knot.pmse?));
    knots.iter().filter(there).filter_map(whole)
}

/// The best fixed period at a PMSE within 5 % of the least, and the adaptive rule against the fixed front.
fn verdicts(knots: &[Knot]) -> Table {
    let mut table = Table::new(
        "The best fixed T_update (least rate within 5 % of the least PMSE), and the adaptive rule at equal rate",
        &[
            ("trajectory", 0),
            ("ground", 0),
            ("best_hybrid_ms", 0),
            ("hybrid_rate_hz", 1),
            ("hybrid_pmse", 4),
            ("best_useful_ms", 0),
            ("useful_rate_hz", 1),
            ("useful_pmse", 4),
            ("adaptive_over_hybrid", 3),
            ("adaptive_over_useful", 3),
        ],
    );
    for place in places() {
        let best = |family: Family| {
            let least = of(knots, place, family)
                .map(|(_, _, pmse)| pmse.mean)
                .fold(f64::INFINITY, f64::min);
            of(knots, place, family)
                .filter(|(_, _, pmse)| pmse.mean <= 1.05 * least)
                .min_by(|a, b| a.1.total_cmp(&b.1))
        };
        let front = |family: Family| {
            let mut front: Vec<(f64, f64)> = of(knots, place, family)
                .map(|(_, rate, pmse)| (libm::log(rate), libm::log(pmse.mean)))
                .collect();
            front.sort_by(|a, b| a.0.total_cmp(&b.0));
            front
        };
        let adaptive = front(Family::Adaptive);
        let ratio = |family: Family| log_ratio(&adaptive, &front(family)).map(libm::exp);
        let (hybrid, useful) = (best(Family::Hybrid), best(Family::Useful));
        table.push([
            Cell::from(place.0),
            place.1.into(),
            hybrid.map(|(case, _, _)| case.ms).into(),
            hybrid.map(|(_, rate, _)| rate).into(),
            hybrid.map(|(_, _, pmse)| pmse.mean).into(),
            useful.map(|(case, _, _)| case.ms).into(),
            useful.map(|(_, rate, _)| rate).into(),
            useful.map(|(_, _, pmse)| pmse.mean).into(),
            ratio(Family::Hybrid).into(),
            ratio(Family::Useful).into(),
        ]);
    }
    table
}

fn figure(knots: &[Knot]) -> Figure {
    let panels = places().map(|place| {
        let styles = [
            (
                Family::Hybrid,
                Colour::Vermilion,
                Mark::Square,
                Stroke::Solid,
            ),
            (Family::Useful, Colour::Green, Mark::Triangle, Stroke::Solid),
            (
                Family::Adaptive,
                Colour::Black,
                Mark::Circle,
                Stroke::Dashed,
            ),
        ];
        let series = styles.map(|(family, colour, mark, stroke)| {
            let dots = of(knots, place, family).map(|(case, rate, pmse)| Dot {
                x: rate,
                y: pmse.mean,
                x_interval: None,
                y_interval: Some((pmse.low, pmse.high)),
                note: [10, 150, 2000]
                    .contains(&case.ms)
                    .then(|| format!("{} ms", case.ms))
                    .filter(|_| family == Family::Hybrid),
            });
            Series::line(family.name(), colour, dots.collect())
                .marked(mark)
                .stroked(stroke, 2)
        });
        let title = format!("{} pushes, {} ground", place.0, place.1);
        let (x, y) = (Axis::log("packet rate, 1/s"), Axis::log("PMSE"));
        Panel::new(title, x, y, series)
    });
    Figure::of_alike(panels, Legend::UpperRight, GROUNDS.len(), (420, 340))
}
