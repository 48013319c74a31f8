//! Fig. 5: packet rate and PMSE of the update schemes at seven deadbands, in both modes.
//!
//! One row per run; the figure shows means over the seeds with 95 % intervals.

use std::fmt::Write as _;

use mmt_shared::model::settings::Mode;

use super::{
    Curve, DEADBANDS, Each, Extent, FIG5_CURVES, Findings, Laboratory, ReproduceError, digest,
    mode_name, nothing, paper_world,
};
use crate::figure::{Axis, Colour, Dot, Figure, Legend, Mark, Panel, Series, Stroke};
use crate::statistics::Interval;
use crate::table::{Cell, Table};
use crate::trial::{Measured, TraceRow, Trial};

/// Deadbands that are written beside their points.
const NOTED: [f64; 4] = [0.025, 0.05, 0.10, 0.30];

/// What a run varies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The mode.
    pub mode: Mode,
    /// The scheme.
    pub curve: Curve,
    /// Delta, as a share.
    pub deadband: f64,
    /// The seed.
    pub seed: u64,
}

impl Point {
    /// The trial at this point.
    #[must_use]
    pub fn trial(&self, extent: Extent) -> Trial {
        let config = paper_world(self.mode, self.curve.at(self.deadband)).seeded(self.seed);
        Trial::new(config, extent.duration)
    }

    fn scheme_name(&self) -> &'static str {
        self.curve.at(self.deadband).name()
    }

    /// `<mode>-<scheme>-<t_update_ms>-<deadband>-<seed>`.
    fn name(&self) -> String {
        let (mode, scheme) = (mode_name(self.mode), self.scheme_name());
        let t_update_ms = self.curve.t_update_ms();
        format!(
            "{mode}-{scheme}-{t_update_ms}-{}-{}",
            self.deadband, self.seed
        )
    }
}

/// Every point of some curves: curve by curve, deadband by deadband, seed by seed.
#[must_use]
pub fn points(curves: &[(Mode, Curve)], seeds: u64) -> Vec<Point> {
    let mut points = Vec::new();
    for (mode, curve) in curves {
        for deadband in DEADBANDS {
            points.extend((1..=seeds).map(|seed| Point {
                mode: *mode,
                curve: *curve,
                deadband,
                seed,
            }));
        }
    }
    points
}

/// Runs fig. 5 and keeps `fig5.csv` and `fig5.svg`; with `samples`, every run's forces as well.
///
/// # Errors
/// As [`Laboratory::run`] and [`Laboratory::keep`].
pub fn reproduce(
    laboratory: &dyn Laboratory,
    extent: Extent,
    samples: bool,
) -> Result<Findings, ReproduceError> {
    let points = points(&FIG5_CURVES, extent.seeds);
    let trials: Vec<Trial> = points
        .iter()
        .map(|point| Trial {
            traced: samples,
            ..point.trial(extent)
        })
        .collect();
    let keep_samples = |index: usize, measured: &mut Measured| {
        let Some(point) = points.get(index) else {
            return Ok(());
        };
        let trace = std::mem::take(&mut measured.trace);
        laboratory.keep(
            &format!("samples/{}.csv", point.name()),
            samples_csv(&trace).as_bytes(),
        )
    };
    let each: Each = if samples { &keep_samples } else { &nothing };
    let measured = laboratory.run("fig5", &trials, each)?;
    let runs = runs(&points, &measured);
    laboratory.keep("fig5.csv", &runs.to_csv())?;
    let curves = curves(&points, &measured);
    laboratory.keep_figure("fig5.svg", &figure(&curves))?;
    Ok(Findings {
        experiment: "fig5",
        extent,
        digest: digest(&measured),
        configuration: vec![
            paper_world(Mode::Paper, Curve::Hybrid(150).at(0.10)),
            paper_world(Mode::Recommended, Curve::Useful(150).at(0.10)),
        ],
        tables: vec![summary(&curves)],
    })
}

/// f_s and f_m of every sample and whether an update was sent; a lost sample's f_m is empty.
fn samples_csv(trace: &[TraceRow]) -> String {
    let mut csv = String::from("t_s,fs_x_n,fs_y_n,fm_x_n,fm_y_n,update\n");
    for row in trace {
        // writing to a string cannot fail
        let _ = write!(csv, "{},{},{},", row.t_s, row.f_s.x, row.f_s.y);
        let _ = match row.f_m {
            Some(f_m) => write!(csv, "{},{},", f_m.x, f_m.y),
            None => write!(csv, ",,"),
        };
        let _ = writeln!(csv, "{}", u8::from(row.update.is_some()));
    }
    csv
}

fn runs(points: &[Point], measured: &[Measured]) -> Table {
    let mut table = Table::new(
        "Runs of fig. 5",
        &[
            ("mode", 0),
            ("scheme", 0),
            ("t_update_ms", 0),
            ("deadband", 3),
            ("seed", 0),
            ("duration_s", 1),
            ("packet_rate_hz", 1),
            ("contact_packet_rate_hz", 1),
            ("pmse", 4),
            ("pmse_x", 4),
            ("pmse_y", 4),
            ("pmse_magnitude", 4),
            ("relative_error", 4),
            ("jnd7_share", 3),
            ("packets", 0),
            ("contact_s", 1),
        ],
    );
    for (point, measured) in points.iter().zip(measured) {
        let force = &measured.force;
        table.push([
            mode_name(point.mode).into(),
            point.scheme_name().into(),
            point.curve.t_update_ms().into(),
            point.deadband.into(),
            point.seed.into(),
            measured.duration_s.into(),
            measured.updates.rate_hz().into(),
            measured.updates.contact_rate_hz().into(),
            force.pmse.into(),
            force.pmse_x.into(),
            force.pmse_y.into(),
            force.pmse_magnitude.into(),
            force.relative_error.into(),
            force.jnd7_share.into(),
            measured.updates.total().into(),
            measured.contact_s.into(),
        ]);
    }
    table
}

/// The runs of one curve at one deadband, together.
#[derive(Clone, Debug, PartialEq)]
pub struct Knot {
    /// The mode.
    pub mode: Mode,
    /// The scheme.
    pub curve: Curve,
    /// Delta, as a share.
    pub deadband: f64,
    /// Packets per second of the run.
    pub rate_hz: Option<Interval>,
    /// Packets per second of contact.
    pub contact_rate_hz: Option<Interval>,
    /// PMSE (15).
    pub pmse: Option<Interval>,
    /// |f|-PMSE.
    pub pmse_magnitude: Option<Interval>,
    /// Relative vector error.
    pub relative_error: Option<Interval>,
    /// Share of contact outside the 7 % JND.
    pub jnd7_share: Option<Interval>,
}

/// Means and intervals over the seeds, in the order of the points.
#[must_use]
pub fn curves(points: &[Point], measured: &[Measured]) -> Vec<Knot> {
    let mut knots: Vec<Knot> = Vec::new();
    let runs: Vec<(&Point, &Measured)> = points.iter().zip(measured).collect();
    let same = |a: &(&Point, &Measured), b: &(&Point, &Measured)| {
        (a.0.mode, a.0.curve, a.0.deadband) == (b.0.mode, b.0.curve, b.0.deadband)
    };
    for runs in runs.chunk_by(same) {
        let Some((point, _)) = runs.first() else {
            continue;
        };
        let over = |of: &dyn Fn(&Measured) -> Option<f64>| {
            Interval::of(runs.iter().filter_map(|(_, measured)| of(measured)))
        };
        knots.push(Knot {
            mode: point.mode,
            curve: point.curve,
            deadband: point.deadband,
            rate_hz: over(&|m| m.updates.rate_hz()),
            contact_rate_hz: over(&|m| m.updates.contact_rate_hz()),
            pmse: over(&|m| m.force.pmse),
            pmse_magnitude: over(&|m| m.force.pmse_magnitude),
            relative_error: over(&|m| m.force.relative_error),
            jnd7_share: over(&|m| m.force.jnd7_share),
        });
    }
    knots
}

fn summary(knots: &[Knot]) -> Table {
    let mut table = Table::new(
        "Fig. 5: mean over the seeds, ± half of the 95 % interval",
        &[
            ("mode", 0),
            ("scheme", 0),
            ("deadband", 3),
            ("n", 0),
            ("packets_per_s", 1),
            ("pm_rate", 1),
            ("pmse", 4),
            ("pm_pmse", 4),
            ("pmse_magnitude", 4),
            ("relative_error", 4),
            ("jnd7_share", 3),
        ],
    );
    let mean = |interval: Option<Interval>| Cell::from(interval.map(|i| i.mean));
    let half = |interval: Option<Interval>| Cell::from(interval.map(|i| i.high - i.mean));
    for knot in knots {
        table.push([
            mode_name(knot.mode).into(),
            knot.curve.label().into(),
            knot.deadband.into(),
            knot.rate_hz.map(|i| i.n as u64).into(),
            mean(knot.rate_hz),
            half(knot.rate_hz),
            mean(knot.pmse),
            half(knot.pmse),
            mean(knot.pmse_magnitude),
            mean(knot.relative_error),
            mean(knot.jnd7_share),
        ]);
    }
    table
}

/// Left the paper's axes and curves, right both modes on logarithmic axes.
fn figure(knots: &[Knot]) -> Figure {
    let series = |mode: Mode, notes: bool| {
        let wanted = FIG5_CURVES.into_iter().filter(move |(of, _)| *of == mode);
        wanted.map(move |(mode, curve)| drawn(knots, mode, curve, notes))
    };
    let rate = "packet rate, 1/s";
    Figure {
        panels: vec![
            Panel {
                title: "The paper's schemes".to_owned(),
                x: Axis::linear(rate),
                y: Axis::linear("PMSE"),
                series: series(Mode::Paper, true).collect(),
                legend: Legend::UpperRight,
            },
            Panel {
                title: "Both modes".to_owned(),
                x: Axis::log(rate),
                y: Axis::log("PMSE"),
                series: series(Mode::Paper, false)
                    .chain(series(Mode::Recommended, false))
                    .collect(),
                legend: Legend::UpperLeft,
            },
        ],
        columns: 2,
        panel_size: (560, 440),
    }
}

fn drawn(knots: &[Knot], mode: Mode, curve: Curve, notes: bool) -> Series {
    let (colour, mark) = match curve {
        Curve::Deadband => (Colour::Blue, Mark::Circle),
        Curve::Hybrid(50) => (Colour::Vermilion, Mark::Square),
        Curve::Hybrid(_) => (Colour::Green, Mark::Triangle),
        Curve::Useful(_) => (Colour::Black, Mark::Cross),
    };
    let of_curve = knots
        .iter()
        .filter(|knot| (knot.mode, knot.curve) == (mode, curve));
    let dots = of_curve.filter_map(|knot| {
        let (rate, pmse) = (knot.rate_hz?, knot.pmse?);
        let noted = notes && curve == Curve::Deadband && NOTED.contains(&knot.deadband);
        Some(Dot {
            x: rate.mean,
            y: pmse.mean,
            x_interval: Some((rate.low, rate.high)),
            y_interval: Some((pmse.low, pmse.high)),
            note: noted.then(|| format!("{} %", knot.deadband * 100.0)),
        })
    });
    let stroke = match mode {
        Mode::Paper => Stroke::Solid,
        Mode::Recommended => Stroke::Dashed,
    };
    let label = if notes {
        curve.label()
    } else {
        format!("{}, {}", mode_name(mode), curve.label())
    };
    Series::line(&label, colour, dots.collect())
        .marked(mark)
        .stroked(stroke, 2)
}
