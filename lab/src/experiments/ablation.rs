//! How the paper's results depend on the choices that the paper leaves open.
//!
//! Each variant changes one choice of paper mode; everything else stays.

use mmt_server::estimator::Rows;
use mmt_shared::model::settings::{ModelSettings, Smoothing};

use super::readings::{READINGS, Variant, paper_estimator};
use crate::experiment::prelude::*;
use crate::setting::knee;

/// The ablation.
pub(super) const ABLATION: Experiment = Experiment::new(
    "ablation",
    "How the paper's results depend on what the paper leaves open",
    10,
    run,
);

/// Deadbands at the ends of the knee.
const DEADBANDS: [f64; 3] = [0.025, 0.10, 0.30];
/// The schemes.
const CURVES: [Curve; 3] = [Curve::Deadband, Curve::Hybrid(50), Curve::Hybrid(150)];

/// Other choices than [`READINGS`], made otherwise.
#[rustfmt::skip]
static VARIANTS: [Variant; 14] = [
    ("as stated", |_| {}),
    ("window 100 ms", |world| paper_estimator(world, |paper| paper.window_s = 0.1)),
    ("window 500 ms", |world| paper_estimator(world, |paper| paper.window_s = 0.5)),
    ("window 1 s", |world| paper_estimator(world, |paper| paper.window_s = 1.0)),
    ("rows x and y stacked", |world| paper_estimator(world, |paper| paper.rows = Rows::Stacked)),
    ("standstill left out", |world| paper_estimator(world, |paper| paper.leave_out_standstill = true)),
    ("an update when contact ends", |world| world.slave.trigger.contact_lost = true),
    ("timer in contact only", |world| world.slave.trigger.timer_in_free_space = false),
    ("sticking is no mismatch", |world| world.slave.trigger.judge_sticking = false),
    ("no sensor noise", |world| noise(world, 0.0)),
    ("three times the sensor noise", |world| noise(world, 3.0)),
    ("lambda 0.9", |world| settings(world, |s| s.smoothing = Smoothing::PerPacket { lambda: 0.9 })),
    ("(6) without contact damping", |world| settings(world, |s| s.coupling.damping_ns_per_m = 0.0)),
    ("model of the true side, 36 cm", |world| world.slave.start.side_m = 0.36),
];

fn settings(world: &mut WorldConfig, change: impl FnOnce(&mut ModelSettings)) {
    if let Some(settings) = &mut world.settings {
        change(settings);
    }
}

/// Position and force noise so many times the default.
fn noise(world: &mut WorldConfig, times: f64) {
    world.slave.sensing.position_noise_m *= times;
    world.slave.sensing.force_noise_n *= times;
}

/// A variant with a scheme at a deadband.
type Case = (&'static Variant, Curve, f64);
type Group = grid::Group<Case, Measured>;

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for variant in VARIANTS.iter().chain(&READINGS) {
        for curve in CURVES {
            cases.extend(DEADBANDS.map(|deadband| (variant, curve, deadband)));
        }
    }
    cases
}

/// Keeps `ablation.csv`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let trial = |((_, change), curve, deadband): &Case| {
        let mut world = paper_world(Mode::Paper, curve.at(*deadband));
        change(&mut world);
        Trial::new(world, extent.duration)
    };
    let groups = runner.trials("ablation", extent.seeds, cases(), trial)?;
    let title = format!(
        "Ablation of paper mode, {} seeds: packets/s and PMSE at 2.5, 10 and 30 %",
        extent.seeds
    );
    let table = Table::of(title, &rows(&groups), &columns());
    runner.keep_table("ablation.csv", &table)?;
    Ok(Findings {
        digest: digest(&groups),
        configuration: vec![paper_world(Mode::Paper, Curve::Hybrid(150).at(0.10))],
        tables: vec![table],
    })
}

/// A variant with a scheme.
struct Row<'a> {
    /// At each of [`DEADBANDS`].
    at: &'a [Group; 3],
    /// The variant's deadband scheme at the greatest one; none for that scheme itself.
    base: Option<&'a Group>,
}

fn rows(groups: &[Group]) -> Vec<Row<'_>> {
    let mut rows = Vec::new();
    for of_variant in groups.as_chunks::<3>().0.chunks(CURVES.len()) {
        let base = of_variant.first().map(|[_, _, coarse]| coarse);
        rows.extend(of_variant.iter().zip(0..).map(|(at, k)| Row {
            at,
            base: base.filter(|_| k > 0),
        }));
    }
    rows
}

#[rustfmt::skip]
fn columns<'a>() -> Vec<Column<'a, Row<'a>>> {
    fn rate(group: &Group) -> Option<f64> {
        group.mean(|run| run.updates.rate_hz())
    }
    fn pmse(group: &Group) -> Option<f64> {
        group.mean(|run| run.force.pmse)
    }
    let mut columns: Vec<Column<Row>> = vec![
        column("variant", "", 0, |row| row.at[0].case.0.0),
        column("scheme", "", 0, |row| row.at[0].case.1.label()),
        column("rate_2.5", "Hz", 0, |row| rate(&row.at[0])),
        column("rate_10", "Hz", 0, |row| rate(&row.at[1])),
        column("rate_30", "Hz", 0, |row| rate(&row.at[2])),
        column("pmse_2.5", "", 3, |row| pmse(&row.at[0])),
        column("pmse_10", "", 3, |row| pmse(&row.at[1])),
        column("pmse_30", "", 3, |row| pmse(&row.at[2])),
    ];
    columns.extend(interval(["knee", "knee_low", "knee_high"], "", 2, |row: &Row| knees(row.at)));
    columns.extend(interval(
        ["vs_deadband_30", "vs_low", "vs_high"],
        "",
        2,
        |row: &Row| row.at[2].ratio(row.base?, |run| run.force.pmse),
    ));
    columns.push(column("mass_error", "", 2, |row| row.at[1].median(|run| Some(run.parameter_errors[0].abs()))));
    columns
}

/// The knee, seed by seed.
fn knees([fine, middle, coarse]: &[Group; 3]) -> Option<Interval> {
    let seeds = fine.runs.iter().zip(&middle.runs).zip(&coarse.runs);
    Interval::of(seeds.filter_map(|((fine, middle), coarse)| {
        let pmse = |run: &Measured| run.force.pmse;
        Some(knee(pmse(fine)?, pmse(middle)?, pmse(coarse)?))
    }))
}
