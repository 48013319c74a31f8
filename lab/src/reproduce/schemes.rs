//! Every update scheme and every metric of mismatch in one table, scored on the usual run and on a change in mid-run.

use std::time::Duration;

use mmt_server::trigger::{MismatchMetric, Scheme};
use mmt_shared::model::settings::Mode;

use super::{
    Curve, Extent, Findings, Laboratory, ReproduceError, digest, mode_name, nothing, paper_world,
};
use crate::statistics::{Interval, median};
use crate::table::{Cell, Table};
use crate::trial::{Alteration, Change, Measured, Trial};

/// Delta of every scheme that has one.
const DELTA: f64 = 0.10;
/// mu steps from 0.30 to this in the second push: a wet patch, a sheet of rubber.
const CHANGE: Change = Change {
    after_pushes: 1,
    contact_s: 1.0,
    to: Alteration::FrictionCoefficient(0.45),
};

fn schemes() -> Vec<(Scheme, MismatchMetric)> {
    let ms = Duration::from_millis;
    let force = MismatchMetric::Force;
    let mut schemes = vec![
        (Scheme::EverySample, force),
        (Scheme::Timer { t_update: ms(50) }, force),
        (Scheme::Timer { t_update: ms(150) }, force),
        (
            Scheme::Dis {
                threshold_n: 0.3,
                heartbeat: ms(1000),
            },
            force,
        ),
    ];
    let metrics = [force, MismatchMetric::Parameters, MismatchMetric::Pose];
    for curve in [Curve::Deadband, Curve::Hybrid(150), Curve::Useful(150)] {
        schemes.extend(metrics.map(|metric| (curve.at(DELTA), metric)));
    }
    schemes
}

fn metric_name(metric: MismatchMetric) -> &'static str {
    match metric {
        MismatchMetric::Force => "force",
        MismatchMetric::Parameters => "parameters",
        MismatchMetric::Pose => "pose",
    }
}

/// Runs every scheme in both modes, without and with the change; keeps `schemes.csv`.
///
/// # Errors
/// As [`Laboratory::run`] and [`Laboratory::keep`].
pub fn reproduce(laboratory: &dyn Laboratory, extent: Extent) -> Result<Findings, ReproduceError> {
    let cases: Vec<(Mode, Scheme, MismatchMetric)> = [Mode::Paper, Mode::Recommended]
        .into_iter()
        .flat_map(|mode| {
            schemes()
                .into_iter()
                .map(move |(scheme, metric)| (mode, scheme, metric))
        })
        .collect();
    let mut trials = Vec::new();
    for (mode, scheme, metric) in &cases {
        let mut world = paper_world(*mode, *scheme);
        world.slave.trigger.metric = *metric;
        for change in [None, Some(CHANGE)] {
            trials.extend((1..=extent.seeds).map(|seed| Trial {
                change,
                ..Trial::new(world.clone().seeded(seed), extent.duration)
            }));
        }
    }
    let measured = laboratory.run("schemes", &trials, &nothing)?;
    let table = table(&cases, &measured, extent.seeds as usize);
    laboratory.keep("schemes.csv", &table.to_csv())?;
    Ok(Findings {
        experiment: "schemes",
        extent,
        digest: digest(&measured),
        configuration: vec![
            paper_world(Mode::Paper, Curve::Hybrid(150).at(DELTA)),
            paper_world(Mode::Recommended, Curve::Useful(150).at(DELTA)),
        ],
        tables: vec![table],
    })
}

fn table(cases: &[(Mode, Scheme, MismatchMetric)], measured: &[Measured], seeds: usize) -> Table {
    let mut table = Table::new(
        format!(
            "Update schemes, {seeds} seeds; recovery when mu steps from 0.30 to 0.45 in mid-push"
        ),
        &[
            ("mode", 0),
            ("scheme", 0),
            ("metric", 0),
            ("packet_rate_hz", 1),
            ("contact_packet_rate_hz", 1),
            ("pmse", 4),
            ("pmse_magnitude", 4),
            ("relative_error", 3),
            ("jnd7_share", 3),
            ("position_rms_mm", 1),
            ("recovered_share", 2),
            ("recovery_contact_s", 2),
            ("recovery_packets", 0),
        ],
    );
    let groups: Vec<&[Measured]> = measured.chunks(seeds.max(1)).collect();
    for ((mode, scheme, metric), runs) in cases.iter().zip(groups.chunks(2)) {
        let [usual, changed] = runs else {
            continue;
        };
        let mean = |of: &dyn Fn(&Measured) -> Option<f64>| {
            Cell::from(Interval::of(usual.iter().filter_map(of)).map(|interval| interval.mean))
        };
        let recoveries = || changed.iter().filter_map(|run| run.recovery);
        let recovered = recoveries()
            .filter(|recovery| recovery.contact_s.is_some())
            .count();
        table.push([
            mode_name(*mode).into(),
            scheme.to_string().into(),
            metric_name(*metric).into(),
            mean(&|run| run.updates.rate_hz()),
            mean(&|run| run.updates.contact_rate_hz()),
            mean(&|run| run.force.pmse),
            mean(&|run| run.force.pmse_magnitude),
            mean(&|run| run.force.relative_error),
            mean(&|run| run.force.jnd7_share),
            mean(&|run| run.position_rms_m.map(|m| m * 1e3)),
            (recovered as f64 / recoveries().count() as f64).into(),
            median(recoveries().filter_map(|recovery| recovery.contact_s)).into(),
            median(recoveries().map(|recovery| recovery.updates as f64)).into(),
        ]);
    }
    table
}
