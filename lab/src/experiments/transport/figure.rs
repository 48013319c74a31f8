//! The figure: what the protocol adds to the path's delay, over loss, for each path and both stacks.

use std::time::Duration;

use super::grid::{JITTERS_MS, LOSSES_PERCENT, ROUND_TRIPS_MS};
use super::{Run, largest, of};
use crate::figure::{Axis, Colour, Dot, Figure, Legend, Mark, Panel, Series, Stroke};
use crate::transport::{Conditions, Flow, Outcome, Stack};

/// Where no loss and no delay are drawn on axes that have no zero.
const NO_LOSS_PERCENT: f64 = 0.01;
const NO_DELAY_MS: f64 = 0.1;

/// A row of panels.
struct Row {
    /// Which paths it shows, for people.
    name: &'static str,
    shows: fn(&Conditions) -> bool,
    /// What it shows of each run, ms.
    what: &'static str,
    value: fn(&Outcome) -> Option<f64>,
    /// The least that is shown, ms.
    foot: f64,
}

const ROWS: [Row; 3] = [
    Row {
        name: "no bottleneck",
        shows: |c| c.outage == Duration::ZERO && c.bottleneck.is_none(),
        what: "added delay, p99, ms (none at 0.1)",
        value: |outcome| outcome.added_p99_ms,
        foot: 0.07,
    },
    Row {
        name: "1 s outage",
        shows: |c| c.outage > Duration::ZERO && c.bottleneck.is_none(),
        what: "added delay, p99, ms (none at 0.1)",
        value: |outcome| outcome.added_p99_ms,
        foot: 0.07,
    },
    Row {
        name: "1 Mbit/s",
        shows: |c| c.outage == Duration::ZERO && c.bottleneck.is_some(),
        what: "added delay, median, ms",
        value: |outcome| outcome.added_p50_ms,
        // room for the legend
        foot: 0.008,
    },
];

/// Round trips side by side, kinds of path below each other, at 1000 messages a second.
pub(super) fn figure(runs: &[Run]) -> Figure {
    let mut panels = Vec::new();
    for row in &ROWS {
        for round_trip_ms in ROUND_TRIPS_MS {
            let shown = runs.iter().filter(|(case, _)| {
                case.flow == Flow::EverySample
                    && case.conditions.round_trip.as_millis() == round_trip_ms.into()
                    && (row.shows)(&case.conditions)
            });
            let shown: Vec<Run> = shown.copied().collect();
            panels.push(Panel::new(
                format!("{}, round trip {round_trip_ms} ms", row.name),
                Axis::log("loss, % (none at 0.01)").over(0.008..8.0),
                Axis::log(row.what).over(row.foot..20_000.0),
                curves(&shown, row.value),
            ));
        }
    }
    if let Some(last) = panels.last_mut() {
        last.legend = Legend::LowerRight;
    }
    Figure {
        panels,
        columns: ROUND_TRIPS_MS.len(),
        panel_size: (380, 340),
    }
}

fn curves(shown: &[Run], value: fn(&Outcome) -> Option<f64>) -> Vec<Series> {
    let mut curves = Vec::new();
    for (stack, colour, stroke) in [
        (Stack::Stock, Colour::Vermilion, Stroke::Dashed),
        (Stack::Ours, Colour::Blue, Stroke::Solid),
    ] {
        for (jitter_ms, mark) in
            JITTERS_MS
                .into_iter()
                .zip([Mark::Circle, Mark::Square, Mark::Triangle])
        {
            let label = format!("{}, jitter {jitter_ms} ms", stack.name());
            let dots = LOSSES_PERCENT
                .into_iter()
                .filter_map(|loss| dot(&of(shown, stack), value, jitter_ms, loss));
            let curve = Series::line(&label, colour, dots.collect());
            curves.push(curve.marked(mark).stroked(stroke, 2));
        }
    }
    curves
}

/// The worst seed of one condition.
fn dot(
    shown: &[Run],
    value: fn(&Outcome) -> Option<f64>,
    jitter_ms: u64,
    loss: f64,
) -> Option<Dot> {
    let of_condition = shown.iter().filter(|(case, _)| {
        case.conditions.jitter.as_millis() == jitter_ms.into()
            && (case.conditions.loss_percent() - loss).abs() < 1e-9
    });
    let of_condition: Vec<Run> = of_condition.copied().collect();
    let added = largest(&of_condition, value)?;
    Some(Dot::at(loss.max(NO_LOSS_PERCENT), added.max(NO_DELAY_MS)))
}
