//! Fig. 5: packet rate and PMSE of the update schemes at seven deadbands, in both modes.
//!
//! One row per run; the figure shows means over the seeds with 95 % intervals.

use crate::experiment::grid::Run;
use crate::experiment::prelude::*;
use crate::setting::{FIG5_CURVES, Point};
use crate::trial::TraceRow;

/// Deadbands that are written beside their points.
const NOTED: [f64; 4] = [0.025, 0.05, 0.10, 0.30];

/// Fig. 5, with the paper's ten repetitions.
pub(super) const FIG5: Experiment = Experiment {
    arguments: &[Argument {
        name: "samples",
        help: "Write every run's forces and updates at 1 kHz as well, under samples/ (about 2 MB a run)",
        number: None,
    }],
    ..Experiment::new(
        "fig5",
        "Fig. 5: packet rate and PMSE of the update schemes, both modes",
        10,
        run,
    )
};

type Group = grid::Group<Point, Measured>;
/// A curve of the figure.
type Of = (Mode, Senses, Curve);

/// Keeps `fig5.csv` and `fig5.svg`; with `samples`, every run's forces as well.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let (extent, traced) = (request.extent, request.flag("samples"));
    let points = Point::of(FIG5_CURVES);
    let groups = runner.grid("fig5", extent.seeds, points, |point, seed| {
        let trial = point.trial(extent.duration).seeded(seed);
        let mut measured = runner.trial(&Trial { traced, ..trial })?;
        if traced {
            let trace = std::mem::take(&mut measured.trace);
            runner.keep_table(&samples_name(point, seed), &samples(&trace))?;
        }
        Ok(measured)
    })?;
    let runs = Table::of(
        "Runs of fig. 5",
        &grid::runs(&groups, runner.first_seed()),
        &columns(),
    );
    runner.keep_table("fig5.csv", &runs)?;
    runner.keep_figure("fig5.svg", &figure(&groups))?;
    Ok(Findings {
        digest: digest(&groups),
        configuration: paper_worlds(0.10),
        tables: vec![summary(&groups)],
    })
}

/// `samples/<mode>-<scheme>-<t_update_ms>-<deadband>-<seed>.csv`, and `<mode>-<sensing>` where the senses are not the mode's.
fn samples_name(point: &Point, seed: u64) -> String {
    let (mode, senses) = (mode_name(point.mode), point.senses.name());
    let senses = if point.senses == Senses::of_mode(point.mode) {
        String::new()
    } else {
        format!("-{senses}")
    };
    let scheme = point.curve.at(point.deadband).name();
    let (t_update_ms, deadband) = (point.curve.t_update_ms(), point.deadband);
    format!("samples/{mode}{senses}-{scheme}-{t_update_ms}-{deadband}-{seed}.csv")
}

/// f_s and f_m of every sample and whether an update was sent; a lost sample's f_m is absent.
fn samples(trace: &[TraceRow]) -> Table {
    Table::of(
        "Samples",
        trace,
        &[
            column("t_s", "s", 3, |row| row.t_s),
            column("fs_x_n", "N", 3, |row| row.f_s.x),
            column("fs_y_n", "N", 3, |row| row.f_s.y),
            column("fm_x_n", "N", 3, |row| row.f_m.map(|f_m| f_m.x)),
            column("fm_y_n", "N", 3, |row| row.f_m.map(|f_m| f_m.y)),
            column("update", "", 0, |row| u64::from(row.update.is_some())),
        ],
    )
}

/// The columns of `fig5.csv`.
#[rustfmt::skip]
pub(super) fn columns<'a>() -> Vec<Column<'a, Run<'a, Point, Measured>>> {
    vec![
        column("mode", "", 0, |run| mode_name(run.case.mode)),
        column("scheme", "", 0, |run| run.case.curve.at(run.case.deadband).name()),
        column("t_update_ms", "ms", 0, |run| run.case.curve.t_update_ms()),
        column("deadband", "", 3, |run| run.case.deadband),
        column("seed", "", 0, |run| run.seed),
        column("duration_s", "s", 1, |run| run.measured.duration_s),
        column("packet_rate_hz", "Hz", 1, |run| run.measured.updates.rate_hz()),
        column("contact_packet_rate_hz", "Hz", 1, |run| run.measured.updates.contact_rate_hz()),
        column("pmse", "", 4, |run| run.measured.force.pmse),
        column("pmse_x", "", 4, |run| run.measured.force.pmse_x),
        column("pmse_y", "", 4, |run| run.measured.force.pmse_y),
        column("pmse_magnitude", "", 4, |run| run.measured.force.pmse_magnitude),
        column("relative_error", "", 4, |run| run.measured.force.relative_error),
        column("jnd7_share", "", 3, |run| run.measured.force.jnd7_share),
        column("packets", "", 0, |run| run.measured.updates.total()),
        column("contact_s", "s", 1, |run| run.measured.contact_s),
        column("sensing", "", 0, |run| run.case.senses.name()),
    ]
}

fn rate(group: &Group) -> Option<Interval> {
    group.interval(|run| run.updates.rate_hz())
}

fn pmse(group: &Group) -> Option<Interval> {
    group.interval(|run| run.force.pmse)
}

fn half(interval: Option<Interval>) -> Option<f64> {
    interval.map(|interval| interval.high - interval.mean)
}

fn summary(groups: &[Group]) -> Table {
    Table::of(
        "Fig. 5: mean over the seeds, ± half of the 95 % interval",
        groups,
        &[
            column("mode", "", 0, |group| mode_name(group.case.mode)),
            column("sensing", "", 0, |group| group.case.senses.name()),
            column("scheme", "", 0, |group| group.case.curve.label()),
            column("deadband", "", 3, |group| group.case.deadband),
            column("n", "", 0, |group| rate(group).map(|rate| rate.n as u64)),
            mean("packets_per_s", "Hz", 1, |run| run.updates.rate_hz()),
            column("pm_rate", "Hz", 1, |group| half(rate(group))),
            mean("pmse", "", 4, |run| run.force.pmse),
            column("pm_pmse", "", 4, |group| half(pmse(group))),
            mean("pmse_magnitude", "", 4, |run| run.force.pmse_magnitude),
            mean("relative_error", "", 4, |run| run.force.relative_error),
            mean("jnd7_share", "", 3, |run| run.force.jnd7_share),
        ],
    )
}

/// Left the paper's axes and curves, right both modes with equal senses on logarithmic axes.
fn figure(groups: &[Group]) -> Figure {
    let as_printed = |of: &Of| (of.0, of.1) == (Mode::Paper, Senses::Touch);
    let series = |notes: bool, wanted: fn(&Of) -> bool| {
        let wanted = FIG5_CURVES.into_iter().filter(wanted);
        wanted.map(move |of| drawn(groups, of, notes))
    };
    let rate = "packet rate, 1/s";
    let of_paper = Panel::new(
        "The paper's schemes",
        Axis::linear(rate),
        Axis::linear("PMSE"),
        series(true, as_printed),
    );
    let of_both = Panel::new(
        "Both modes, by touch and with vision",
        Axis::log(rate),
        Axis::log("PMSE"),
        series(false, |_| true),
    );
    Figure {
        panels: vec![
            of_paper.with_legend(Legend::UpperRight),
            of_both.with_legend(Legend::UpperLeft),
        ],
        columns: 2,
        panel_size: (680, 440),
    }
}

/// A curve in the figure: colour by scheme and mode, stroke by senses.
fn drawn(groups: &[Group], of: Of, notes: bool) -> Series {
    let (mode, senses, curve) = of;
    let (of_paper, of_recommended, mark) = match curve {
        Curve::Deadband => (Colour::BLUE, Colour::SKY, Mark::Circle),
        Curve::Hybrid(50) => (Colour::VERMILION, Colour::ORANGE, Mark::Square),
        Curve::Hybrid(_) => (Colour::GREEN, Colour::PURPLE, Mark::Triangle),
        Curve::Useful(_) => (Colour::BLACK, Colour::BLACK, Mark::Cross),
    };
    let colour = match mode {
        Mode::Paper => of_paper,
        Mode::Recommended => of_recommended,
    };
    let of_curve = groups
        .iter()
        .filter(|group| (group.case.mode, group.case.senses, group.case.curve) == of);
    let dots = of_curve.filter_map(|group| {
        let deadband = group.case.deadband;
        let noted = notes && curve == Curve::Deadband && NOTED.contains(&deadband);
        Some(Dot {
            note: noted.then(|| format!("{} %", deadband * 100.0)),
            ..Dot::of_intervals(rate(group)?, pmse(group)?)
        })
    });
    let stroke = match senses {
        Senses::Touch => Stroke::Solid,
        Senses::Vision => Stroke::Dashed,
    };
    let label = if notes {
        curve.label()
    } else {
        let (mode, senses) = (mode_name(mode), senses.name());
        format!("{mode}, {}, {senses}", curve.label())
    };
    Series::line(&label, colour, dots.collect())
        .marked(mark)
        .stroked(stroke, 2)
}
