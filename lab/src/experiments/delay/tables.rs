//! What the runs of the delay experiment came to: a row a run, replay's own numbers, the operator's picture.

use mmt_client::operator::scripted::VisualFeedback;

use super::grid_point::Group;
use crate::architecture::ComparedArchitecture;
use crate::experiment::prelude::*;

/// A row a run.
#[rustfmt::skip]
pub(super) fn runs(groups: &[Group], first_seed: u64) -> Table {
    Table::of(
        "Runs",
        &grid::runs(groups, first_seed),
        &[
            column("architecture", "", 0, |run| run.case.architecture.name()),
            column("one_way_ms", "ms", 0, |run| run.case.one_way_ms),
            column("jitter_ms", "ms", 0, |run| run.case.jitter_ms),
            column("loss", "", 0, |run| run.case.loss.name),
            column("k_p", "N/m", 0, |run| run.case.k_p),
            column("seed", "", 0, |run| run.seed),
            column("packet_rate_hz", "Hz", 1, |run| run.measured.packet_rate_hz),
            column("wire_rate_hz", "Hz", 1, |run| run.measured.wire_rate_hz),
            column("pmse", "", 4, |run| run.measured.pmse),
            column("relative_error", "", 3, |run| run.measured.relative_error),
            column("pose_rms_mm", "mm", 2, |run| run.measured.pose_rms_mm),
            column("force_peak_n", "N", 2, |run| run.measured.force_peak_n),
            column("breaks_per_push", "", 2, |run| run.measured.breaks_per_push),
            column("energy_injected_j", "J", 4, |run| run.measured.energy_injected_j),
            column("observer_min_j", "J", 4, |run| run.measured.observer_min_j),
            column("apparent_mass_ratio", "", 2, |run| run.measured.apparent_mass_ratio),
            column("pushes", "", 0, |run| run.measured.pushes),
            column("wire_bytes_per_s", "B/s", 0, |run| run.measured.wire_bytes_per_s),
            column("playout_delay_ms", "ms", 1, |run| run.measured.playout_delay_ms),
            column("aligned_error", "", 3, |run| run.measured.aligned_error),
        ],
    )
}

/// MMT with replay over everything that was tried.
#[rustfmt::skip]
pub(super) fn replayed(groups: &[Group]) -> Table {
    let groups = groups.iter();
    Table::of(
        "MMT with replay: mean over the seeds; peak and energy the largest, observer the least",
        groups.filter(|group| group.case.architecture == ComparedArchitecture::REPLAY),
        &[
            column("one_way_ms", "ms", 0, |group| group.case.one_way_ms),
            column("jitter_ms", "ms", 0, |group| group.case.jitter_ms),
            column("loss", "", 0, |group| group.case.loss.name),
            column("k_p", "N/m", 0, |group| group.case.k_p),
            mean("packet_rate_hz", "Hz", 2, |row| Some(row.packet_rate_hz)),
            mean("relative_error", "", 3, |row| row.relative_error),
            mean("pose_rms_mm", "mm", 2, |row| row.pose_rms_mm),
            column("force_peak_n", "N", 2, |group| group.largest(|row| row.force_peak_n)),
            mean("breaks_per_push", "", 2, |row| row.breaks_per_push),
            column("energy_injected_mj", "mJ", 3, |group| group.largest(|row| Some(row.energy_injected_j? * 1e3))),
            column("observer_min_mj", "mJ", 3, |group| {
                let observed = group.runs.iter().map(|row| row.observer_min_j);
                observed.reduce(f64::min).map(|joule| joule * 1e3)
            }),
        ],
    )
}

/// What the operator looks at and knows.
pub(super) fn views(groups: &[Group]) -> Table {
    Table::of(
        "What the operator looks at and knows of the size (MMT with replay): mean over the seeds",
        groups,
        &[
            column("view", "", 0, |group| match group.case.visual_feedback {
                VisualFeedback::Model => "model",
                VisualFeedback::Delayed => "delayed",
            }),
            column("size", "", 0, |group| group.case.size.name()),
            column("one_way_ms", "ms", 0, |group| group.case.one_way_ms),
            mean("pushes", "", 1, |row| Some(row.pushes as f64)),
            mean("pose_rms_mm", "mm", 2, |row| row.pose_rms_mm),
            mean("breaks_per_push", "", 2, |row| row.breaks_per_push),
            mean("force_peak_n", "N", 2, |row| row.force_peak_n),
            mean("relative_error", "", 3, |row| row.relative_error),
        ],
    )
}
