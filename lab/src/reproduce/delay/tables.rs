//! What the runs of the delay experiment came to: a row a run, limits, replay's own numbers, the operator's picture.
//!
//! The rule by which an architecture is no longer usable stands here and nowhere else.

use super::Group;
use super::grid::{Loss, Place, STIFFNESSES};
use crate::architecture::{Architecture, DelayRow};
use crate::statistics::{Interval, median};
use crate::table::{Cell, Table};
use mmt_client::operator::scripted::Picture;
use mmt_shared::model::settings::PoseCorrection;

pub(super) fn runs(groups: &[Group]) -> Table {
    let mut table = Table::new(
        "Runs",
        &[
            ("architecture", 0),
            ("one_way_ms", 0),
            ("jitter_ms", 0),
            ("loss", 0),
            ("k_p", 0),
            ("seed", 0),
            ("packet_rate_hz", 1),
            ("wire_rate_hz", 1),
            ("pmse", 4),
            ("relative_error", 3),
            ("pose_rms_mm", 2),
            ("force_peak_n", 2),
            ("breaks_per_push", 2),
            ("energy_injected_j", 4),
            ("observer_min_j", 4),
            ("apparent_mass_ratio", 2),
            ("pushes", 0),
            ("wire_bytes_per_s", 0),
            ("playout_delay_ms", 1),
        ],
    );
    for (place, rows) in groups {
        for (row, seed) in rows.iter().zip(1_u64..) {
            table.push([
                Cell::from(place.architecture.name()),
                place.one_way_ms.into(),
                place.jitter_ms.into(),
                place.loss.name().into(),
                place.k_p.into(),
                seed.into(),
                row.packet_rate_hz.into(),
                row.wire_rate_hz.into(),
                row.pmse.into(),
                row.relative_error.into(),
                row.pose_rms_mm.into(),
                row.force_peak_n.into(),
                row.breaks_per_push.into(),
                row.energy_injected_j.into(),
                row.observer_min_j.into(),
                row.apparent_mass_ratio.into(),
                row.pushes.into(),
                row.wire_bytes_per_s.into(),
                row.playout_delay_ms.into(),
            ]);
        }
    }
    table
}

/// Why an architecture is no longer usable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Failing {
    Breaks,
    Peak,
    Mass,
}

impl Failing {
    fn words(self) -> &'static str {
        match self {
            Self::Breaks => "breaks per push > 2",
            Self::Peak => "force peak > 2 x that at zero delay",
            Self::Mass => "apparent mass > 1.5 x",
        }
    }
}

/// By the medians over the seeds; a run that completed no push counts as broken.
fn failing(rows: &[DelayRow], peak_at_zero: f64) -> Option<Failing> {
    let breaks = median(
        rows.iter()
            .map(|row| row.breaks_per_push.unwrap_or(f64::MAX)),
    )?;
    let peak = median(rows.iter().filter_map(|row| row.force_peak_n))?;
    let mass = median(rows.iter().filter_map(|row| row.apparent_mass_ratio));
    if breaks > 2.0 {
        Some(Failing::Breaks)
    } else if peak > 2.0 * peak_at_zero {
        Some(Failing::Peak)
    } else if mass.is_some_and(|mass| mass > 1.5) {
        Some(Failing::Mass)
    } else {
        None
    }
}

pub(super) fn is_clean(place: &Place) -> bool {
    place.jitter_ms == 0 && place.loss == Loss::None
}

/// The greatest delay at which each architecture is usable, and the first at which it is not.
pub(super) fn limits(groups: &[Group]) -> Table {
    let mut table = Table::new(
        "Usable up to which one-way delay (medians over the seeds; without jitter and loss)",
        &[
            ("architecture", 0),
            ("k_p", 0),
            ("usable_to_ms", 0),
            ("fails_at_ms", 0),
            ("why", 0),
        ],
    );
    for architecture in Architecture::ALL {
        for k_p in STIFFNESSES {
            let of = |group: &&Group| {
                group.0.architecture == architecture && group.0.k_p == k_p && is_clean(group.0)
            };
            let sweep: Vec<&Group> = groups.iter().filter(of).collect();
            let at_zero = sweep.iter().find(|group| group.0.one_way_ms == 0);
            let peak =
                at_zero.and_then(|group| median(group.1.iter().filter_map(|row| row.force_peak_n)));
            let failed = sweep.iter().find_map(|group| {
                failing(group.1, peak.unwrap_or(f64::INFINITY)).map(|why| (group.0.one_way_ms, why))
            });
            let usable = sweep
                .iter()
                .map(|group| group.0.one_way_ms)
                .take_while(|ms| failed.is_none_or(|(at, _)| *ms < at))
                .last();
            table.push([
                architecture.name().into(),
                k_p.into(),
                usable.into(),
                failed.map(|(at, _)| at).into(),
                failed.map(|(_, why)| why.words()).into(),
            ]);
        }
    }
    table
}

pub(super) fn mean(rows: &[DelayRow], of: impl Fn(&DelayRow) -> Option<f64>) -> Cell {
    Interval::of(rows.iter().filter_map(of))
        .map(|interval| interval.mean)
        .into()
}

fn largest(rows: &[DelayRow], of: impl Fn(&DelayRow) -> Option<f64>) -> Cell {
    rows.iter().filter_map(of).reduce(f64::max).into()
}

/// MMT with replay over everything that was tried.
pub(super) fn replayed(groups: &[Group]) -> Table {
    let mut table = Table::new(
        "MMT with replay: mean over the seeds; peak and energy the largest, observer the least",
        &[
            ("one_way_ms", 0),
            ("jitter_ms", 0),
            ("loss", 0),
            ("k_p", 0),
            ("packet_rate_hz", 2),
            ("relative_error", 3),
            ("pose_rms_mm", 2),
            ("force_peak_n", 2),
            ("breaks_per_push", 2),
            ("energy_injected_mj", 3),
            ("observer_min_mj", 3),
        ],
    );
    let replay = Architecture::Mediated(PoseCorrection::Replay);
    for (place, rows) in groups.iter().filter(|group| group.0.architecture == replay) {
        let least = rows.iter().map(|row| row.observer_min_j).reduce(f64::min);
        table.push([
            place.one_way_ms.into(),
            place.jitter_ms.into(),
            place.loss.name().into(),
            place.k_p.into(),
            mean(rows, |row| Some(row.packet_rate_hz)),
            mean(rows, |row| row.relative_error),
            mean(rows, |row| row.pose_rms_mm),
            largest(rows, |row| row.force_peak_n),
            mean(rows, |row| row.breaks_per_push),
            largest(rows, |row| row.energy_injected_j.map(|j| j * 1e3)),
            least.map(|j| j * 1e3).into(),
        ]);
    }
    table
}

pub(super) fn views(groups: &[Group]) -> Table {
    let mut table = Table::new(
        "What the operator looks at and knows of the size (MMT with replay): mean over the seeds",
        &[
            ("view", 0),
            ("size", 0),
            ("one_way_ms", 0),
            ("pushes", 1),
            ("pose_rms_mm", 2),
            ("breaks_per_push", 2),
            ("force_peak_n", 2),
            ("relative_error", 3),
        ],
    );
    for (place, rows) in groups {
        let view = match place.picture {
            Picture::Model => "model",
            Picture::Delayed => "delayed",
        };
        table.push([
            view.into(),
            place.size.name().into(),
            place.one_way_ms.into(),
            mean(rows, |row| Some(row.pushes as f64)),
            mean(rows, |row| row.pose_rms_mm),
            mean(rows, |row| row.breaks_per_push),
            mean(rows, |row| row.force_peak_n),
            mean(rows, |row| row.relative_error),
        ]);
    }
    table
}
