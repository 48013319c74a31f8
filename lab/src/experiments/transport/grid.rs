//! The grid of cases, and what is taken of its runs.

use std::time::Duration;

use mmt_netem::Probability;

use crate::transport::{Bottleneck, Case, Conditions, Flow, FlowOutcome, Stack};

/// A case and what it measured.
pub(super) type FlowRun<'a> = (&'a Case, &'a FlowOutcome);

/// Shortest round trips, ms.
pub(super) const ROUND_TRIPS_MS: [u64; 3] = [20, 100, 200];
/// Losses, %.
pub(super) const LOSSES_PERCENT: [f64; 4] = [0.0, 0.1, 1.0, 5.0];
/// Jitters J, ms.
pub(super) const JITTERS_MS: [u64; 3] = [0, 5, 20];
/// Lengths of the outage, ms.
const OUTAGES_MS: [u64; 2] = [0, 1000];
/// The bottlenecks.
const BOTTLENECKS: [Option<Bottleneck>; 2] = [None, Some(Bottleneck::NARROW)];

/// Every path of the grid.
fn paths() -> Vec<Conditions> {
    let mut paths = Vec::new();
    for bottleneck in BOTTLENECKS {
        for outage_ms in OUTAGES_MS {
            for round_trip_ms in ROUND_TRIPS_MS {
                for percent in LOSSES_PERCENT {
                    paths.extend(JITTERS_MS.map(|jitter_ms| Conditions {
                        round_trip: Duration::from_millis(round_trip_ms),
                        loss: Probability::from_percent(percent).unwrap_or_default(),
                        jitter: Duration::from_millis(jitter_ms),
                        outage: Duration::from_millis(outage_ms),
                        bottleneck,
                    }));
                }
            }
        }
    }
    paths
}

/// Every case of the grid: stack by stack, flow by flow, path by path.
pub(super) fn cases(duration: Duration, seed: u64) -> Vec<Case> {
    let mut cases = Vec::new();
    for stack in Stack::ALL {
        for flow in Flow::ALL {
            cases.extend(paths().into_iter().map(|conditions| Case {
                stack,
                flow,
                conditions,
                duration,
                seed,
            }));
        }
    }
    cases
}

/// Whether a path has an outage, and whether it has a bottleneck.
pub(super) type Kind = (bool, bool);

pub(super) const PLAIN: Kind = (false, false);
pub(super) const OUTAGE: Kind = (true, false);
pub(super) const NARROW: Kind = (false, true);

/// What a path does to packets beyond loss and jitter.
pub(super) fn kind(conditions: &Conditions) -> Kind {
    (
        !conditions.outage.is_zero(),
        conditions.bottleneck.is_some(),
    )
}

/// What the runs of a stack measured on some paths with some messages.
pub(super) fn outcomes<'a>(
    runs: &[FlowRun<'a>],
    stack: Stack,
    wanted: impl Fn(&Case) -> bool,
) -> Vec<&'a FlowOutcome> {
    let runs = runs.iter();
    let runs = runs.filter(|(case, _)| case.stack == stack && wanted(case));
    runs.map(|(_, outcome)| *outcome).collect()
}

/// The largest of what was measured.
pub(super) fn largest(
    outcomes: &[&FlowOutcome],
    of: fn(&FlowOutcome) -> Option<f64>,
) -> Option<f64> {
    outcomes
        .iter()
        .filter_map(|outcome| of(outcome))
        .reduce(f64::max)
}
