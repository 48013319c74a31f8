//! Every update scheme and every metric of mismatch in one table, scored on the usual run and on a change in mid-run.

use mmt_server::trigger::{MismatchMetric, Scheme};

use super::recovery;
use crate::experiment::prelude::*;
use crate::trial::{Alteration, Change};

/// Delta of every scheme that has one.
const DELTA: f64 = 0.10;
/// mu steps from 0.30 to this in the second push: a wet patch, a sheet of rubber.
const CHANGE: Change = Change {
    after_pushes: 1,
    contact_s: 1.0,
    to: Alteration::FrictionCoefficient(0.45),
};

/// The comparison of the schemes.
pub(super) const SCHEMES: Experiment = Experiment::new(
    "schemes",
    "Every update scheme and mismatch metric, with recovery after a change of friction",
    10,
    run,
);

struct Case {
    mode: Mode,
    scheme: Scheme,
    metric: MismatchMetric,
    change: Option<Change>,
}

type Group = grid::Group<Case, Measured>;

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

/// Each scheme twice: without and with the change.
fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (mode, _) in MODES {
        for (scheme, metric) in schemes() {
            cases.extend([None, Some(CHANGE)].map(|change| Case {
                mode,
                scheme,
                metric,
                change,
            }));
        }
    }
    cases
}

/// Keeps `schemes.csv`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let groups = runner.trials("schemes", extent.seeds, cases(), |case| {
        let mut world = paper_world(case.mode, case.scheme);
        world.slave.trigger.metric = case.metric;
        Trial {
            change: case.change,
            ..Trial::new(world, extent.duration)
        }
    })?;
    let title = format!(
        "Update schemes, {} seeds; recovery when mu steps from 0.30 to 0.45 in mid-push",
        extent.seeds
    );
    let table = Table::of(title, groups.as_chunks::<2>().0, &columns());
    runner.keep_table("schemes.csv", &table)?;
    Ok(Findings {
        digest: digest(&groups),
        configuration: paper_worlds(DELTA),
        tables: vec![table],
    })
}

/// Of the runs without and with the change.
#[rustfmt::skip]
fn columns<'a>() -> Vec<Column<'a, [Group; 2]>> {
    let mut columns: Vec<Column<[Group; 2]>> = vec![
        column("mode", "", 0, |[usual, _]| mode_name(usual.case.mode)),
        column("scheme", "", 0, |[usual, _]| usual.case.scheme.to_string()),
        column("metric", "", 0, |[usual, _]| match usual.case.metric {
            MismatchMetric::Force => "force",
            MismatchMetric::Parameters => "parameters",
            MismatchMetric::Pose => "pose",
        }),
    ];
    let usual: Vec<Column<Group>> = vec![
        mean("packet_rate_hz", "Hz", 1, |run| run.updates.rate_hz()),
        mean("contact_packet_rate_hz", "Hz", 1, |run| run.updates.contact_rate_hz()),
        mean("pmse", "", 4, |run| run.force.pmse),
        mean("pmse_magnitude", "", 4, |run| run.force.pmse_magnitude),
        mean("relative_error", "", 3, |run| run.force.relative_error),
        mean("jnd7_share", "", 3, |run| run.force.jnd7_share),
        mean("position_rms_mm", "mm", 1, |run| Some(run.position_rms_m? * 1e3)),
    ];
    columns.extend(
        usual
            .into_iter()
            .map(|column| column.of(|[usual, _]: &[Group; 2]| usual)),
    );
    let changed = recovery::columns().into_iter();
    columns.extend(changed.map(|column| column.of(|[_, changed]: &[Group; 2]| changed)));
    columns
}
