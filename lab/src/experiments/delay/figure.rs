//! The delay figure: breaks, force, error and packets of every architecture over the delay.
//!
//! Medians over the seeds of the clean runs at k_p 1000; it leaves out no delay.

use super::Group;
use crate::architecture::{Architecture, DelayRow};
use crate::figure::{Axis, Colour, Dot, Figure, Legend, Mark, Panel, Series, Stroke};
use mmt_shared::model::settings::PoseCorrection;

/// Four measures over the delay, one curve an architecture; zero delay stands at half a millisecond.
pub(super) fn figure(groups: &[Group]) -> Figure {
    type Measure = (&'static str, fn(&DelayRow) -> Option<f64>, Axis);
    let measures: [Measure; 4] = [
        (
            "contact breaks per push",
            |row| row.breaks_per_push,
            Axis::log("breaks per push"),
        ),
        (
            "largest force on the hand",
            |row| row.force_peak_n,
            Axis::linear("force, N"),
        ),
        (
            "relative force error",
            |row| row.relative_error,
            Axis::log("relative error"),
        ),
        (
            "packets from slave to master",
            |row| Some(row.packet_rate_hz),
            Axis::log("packets per second"),
        ),
    ];
    let panels = measures.into_iter().map(|(title, of, y)| {
        let series = Architecture::ALL
            .into_iter()
            .enumerate()
            .map(|(k, architecture)| {
                let (stroke, mark, colour, width) = look(k, architecture);
                let here = groups.iter().filter(|group| {
                    let point = &group.case;
                    point.architecture == architecture && point.k_p == 1000 && point.is_clean()
                });
                let dots = here.filter_map(|group| {
                    let one_way_ms = group.case.one_way_ms as f64;
                    Some(Dot::at(one_way_ms.max(0.5), group.median(of)?))
                });
                Series::line(architecture.name(), colour, dots.collect())
                    .marked(mark)
                    .stroked(stroke, width)
            });
        let x = Axis::log("one-way delay, ms (none at 0.5)");
        Panel::new(title, x, y, series)
    });
    Figure::of_alike(panels, Legend::UpperLeft, 2, (560, 400))
}

/// How an architecture is drawn: forces on the wire dashed, models solid, the default thick.
fn look(k: usize, architecture: Architecture) -> (Stroke, Mark, Colour, u32) {
    match architecture {
        Architecture::Bilateral(_) => (Stroke::Dashed, Mark::Square, Colour::nth(k), 1),
        Architecture::Mediated(PoseCorrection::Snap) => {
            (Stroke::Solid, Mark::Circle, Colour::Sky, 1)
        }
        Architecture::Mediated(PoseCorrection::MatchedStamps) => {
            (Stroke::Solid, Mark::Circle, Colour::Grey, 1)
        }
        Architecture::Mediated(PoseCorrection::Replay) => {
            (Stroke::Solid, Mark::Circle, Colour::Black, 3)
        }
    }
}
