//! The figure: what the protocol adds to the path's delay, over loss, for each path and both stacks.

use super::grid::{
    FlowRun, JITTERS_MS, Kind, LOSSES_PERCENT, NARROW, OUTAGE, PLAIN, ROUND_TRIPS_MS, kind,
    largest, outcomes,
};
use crate::experiment::prelude::*;
use crate::transport::{Flow, FlowOutcome, Stack};

/// Where no loss and no delay are drawn on axes that have no zero.
const NO_LOSS_PERCENT: f64 = 0.01;
const NO_DELAY_MS: f64 = 0.1;

/// A row of panels.
struct Row {
    /// Which paths it shows, for people.
    name: &'static str,
    kind: Kind,
    /// What it shows of each run, ms.
    what: &'static str,
    value: fn(&FlowOutcome) -> Option<f64>,
    /// The least that is shown, ms.
    foot: f64,
}

const ROWS: [Row; 3] = [
    Row {
        name: "no bottleneck",
        kind: PLAIN,
        what: "added delay, p99, ms (none at 0.1)",
        value: |outcome| outcome.added_p99_ms,
        foot: 0.07,
    },
    Row {
        name: "1 s outage",
        kind: OUTAGE,
        what: "added delay, p99, ms (none at 0.1)",
        value: |outcome| outcome.added_p99_ms,
        foot: 0.07,
    },
    Row {
        name: "1 Mbit/s",
        kind: NARROW,
        what: "added delay, median, ms",
        value: |outcome| outcome.added_p50_ms,
        // room for the legend
        foot: 0.008,
    },
];

/// Round trips side by side, kinds of path below each other, at 1000 messages a second.
pub(super) fn figure(runs: &[FlowRun]) -> Figure {
    let mut panels = Vec::new();
    for row in &ROWS {
        for round_trip_ms in ROUND_TRIPS_MS {
            let round_trip = Duration::from_millis(round_trip_ms);
            panels.push(Panel::new(
                format!("{}, round trip {round_trip_ms} ms", row.name),
                Axis::log("loss, % (none at 0.01)").over(0.008..8.0),
                Axis::log(row.what).over(row.foot..20_000.0),
                curves(runs, row, round_trip),
            ));
        }
    }
    if let Some(last) = panels.last_mut() {
        last.legend = Some(Legend::LowerRight);
    }
    Figure {
        panels,
        columns: ROUND_TRIPS_MS.len(),
        panel_size: (380, 340),
    }
}

/// The worst seed of each condition, over the loss.
fn curves(runs: &[FlowRun], row: &Row, round_trip: Duration) -> Vec<Series> {
    let mut curves = Vec::new();
    for (stack, colour, stroke) in [
        (Stack::Stock, Colour::VERMILION, Stroke::Dashed),
        (Stack::Ours, Colour::BLUE, Stroke::Solid),
    ] {
        let marks = [Mark::Circle, Mark::Square, Mark::Triangle];
        for (jitter_ms, mark) in JITTERS_MS.into_iter().zip(marks) {
            let dot = |loss: f64| {
                let of_condition = outcomes(runs, stack, |case| {
                    let conditions = &case.conditions;
                    case.flow == Flow::EVERY_SAMPLE
                        && kind(conditions) == row.kind
                        && conditions.round_trip == round_trip
                        && conditions.jitter == Duration::from_millis(jitter_ms)
                        && (conditions.loss_percent() - loss).abs() < 1e-9
                });
                let added = largest(&of_condition, row.value)?;
                Some(Dot::at(loss.max(NO_LOSS_PERCENT), added.max(NO_DELAY_MS)))
            };
            let label = format!("{}, jitter {jitter_ms} ms", stack.name());
            let dots = LOSSES_PERCENT.into_iter().filter_map(dot).collect();
            let curve = Series::line(&label, colour, dots);
            curves.push(curve.marked(mark).stroked(stroke, 2));
        }
    }
    curves
}
