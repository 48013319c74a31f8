//! Up to which delay each architecture is usable, and why not beyond.
//!
//! The rule by which an architecture is no longer usable stands here and nowhere else.

use super::Group;
use super::grid_point::STIFFNESSES;
use crate::architecture::Architecture;
use crate::table::{Table, column};

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
fn failing(group: &Group, peak_at_zero: f64) -> Option<Failing> {
    let breaks = group.median(|row| Some(row.breaks_per_push.unwrap_or(f64::MAX)))?;
    let peak = group.median(|row| row.force_peak_n)?;
    let mass = group.median(|row| row.apparent_mass_ratio);
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

/// How far one architecture is usable at one stiffness.
struct Limit {
    architecture: Architecture,
    k_p: u64,
    usable_to_ms: Option<u64>,
    failed: Option<(u64, Failing)>,
}

impl Limit {
    fn of(groups: &[Group], architecture: Architecture, k_p: u64) -> Self {
        let sweep = || {
            groups.iter().filter(move |group| {
                let point = &group.case;
                point.architecture == architecture && point.k_p == k_p && point.is_clean()
            })
        };
        let at_zero = sweep().find(|group| group.case.one_way_ms == 0);
        let peak = at_zero.and_then(|group| group.median(|row| row.force_peak_n));
        let failed = sweep().find_map(|group| {
            let why = failing(group, peak.unwrap_or(f64::INFINITY))?;
            Some((group.case.one_way_ms, why))
        });
        let delays = sweep().map(|group| group.case.one_way_ms);
        Self {
            architecture,
            k_p,
            usable_to_ms: delays
                .take_while(|ms| failed.is_none_or(|(at, _)| *ms < at))
                .last(),
            failed,
        }
    }
}

/// The greatest delay at which each architecture is usable, and the first at which it is not.
#[rustfmt::skip]
pub(super) fn table(groups: &[Group]) -> Table {
    let limits = Architecture::ALL
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
            column("why", "", 0, |limit| limit.failed.map(|(_, why)| why.words())),
        ],
    )
}
