//! The best T_update, which the paper leaves open: fixed periods and an adaptive rule, over trajectories and grounds.
//!
//! Recommended mode, Delta 10 %, the timer in contact only, so that the period alone decides. At equal packet rate the
//! adaptive rule is held against the lower envelope of all fixed periods of both fixed schemes.

use mmt_server::environment::Ripple;
use mmt_server::trigger::Scheme;

use super::scenarios::strips;
use crate::experiment::prelude::*;
use crate::statistics::log_ratio;

/// The search for the best T_update, over 252 points.
pub(super) const TUPDATE: Experiment = Experiment::new(
    "tupdate",
    "The best T_update: fixed periods and an adaptive rule, over trajectories and grounds",
    5,
    run,
);

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
struct Family {
    name: &'static str,
    times_ms: &'static [u64],
    at: fn(u64) -> Scheme,
}

static FAMILIES: [Family; 3] = [
    Family {
        name: "hybrid",
        times_ms: &PERIODS_MS,
        at: |ms| Curve::Hybrid(ms).at(DELTA),
    },
    Family {
        name: "useful",
        times_ms: &PERIODS_MS,
        at: |ms| Curve::Useful(ms).at(DELTA),
    },
    Family {
        name: "adaptive",
        times_ms: &HORIZONS_MS,
        at: |ms| Scheme::Adaptive {
            delta: DELTA,
            horizon: Duration::from_millis(ms),
        },
    },
];

/// A point of the sweep.
struct Case {
    trajectory: &'static str,
    ground: &'static str,
    family: &'static str,
    ms: u64,
    world: WorldConfig,
}

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (trajectory, push) in TRAJECTORIES {
        for (ground, lay) in GROUNDS {
            for family in &FAMILIES {
                cases.extend(family.times_ms.iter().map(|ms| {
                    let mut world = paper_world(Mode::Recommended, (family.at)(*ms));
                    world.slave.trigger.timer_in_free_space = false;
                    push(&mut world);
                    lay(&mut world);
                    Case {
                        trajectory,
                        ground,
                        family: family.name,
                        ms: *ms,
                        world,
                    }
                }));
            }
        }
    }
    cases
}

type Group = grid::Group<Case, Measured>;

/// Keeps `tupdate.csv`, `tupdate-adaptive.csv` and `tupdate.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let groups = runner.trials("tupdate", extent.seeds, cases(), |case| {
        Trial::new(case.world.clone(), extent.duration)
    })?;
    let all = Table::of("Rate and PMSE over T_update", &groups, &columns());
    let fronts: Vec<Fronts> = pairs().map(|pair| Fronts::of(&groups, pair)).collect();
    let title = "The best fixed T_update (least rate within 5 % of the least PMSE), and the adaptive rule at equal rate";
    let verdict = Table::of(title, &fronts, &verdict_columns());
    runner.keep_table("tupdate.csv", &all)?;
    runner.keep_table("tupdate-adaptive.csv", &verdict)?;
    runner.keep_figure("tupdate.svg", &figure(&fronts))?;
    Ok(Findings {
        digest: digest(&groups),
        configuration: vec![paper_world(Mode::Recommended, Curve::Useful(150).at(DELTA))],
        tables: vec![verdict],
    })
}

#[rustfmt::skip]
fn columns<'a>() -> Vec<Column<'a, Group>> {
    let mut columns: Vec<Column<Group>> = vec![
        column("trajectory", "", 0, |group| group.case.trajectory),
        column("ground", "", 0, |group| group.case.ground),
        column("scheme", "", 0, |group| group.case.family),
        column("time_ms", "ms", 0, |group| group.case.ms),
        mean("packet_rate_hz", "Hz", 2, |run| run.updates.rate_hz()),
    ];
    let pmse = |group: &Group| group.interval(|run| run.force.pmse);
    columns.extend(interval(["pmse", "pmse_low", "pmse_high"], "", 4, pmse));
    columns.push(mean("relative_error", "", 3, |run| run.force.relative_error));
    columns
}

/// Trajectory and ground of every panel.
fn pairs() -> impl Iterator<Item = (&'static str, &'static str)> {
    TRAJECTORIES
        .into_iter()
        .flat_map(|(trajectory, _)| GROUNDS.map(|(ground, _)| (trajectory, ground)))
}

/// Rate and PMSE at one time of a family.
#[derive(Clone, Copy)]
struct CurvePoint {
    ms: u64,
    rate_hz: f64,
    pmse: Interval,
}

/// What each family of schemes reached with a trajectory on a ground.
struct Fronts {
    trajectory: &'static str,
    ground: &'static str,
    hybrid: Vec<CurvePoint>,
    useful: Vec<CurvePoint>,
    adaptive: Vec<CurvePoint>,
}

impl Fronts {
    fn of(groups: &[Group], (trajectory, ground): (&'static str, &'static str)) -> Self {
        let [hybrid, useful, adaptive] = FAMILIES.each_ref().map(|family| {
            let there = groups.iter().filter(|Group { case, .. }| {
                (case.trajectory, case.ground, case.family) == (trajectory, ground, family.name)
            });
            let points = there.map(|group| {
                Some(CurvePoint {
                    ms: group.case.ms,
                    rate_hz: group.mean(|run| run.updates.rate_hz())?,
                    pmse: group.interval(|run| run.force.pmse)?,
                })
            });
            points.flatten().collect()
        });
        Self {
            trajectory,
            ground,
            hybrid,
            useful,
            adaptive,
        }
    }

    /// The adaptive rule's PMSE over that of another family at equal rate.
    fn adaptive_over(&self, other: &[CurvePoint]) -> Option<f64> {
        log_ratio(&log_curve(&self.adaptive), &log_curve(other)).map(libm::exp)
    }
}

/// The point with the least rate of those whose PMSE is within 5 % of the least.
fn best(points: &[CurvePoint]) -> Option<CurvePoint> {
    let least = points.iter().map(|point| point.pmse.mean);
    let least = least.fold(f64::INFINITY, f64::min);
    let good = points
        .iter()
        .filter(|point| point.pmse.mean <= 1.05 * least);
    good.min_by(|a, b| a.rate_hz.total_cmp(&b.rate_hz)).copied()
}

/// (ln rate, ln PMSE), by rising rate.
fn log_curve(points: &[CurvePoint]) -> Vec<(f64, f64)> {
    let log = |point: &CurvePoint| (libm::log(point.rate_hz), libm::log(point.pmse.mean));
    let mut curve: Vec<(f64, f64)> = points.iter().map(log).collect();
    curve.sort_by(|a, b| a.0.total_cmp(&b.0));
    curve
}

/// The best fixed period at a PMSE within 5 % of the least, and the adaptive rule against the fixed front.
#[rustfmt::skip]
fn verdict_columns<'a>() -> [Column<'a, Fronts>; 10] {
    [
        column("trajectory", "", 0, |at| at.trajectory),
        column("ground", "", 0, |at| at.ground),
        column("best_hybrid_ms", "ms", 0, |at| Some(best(&at.hybrid)?.ms)),
        column("hybrid_rate_hz", "Hz", 1, |at| Some(best(&at.hybrid)?.rate_hz)),
        column("hybrid_pmse", "", 4, |at| Some(best(&at.hybrid)?.pmse.mean)),
        column("best_useful_ms", "ms", 0, |at| Some(best(&at.useful)?.ms)),
        column("useful_rate_hz", "Hz", 1, |at| Some(best(&at.useful)?.rate_hz)),
        column("useful_pmse", "", 4, |at| Some(best(&at.useful)?.pmse.mean)),
        column("adaptive_over_hybrid", "", 3, |at| at.adaptive_over(&at.hybrid)),
        column("adaptive_over_useful", "", 3, |at| at.adaptive_over(&at.useful)),
    ]
}

fn figure(fronts: &[Fronts]) -> Figure {
    let panels = fronts.iter().map(|at| {
        let line = |name, points: &[CurvePoint], colour| {
            let noted = |ms| name == "hybrid" && [10, 150, 2000].contains(&ms);
            let dot = |point: &CurvePoint| Dot {
                y_interval: Some((point.pmse.low, point.pmse.high)),
                note: noted(point.ms).then(|| format!("{} ms", point.ms)),
                ..Dot::at(point.rate_hz, point.pmse.mean)
            };
            Series::line(name, colour, points.iter().map(dot).collect())
        };
        let series = [
            line("hybrid", &at.hybrid, Colour::VERMILION).marked(Mark::Square),
            line("useful", &at.useful, Colour::GREEN).marked(Mark::Triangle),
            line("adaptive", &at.adaptive, Colour::BLACK)
                .marked(Mark::Circle)
                .stroked(Stroke::Dashed, 2),
        ];
        let title = format!("{} pushes, {} ground", at.trajectory, at.ground);
        let (x, y) = (Axis::log("packet rate, 1/s"), Axis::log("PMSE"));
        Panel::new(title, x, y, series)
    });
    Figure::of_alike(panels, Legend::UpperRight, GROUNDS.len(), (420, 340))
}
