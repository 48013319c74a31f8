//! Forces and packets of a run over time, as the paper shows them in Figs. 6 and 7: of a trial, or of a recorded session.

use std::ops::RangeInclusive;

use crate::figure::{Axis, Colour, Dot, Figure, Legend, Panel, Series, Stroke};
use crate::table::{Table, column};
use crate::trial::TraceRow;

/// The opening that is shown enlarged, s.
const OPENING_S: f64 = 6.0;
/// A curve is drawn by the least and the largest value of so many parts of the time shown.
const PARTS: usize = 900;

/// The forces of each row, their difference, and why an update was sent.
#[rustfmt::skip]
#[must_use]
pub fn forces(trace: &[TraceRow]) -> Table {
    Table::of(
        "Forces",
        trace,
        &[
            column("t_s", "s", 3, |row| row.t_s),
            column("fs_n", "N", 3, |row| row.f_s.norm()),
            column("fm_n", "N", 3, |row| row.f_m.map(|f_m| f_m.norm())),
            column("error_n", "N", 3, |row| row.f_m.map(|f_m| (row.f_s - f_m).norm())),
            column("update", "", 0, |row| row.update.map(|cause| cause.name())),
        ],
    )
}

/// The whole run above, its opening below.
#[must_use]
pub fn figure(title: &str, rows: &[TraceRow]) -> Figure {
    let end = rows.last().map_or(1.0, |row| row.t_s);
    let contact = rows.iter().find(|row| row.f_s.norm() > 0.1);
    let begin = contact.map_or(0.0, |row| (row.t_s - 0.5).max(0.0));
    let panels = [
        panel(title, rows, 0.0..=end, 1.4),
        panel("the first push", rows, begin..=begin + OPENING_S, 1.08),
    ];
    Figure::of_alike(panels, Legend::UpperRight, 1, (1060, 330))
}

/// `height`: how high the axis reaches over the largest force, with room for a legend.
fn panel(title: &str, rows: &[TraceRow], when: RangeInclusive<f64>, height: f64) -> Panel {
    let shown: Vec<&TraceRow> = rows.iter().filter(|row| when.contains(&row.t_s)).collect();
    let largest = shown
        .iter()
        .map(|row| row.f_s.norm().max(row.f_m.map_or(0.0, |f| f.norm())));
    let top = largest.fold(1.0, f64::max) * height;
    let curve = |label: &str, colour: Colour, width: u32, of: &dyn Fn(&TraceRow) -> Option<f64>| {
        let line = Series::line(label, colour, envelope(&shown, of));
        line.stroked(Stroke::Solid, width)
    };
    let sent = shown.iter().filter(|row| row.update.is_some());
    // a strip of its own below the forces
    let events = sent.map(|row| Dot::at(row.t_s, -0.03 * top)).collect();
    let series = [
        Series::line("packet", Colour::SKY, events).stroked(Stroke::Events, 1),
        curve("|f_s|", Colour::VERMILION, 2, &|row| Some(row.f_s.norm())),
        curve("|f_m|", Colour::BLUE, 1, &|row| row.f_m.map(|f| f.norm())),
        curve("|f_s − f_m|", Colour::GREY, 1, &|row| {
            row.f_m.map(|f| (row.f_s - f).norm())
        }),
    ];
    let x = Axis::linear("time, s").over(*when.start()..*when.end());
    let y = Axis::linear("force, N").over(-0.1 * top..top);
    Panel::new(title, x, y, series)
}

/// The least and the largest value of each part of the rows, in the order in which they came.
fn envelope(rows: &[&TraceRow], of: &dyn Fn(&TraceRow) -> Option<f64>) -> Vec<Dot> {
    let mut dots = Vec::new();
    for part in rows.chunks(rows.len().div_ceil(PARTS).max(1)) {
        let values = part
            .iter()
            .filter_map(|row| Some(Dot::at(row.t_s, of(row)?)));
        let mut ends: Vec<Dot> = Vec::new();
        for dot in values {
            match ends.as_mut_slice() {
                [low, high] => {
                    if dot.y < low.y {
                        *low = dot;
                    } else if dot.y > high.y {
                        *high = dot;
                    }
                }
                _ => ends = vec![dot.clone(), dot],
            }
        }
        ends.sort_by(|a, b| a.x.total_cmp(&b.x));
        ends.dedup();
        dots.append(&mut ends);
    }
    dots
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::model::geometry::Vec2;

    #[test]
    fn the_envelope_keeps_every_peak() {
        let peak = |k: usize| if k == 12_345 { 9.0 } else { 1.0 };
        let rows: Vec<TraceRow> = (0..30_000)
            .map(|k| TraceRow {
                t_s: k as f64 * 1e-3,
                f_s: Vec2::new(peak(k), 0.0),
                f_m: None,
                update: None,
            })
            .collect();
        let shown: Vec<&TraceRow> = rows.iter().collect();
        let dots = envelope(&shown, &|row| Some(row.f_s.x));
        assert!(dots.len() <= 2 * PARTS && dots.is_sorted_by(|a, b| a.x <= b.x));
        assert!(dots.iter().any(|dot| dot.y == 9.0));
        assert!(envelope(&shown, &|_| None).is_empty());
    }
}
