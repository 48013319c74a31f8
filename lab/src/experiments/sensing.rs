//! What an ordinary force sensor costs: noise, bias, drift, lag and gain, with and without the conditioning of the force.
//!
//! Judged by the true force: 0.1 N of noise lies above F_min, so that a noisy sensor is no judge of itself.

use mmt_server::conditioning::ConditioningConfig;
use mmt_server::sensing::SensingConfig;

use crate::experiment::prelude::*;

/// The force sensors.
pub(super) const EXPERIMENT: Experiment = Experiment::new(
    "sensing",
    "What noise, bias, drift, lag and gain of the force sensor cost, with and without conditioning, and with the gain found",
    10,
    run,
);

/// A force sensor: its name and what makes it other than the default.
type Sensor = (&'static str, fn(&mut SensingConfig));

/// The default sensor, its errors one by one, and together.
static SENSORS: [Sensor; 11] = [
    ("10 mN of noise", |_| {}),
    ("noise 0.05 N", |sensor| sensor.force_noise_n = 0.05),
    ("noise 0.1 N", |sensor| sensor.force_noise_n = 0.1),
    ("bias 0.2 N", |sensor| sensor.force_bias_n = 0.2),
    ("drift 0.01 N/s", |sensor| sensor.force_drift_n_per_s = 0.01),
    ("lag 5 ms", |sensor| sensor.force_lag_ms = 5.0),
    ("gain 1.1", |sensor| sensor.force_gain = 1.1),
    ("gain 0.9", |sensor| sensor.force_gain = 0.9),
    ("noise, bias, drift, lag", ordinary),
    ("all, gain 1.1", |sensor| {
        ordinary(sensor);
        sensor.force_gain = 1.1;
    }),
    ("all, gain 0.9", |sensor| {
        ordinary(sensor);
        sensor.force_gain = 0.9;
    }),
];

fn ordinary(sensor: &mut SensingConfig) {
    sensor.force_noise_n = 0.1;
    sensor.force_bias_n = 0.2;
    sensor.force_drift_n_per_s = 0.01;
    sensor.force_lag_ms = 5.0;
}

/// Who uses the force, and whether it is conditioned.
const USERS: [(Mode, Curve, Cure); 4] = [
    (Mode::Recommended, Curve::Useful(150), Cure::Conditioned),
    (Mode::Recommended, Curve::Useful(150), Cure::WithGain),
    (Mode::Recommended, Curve::Useful(150), Cure::None),
    (Mode::Paper, Curve::Hybrid(150), Cure::None),
];
const DELTA: f64 = 0.10;

/// What is made of the measured force.
#[derive(Clone, Copy, PartialEq)]
enum Cure {
    /// Nothing.
    None,
    /// Noise and bias are cured.
    Conditioned,
    /// The gain as well: the stiffness of the contact is known.
    WithGain,
}

struct Case {
    sensor: &'static Sensor,
    mode: Mode,
    curve: Curve,
    cure: Cure,
}

type Group = grid::Group<Case, Measured>;

fn cases() -> Vec<Case> {
    let of_user = |(mode, curve, cure)| {
        SENSORS.iter().map(move |sensor| Case {
            sensor,
            mode,
            curve,
            cure,
        })
    };
    USERS.into_iter().flat_map(of_user).collect()
}

fn world(case: &Case) -> WorldConfig {
    let mut world = paper_world(case.mode, case.curve.at(DELTA));
    let (_, change) = case.sensor;
    change(&mut world.slave.sensing);
    world.slave.conditioning = ConditioningConfig {
        tare: case.cure != Cure::None,
        follow_noise: case.cure != Cure::None,
        find_gain: case.cure == Cure::WithGain,
        lag_ms: 0.0,
    };
    world
}

/// Keeps `sensing.csv` and `sensing.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let groups = runner.trials("sensing", extent.seeds, cases(), |case| {
        Trial::new(world(case), extent.duration)
    })?;
    let rows = rows(&groups);
    let title = format!(
        "Force sensors, {} seeds, against the true force (ratios: over the default sensor's)",
        extent.seeds
    );
    let table = Table::of(title, &rows, &columns());
    runner.keep_table("sensing.csv", &table)?;
    runner.keep_figure("sensing.svg", &figure(&rows))?;
    Ok(Findings {
        digest: digest(&groups),
        configuration: cases().iter().map(world).collect(),
        tables: vec![table],
    })
}

/// A sensor beside the default one of the same user.
struct Row<'a> {
    group: &'a Group,
    usual: &'a Group,
}

impl Row<'_> {
    fn packets(&self) -> Option<Interval> {
        self.group.ratio(self.usual, |run| run.updates.rate_hz())
    }

    fn pmse(&self) -> Option<Interval> {
        let of = |run: &Measured| run.true_force.pmse_true.get();
        self.group.ratio(self.usual, of)
    }

    fn user(&self) -> String {
        let Case { mode, cure, .. } = self.group.case;
        let with = match cure {
            Cure::None => "without conditioning",
            Cure::Conditioned => "with conditioning",
            Cure::WithGain => "the gain found as well",
        };
        format!("{}, {with}", mode_name(mode))
    }
}

fn rows(groups: &[Group]) -> Vec<Row<'_>> {
    let of_user = groups.chunks(SENSORS.len());
    let rows = of_user.flat_map(|groups| {
        let usual = groups.first();
        groups.iter().filter_map(move |group| {
            Some(Row {
                group,
                usual: usual?,
            })
        })
    });
    rows.collect()
}

fn yes(is: bool) -> &'static str {
    if is { "yes" } else { "no" }
}

#[rustfmt::skip]
fn columns<'a>() -> Vec<Column<'a, Row<'a>>> {
    let mut columns: Vec<Column<Row>> = vec![
        column("mode", "", 0, |row| mode_name(row.group.case.mode)),
        column("conditioned", "", 0, |row| yes(row.group.case.cure != Cure::None)),
        column("find_gain", "", 0, |row| yes(row.group.case.cure == Cure::WithGain)),
        column("sensor", "", 0, |row| row.group.case.sensor.0),
        column("packet_rate_hz", "Hz", 2, |row| row.group.mean(|run| run.updates.rate_hz())),
        column("pmse_true", "", 4, |row| row.group.mean(|run| run.true_force.pmse_true.get())),
        column("relative_error_true", "", 3, |row| row.group.mean(|run| run.true_force.relative_error_true.get())),
    ];
    columns.extend(interval(["packets_ratio", "packets_low", "packets_high"], "", 2, Row::packets));
    columns.extend(interval(["pmse_ratio", "pmse_low", "pmse_high"], "", 2, Row::pmse));
    columns.push(column("position_rms_mm", "mm", 1, |row| row.group.mean(|run| Some(run.position_rms_m? * 1e3))));
    columns.push(column("breaks_per_push", "", 2, |row| row.group.mean(|run| run.breaks_per_push)));
    columns
}

/// PMSE and packets of every sensor over those of the default one, which stands at 1.
fn figure<'a>(rows: &[Row<'a>]) -> Figure {
    let names = SENSORS.iter().rev().map(|(name, _)| (*name).to_owned());
    let names: Vec<String> = names.collect();
    // the legend stands above them
    let above = names.len() as f64 + 2.2;
    let panel = |title: &str, of: fn(&Row<'a>) -> Option<Interval>| {
        Panel::new(
            title,
            Axis::log("ratio"),
            Axis::named(names.clone()).over(-0.6..above),
            series(rows, of),
        )
    };
    let panels = [
        panel(
            "PMSE against the true force, over the default sensor's",
            Row::pmse,
        ),
        panel("Updates, over the default sensor's", Row::packets),
    ];
    Figure::of_alike(panels, Legend::UpperRight, 2, (640, 560))
}

/// A series for each user, with a dot for each sensor: those of one sensor lie one below another.
fn series<'a>(rows: &[Row<'a>], of: fn(&Row<'a>) -> Option<Interval>) -> Vec<Series> {
    let styles = [
        (Colour::BLUE, Mark::Circle, 0.27),
        (Colour::GREEN, Mark::Triangle, 0.09),
        (Colour::VERMILION, Mark::Cross, -0.09),
        (Colour::GREY, Mark::Square, -0.27),
    ];
    let of_user = rows.chunks(SENSORS.len()).zip(styles);
    let series = of_user.filter_map(|(rows, (colour, mark, beside))| {
        let dots = rows.iter().rev().enumerate().filter_map(|(n, row)| {
            let ratio = of(row)?;
            Some(Dot {
                x_interval: Some((ratio.low, ratio.high)),
                ..Dot::at(ratio.mean, n as f64 + beside)
            })
        });
        let label = rows.first()?.user();
        let line = Series::line(&label, colour, dots.collect());
        Some(line.stroked(Stroke::Solid, 0).marked(mark))
    });
    series.collect()
}
