//! Up to which delay each architecture is usable, and why not beyond.
//!
//! The rule by which an architecture is no longer usable stands here and nowhere else.

use super::grid_point::{Group, STIFFNESSES, sweep};
use crate::architecture::ComparedArchitecture;
use crate::experiment::prelude::*;

/// More breaks of contact per push than this are no contact.
pub(super) const BREAKS_MAX: f64 = 2.0;

/// Why an architecture is no longer usable, if it is not: by the medians over the seeds. A run that completed no push
/// counts as broken.
fn failing(group: &Group, peak_at_zero: f64) -> Option<&'static str> {
    let breaks = group.median(|row| Some(row.breaks_per_push.unwrap_or(f64::MAX)))?;
    let peak = group.median(|row| row.force_peak_n)?;
    let mass = group.median(|row| row.apparent_mass_ratio);
    if breaks > BREAKS_MAX {
        Some("breaks per push > 2")
    } else if peak > 2.0 * peak_at_zero {
        Some("force peak > 2 x that at zero delay")
    } else if mass.is_some_and(|mass| mass > 1.5) {
        Some("apparent mass > 1.5 x")
    } else {
        None
    }
}

/// How far one architecture is usable at one stiffness.
struct Limit {
    architecture: ComparedArchitecture,
    k_p: u64,
    usable_to_ms: Option<u64>,
    failed: Option<(u64, &'static str)>,
}

impl Limit {
    fn of(groups: &[Group], architecture: ComparedArchitecture, k_p: u64) -> Self {
        let sweep = || sweep(groups, architecture, k_p);
        let at_zero = sweep().find(|group| group.case.one_way_ms == 0);
        let peak = at_zero.and_then(|group| group.median(|row| row.force_peak_n));
        let failed = sweep().find_map(|group| {
            let why = failing(group, peak.unwrap_or(f64::INFINITY))?;
            Some((group.case.one_way_ms, why))
        });
        let delays = sweep().map(|group| group.case.one_way_ms);
        let usable = delays.take_while(|ms| failed.is_none_or(|(at, _)| *ms < at));
        Self {
            architecture,
            k_p,
            usable_to_ms: usable.last(),
            failed,
        }
    }
}

/// The greatest delay at which each architecture is usable, and the first at which it is not.
#[rustfmt::skip]
pub(super) fn table(groups: &[Group]) -> Table {
    let limits = ComparedArchitecture::ALL
        .into_iter()
        .flat_map(|of| STIFFNESSES.map(|k_p| Limit::of(groups, of, k_p)));
    Table::of(
        "Usable up to which one-way delay (medians over the seeds; without jitter and loss)",
        &limits.collect::<Vec<_>>(),
        &[
            column("architecture", "", 0, |limit| limit.architecture.name()),
            column("k_p", "N/m", 0, |limit| limit.k_p),
            column("usable_to_ms", "ms", 0, |limit| limit.usable_to_ms),
            column("fails_at_ms", "ms", 0, |limit| limit.failed.map(|(at, _)| at)),
            column("why", "", 0, |limit| limit.failed.map(|(_, why)| why)),
        ],
    )
}
