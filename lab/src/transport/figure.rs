//! The figure: the delay that 99 % of the messages do not exceed, over loss, for each path and both stacks.

use std::time::Duration;

use super::grid::{JITTERS_MS, LOSSES_PERCENT, ROUND_TRIPS_MS};
use super::reproduce::{Run, largest};
use super::tables::{millis, percent};
use super::{Conditions, Flow, Stack};
use crate::figure::{Axis, Colour, Dot, Figure, Legend, Mark, Panel, Series, Stroke};

/// Where no loss and no delay are drawn on axes that have no zero.
const NO_LOSS_PERCENT: f64 = 0.01;
const NO_DELAY_MS: f64 = 0.1;

/// A row of panels: its name and which paths it shows.
type Row = (&'static str, fn(&Conditions) -> bool);

const ROWS: [Row; 3] = [
    ("no bottleneck", |c| {
        c.outage == Duration::ZERO && c.bottleneck.is_none()
    }),
    ("1 s outage", |c| {
        c.outage > Duration::ZERO && c.bottleneck.is_none()
    }),
    ("1 Mbit/s", |c| {
        c.outage == Duration::ZERO && c.bottleneck.is_some()
    }),
];

/// Round trips side by side, kinds of path below each other, at 1000 messages a second.
pub(super) fn figure(runs: &[Run]) -> Figure {
    let mut panels = Vec::new();
    for (name, shows) in ROWS {
        for round_trip_ms in ROUND_TRIPS_MS {
            let shown = runs.iter().filter(|(case, _)| {
                case.flow == Flow::EverySample
                    && millis(case.conditions.round_trip) == round_trip_ms
                    && shows(&case.conditions)
            });
            let shown: Vec<Run> = shown.copied().collect();
            panels.push(Panel {
                title: format!("{name}, round trip {round_trip_ms} ms"),
                x: Axis::log("loss, % (none at 0.01)").over(0.008..8.0),
                y: Axis::log("added delay, p99, ms (none at 0.1)").over(0.07..20_000.0),
                series: curves(&shown),
                legend: match panels.len() {
                    0 => Legend::UpperLeft,
                    _ => Legend::None,
                },
            });
        }
    }
    Figure {
        panels,
        columns: ROUND_TRIPS_MS.len(),
        panel_size: (380, 300),
    }
}

fn curves(shown: &[Run]) -> Vec<Series> {
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
                .filter_map(|loss| dot(shown, stack, jitter_ms, loss));
            let curve = Series::line(&label, colour, dots.collect());
            curves.push(curve.marked(mark).stroked(stroke, 2));
        }
    }
    curves
}

/// The worst seed of one condition.
fn dot(shown: &[Run], stack: Stack, jitter_ms: u64, loss: f64) -> Option<Dot> {
    let of_condition = shown.iter().copied().filter(|(case, _)| {
        case.stack == stack
            && millis(case.conditions.jitter) == jitter_ms
            && (percent(&case.conditions) - loss).abs() < 1e-9
    });
    let added = largest(of_condition, |outcome| outcome.added_p99_ms)?;
    Some(Dot::at(loss.max(NO_LOSS_PERCENT), added.max(NO_DELAY_MS)))
}
