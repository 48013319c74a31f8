//! The delay figure: breaks, force, error and packets of every architecture over the delay.
//!
//! Medians over the seeds of the clean runs at k_p 1000; it leaves out no delay.

use mmt_shared::model::settings::PoseCorrection;

use super::grid_point::{Group, sweep};
use crate::architecture::{ComparedArchitecture, DelayRow};
use crate::baselines::Baseline;
use crate::experiment::prelude::*;

/// Four measures over the delay, one curve an architecture; zero delay stands at half a millisecond.
pub(super) fn figure(groups: &[Group]) -> Figure {
    type Measure = (&'static str, fn(&DelayRow) -> Option<f64>, Axis);
    #[rustfmt::skip]
    let measures: [Measure; 4] = [
        ("contact breaks per push", |row| row.breaks_per_push, Axis::log("breaks per push")),
        ("largest force on the hand", |row| row.force_peak_n, Axis::linear("force, N")),
        ("relative force error", |row| row.relative_error, Axis::log("relative error")),
        ("packets from slave to master", |row| Some(row.packet_rate_hz), Axis::log("packets per second")),
    ];
    let panels = measures.into_iter().map(|(title, of, y)| {
        let series = ComparedArchitecture::ALL.into_iter().map(|architecture| {
            let dots = sweep(groups, architecture, 1000).filter_map(|group| {
                let one_way_ms = group.case.one_way_ms as f64;
                Some(Dot::at(one_way_ms.max(0.5), group.median(of)?))
            });
            line(architecture, dots.collect())
        });
        let x = Axis::log("one-way delay, ms (none at 0.5)");
        Panel::new(title, x, y, series)
    });
    Figure::of_alike(panels, Legend::UpperLeft, 2, (560, 400))
}

/// An architecture's curve: a force on the wire is dashed, a model solid.
pub(super) fn line(architecture: ComparedArchitecture, dots: Vec<Dot>) -> Series {
    let (colour, width) = colour_and_width(architecture);
    let line = Series::line(architecture.name(), colour, dots);
    match architecture {
        ComparedArchitecture::Bilateral(Baseline::DampedPositionForce) => {
            line.marked(Mark::Triangle).stroked(Stroke::Dashed, width)
        }
        ComparedArchitecture::Bilateral(_) => {
            line.marked(Mark::Square).stroked(Stroke::Dashed, width)
        }
        ComparedArchitecture::Mediated(_) => {
            line.marked(Mark::Circle).stroked(Stroke::Solid, width)
        }
    }
}

/// The default is thick.
fn colour_and_width(architecture: ComparedArchitecture) -> (Colour, u32) {
    match architecture {
        ComparedArchitecture::Bilateral(Baseline::PositionForce) => (Colour::BLUE, 1),
        ComparedArchitecture::Bilateral(Baseline::DampedPositionForce) => (Colour::BLUE, 1),
        ComparedArchitecture::Bilateral(Baseline::DeadbandForce) => (Colour::VERMILION, 1),
        ComparedArchitecture::Bilateral(Baseline::Tdpa) => (Colour::GREEN, 1),
        ComparedArchitecture::Bilateral(Baseline::TdpaDeadband) => (Colour::PURPLE, 1),
        ComparedArchitecture::Bilateral(Baseline::Waves) => (Colour::ORANGE, 1),
        ComparedArchitecture::Mediated(PoseCorrection::Snap) => (Colour::SKY, 1),
        ComparedArchitecture::Mediated(PoseCorrection::MatchedStamps) => (Colour::GREY, 1),
        ComparedArchitecture::Mediated(PoseCorrection::Replay) => (Colour::BLACK, 3),
    }
}
