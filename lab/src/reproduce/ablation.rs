//! How the paper's results depend on the choices that the paper leaves open.
//!
//! Each variant changes one choice of paper mode; everything else stays.

use mmt_server::estimator::{EstimatorConfig, PaperConfig, Rows};
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::settings::{Mode, ModelSettings, Smoothing};

use super::{Curve, Extent, Findings, Laboratory, ReproduceError, digest, nothing, paper_world};
use crate::statistics::{Interval, median};
use crate::table::{Cell, Table};
use crate::trial::{Measured, Trial};
use crate::world::WorldConfig;

/// Deadbands at the ends of the knee.
const DEADBANDS: [f64; 3] = [0.025, 0.10, 0.30];
/// The schemes.
const CURVES: [Curve; 3] = [Curve::Deadband, Curve::Hybrid(50), Curve::Hybrid(150)];

/// One choice made otherwise.
struct Variant {
    name: &'static str,
    apply: fn(&mut WorldConfig),
}

const VARIANTS: [Variant; 13] = [
    Variant {
        name: "as stated",
        apply: |_| {},
    },
    Variant {
        name: "window 100 ms",
        apply: |world| paper_estimator(world, |paper| paper.window_s = 0.1),
    },
    Variant {
        name: "window 500 ms",
        apply: |world| paper_estimator(world, |paper| paper.window_s = 0.5),
    },
    Variant {
        name: "window 1 s",
        apply: |world| paper_estimator(world, |paper| paper.window_s = 1.0),
    },
    Variant {
        name: "rows x and y stacked",
        apply: |world| paper_estimator(world, |paper| paper.rows = Rows::Stacked),
    },
    Variant {
        name: "timer packets carry the pose",
        apply: |world| world.slave.trigger.timer_carries_pose = true,
    },
    Variant {
        name: "timer in contact only",
        apply: |world| world.slave.trigger.timer_in_free_space = false,
    },
    Variant {
        name: "sticking is no mismatch",
        apply: |world| world.slave.trigger.judge_sticking = false,
    },
    Variant {
        name: "no sensor noise",
        apply: |world| noise(world, 0.0),
    },
    Variant {
        name: "three times the sensor noise",
        apply: |world| noise(world, 3.0),
    },
    Variant {
        name: "lambda 0.9",
        apply: |world| {
            settings(world, |s| {
                s.smoothing = Smoothing::PerPacket { lambda: 0.9 }
            })
        },
    },
    Variant {
        name: "(6) without contact damping",
        apply: |world| {
            settings(world, |s| {
                s.coupling = Coupling {
                    damping_ns_per_m: 0.0,
                    ..s.coupling
                };
            });
        },
    },
    Variant {
        name: "model of the true side, 36 cm",
        apply: |world| world.slave.start.side_m = 0.36,
    },
];

fn paper_estimator(world: &mut WorldConfig, change: impl FnOnce(&mut PaperConfig)) {
    let mut paper = PaperConfig::default();
    change(&mut paper);
    world.slave.estimator = Some(EstimatorConfig::Paper(paper));
}

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

/// Runs every variant and keeps `ablation.csv`.
///
/// # Errors
/// As [`Laboratory::run`] and [`Laboratory::keep`].
pub fn reproduce(laboratory: &dyn Laboratory, extent: Extent) -> Result<Findings, ReproduceError> {
    let mut trials = Vec::new();
    for variant in &VARIANTS {
        for curve in CURVES {
            for deadband in DEADBANDS {
                let mut world = paper_world(Mode::Paper, curve.at(deadband));
                (variant.apply)(&mut world);
                let seeds = (1..=extent.seeds).map(|seed| world.clone().seeded(seed));
                trials.extend(seeds.map(|world| Trial::new(world, extent.duration)));
            }
        }
    }
    let measured = laboratory.run("ablation", &trials, &nothing)?;
    let table = table(&measured, extent.seeds as usize);
    laboratory.keep("ablation.csv", &table.to_csv())?;
    Ok(Findings {
        experiment: "ablation",
        extent,
        digest: digest(&measured),
        configuration: vec![paper_world(Mode::Paper, Curve::Hybrid(150).at(0.10))],
        tables: vec![table],
    })
}

fn table(measured: &[Measured], seeds: usize) -> Table {
    let mut table = Table::new(
        format!("Ablation of paper mode, {seeds} seeds: packets/s and PMSE at 2.5, 10 and 30 %"),
        &[
            ("variant", 0),
            ("scheme", 0),
            ("rate_2.5", 0),
            ("rate_10", 0),
            ("rate_30", 0),
            ("pmse_2.5", 3),
            ("pmse_10", 3),
            ("pmse_30", 3),
            ("knee", 2),
            ("knee_low", 2),
            ("knee_high", 2),
            ("vs_deadband_30", 2),
            ("vs_low", 2),
            ("vs_high", 2),
            ("mass_error", 2),
        ],
    );
    let rows = VARIANTS
        .iter()
        .flat_map(|variant| CURVES.iter().map(move |curve| (variant, curve)));
    let groups: Vec<&[Measured]> = measured.chunks(seeds.max(1)).collect();
    for (n, ((variant, curve), runs)) in rows.zip(groups.chunks(DEADBANDS.len())).enumerate() {
        let [fine, middle, coarse] = runs else {
            continue;
        };
        let first_of_variant = n - n % CURVES.len();
        let deadband_at_30 = groups.get(first_of_variant * DEADBANDS.len() + 2);
        let rate = |runs: &[Measured]| mean(runs, |run| run.updates.rate_hz());
        let pmse = |runs: &[Measured]| mean(runs, |run| run.force.pmse);
        let knee = knee(fine, middle, coarse);
        let versus = deadband_at_30
            .filter(|_| n != first_of_variant)
            .and_then(|base| ratio(coarse, base));
        table.push([
            Cell::from(variant.name),
            curve.label().into(),
            rate(fine),
            rate(middle),
            rate(coarse),
            pmse(fine),
            pmse(middle),
            pmse(coarse),
            knee.map(|k| k.mean).into(),
            knee.map(|k| k.low).into(),
            knee.map(|k| k.high).into(),
            versus.map(|v| v.mean).into(),
            versus.map(|v| v.low).into(),
            versus.map(|v| v.high).into(),
            median(middle.iter().map(|run| run.parameter_errors[0].abs())).into(),
        ]);
    }
    table
}

fn mean(runs: &[Measured], of: impl Fn(&Measured) -> Option<f64>) -> Cell {
    Interval::of(runs.iter().filter_map(of))
        .map(|interval| interval.mean)
        .into()
}

/// The exponent of PMSE over Delta from 30 to 10 % less that from 10 to 2.5 %, seed by seed.
fn knee(fine: &[Measured], middle: &[Measured], coarse: &[Measured]) -> Option<Interval> {
    let seeds = fine.iter().zip(middle).zip(coarse);
    Interval::of(seeds.filter_map(|((fine, middle), coarse)| {
        let ln = |run: &Measured| run.force.pmse.map(libm::log);
        let (fine, middle, coarse) = (ln(fine)?, ln(middle)?, ln(coarse)?);
        Some((coarse - middle) / libm::log(3.0) - (middle - fine) / libm::log(4.0))
    }))
}

/// PMSE of some runs over that of others, seed by seed.
fn ratio(runs: &[Measured], base: &[Measured]) -> Option<Interval> {
    let seeds = runs.iter().zip(base);
    Interval::of_ratios(seeds.filter_map(|(run, base)| Some(run.force.pmse? / base.force.pmse?)))
}
