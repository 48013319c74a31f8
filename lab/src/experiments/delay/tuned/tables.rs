//! What the tuned architectures came to: each beside itself untuned, and which is the nearest to the object at each delay.

use super::judged::Judged;
use crate::architecture::{ComparedArchitecture, DelayRow};
use crate::experiment::prelude::*;
use crate::experiments::delay::choices::number;
use crate::experiments::delay::tuning::{Tried, error, keeps_contact};

/// A row a value that was tried.
#[rustfmt::skip]
pub(super) fn choices(tried: &[Tried], judged: &[Judged<'_>]) -> Table {
    Table::of(
        "Values tried",
        tried,
        &[
            column("architecture", "", 0, |tried: &Tried| tried.case.point.architecture.name()),
            column("one_way_ms", "ms", 0, |tried| tried.case.point.one_way_ms),
            column("number", "", 0, |tried| number(tried.case.point.architecture).name),
            column("value", "", 2, |tried| tried.case.value),
            column("seeds", "", 0, |tried| tried.runs.len() as u64),
            column("relative_error", "", 3, error),
            mean("aligned_error", "", 3, |row| row.aligned_error),
            mean("breaks_per_push", "", 2, |row| row.breaks_per_push),
            Column::new("is_chosen", "", 0, |tried: &Tried| {
                u64::from(judged.iter().any(|judged| judged.tuned.case == tried.case)).into()
            }),
        ],
    )
}

/// A row a run of a judged value.
#[rustfmt::skip]
pub(super) fn runs(groups: &[Tried], judged: &[Judged<'_>], first_seed: u64) -> Table {
    Table::of(
        "Runs",
        &grid::runs(groups, first_seed),
        &[
            column("architecture", "", 0, |run| run.case.point.architecture.name()),
            column("one_way_ms", "ms", 0, |run| run.case.point.one_way_ms),
            column("number", "", 0, |run| number(run.case.point.architecture).name),
            column("value", "", 2, |run| run.case.value),
            Column::new("is_default", "", 0, |run: &grid::Run<'_, _, DelayRow>| {
                u64::from(judged.iter().any(|judged| judged.untuned.case == *run.case)).into()
            }),
            Column::new("is_tuned", "", 0, |run: &grid::Run<'_, _, DelayRow>| {
                u64::from(judged.iter().any(|judged| judged.tuned.case == *run.case)).into()
            }),
            column("seed", "", 0, |run| run.seed),
            column("relative_error", "", 3, |run| run.measured.relative_error),
            column("aligned_error", "", 3, |run| run.measured.aligned_error),
            column("breaks_per_push", "", 2, |run| run.measured.breaks_per_push),
            column("apparent_mass_ratio", "", 2, |run| run.measured.apparent_mass_ratio),
            column("force_peak_n", "N", 2, |run| run.measured.force_peak_n),
            column("packet_rate_hz", "Hz", 1, |run| run.measured.packet_rate_hz),
            column("pushes", "", 0, |run| run.measured.pushes),
        ],
    )
}

/// Every architecture at every delay, untuned and tuned.
#[rustfmt::skip]
pub(super) fn at_their_best(judged: &[Judged<'_>]) -> Table {
    let mut columns = vec![
        column("architecture", "", 0, |judged: &Judged<'_>| judged.point().architecture.name()),
        column("one_way_ms", "ms", 0, |judged| judged.point().one_way_ms),
        column("number", "", 0, |judged| number(judged.point().architecture).name),
        column("value", "", 2, |judged| judged.tuned.case.value),
        column("untuned_error", "", 3, |judged| judged.untuned.mean(|row| row.relative_error)),
    ];
    columns.extend(interval(["relative_error", "low", "high"], "", 3, |judged: &Judged<'_>| {
        judged.tuned.interval(|row| row.relative_error)
    }));
    columns.extend(interval(["aligned_error", "aligned_low", "aligned_high"], "", 3, |judged: &Judged<'_>| {
        judged.tuned.interval(|row| row.aligned_error)
    }));
    columns.extend([
        column("breaks_per_push", "", 2, |judged: &Judged<'_>| judged.tuned.mean(|row| row.breaks_per_push)),
        column("untuned_breaks", "", 2, |judged| judged.untuned.mean(|row| row.breaks_per_push)),
    ]);
    columns.extend(interval(["apparent_mass_ratio", "mass_low", "mass_high"], "", 2, |judged: &Judged<'_>| {
        judged.tuned.interval(|row| row.apparent_mass_ratio)
    }));
    columns.push(column("packet_rate_hz", "Hz", 1, |judged| judged.tuned.mean(|row| Some(row.packet_rate_hz))));
    Table::of("Architectures at their best: mean over the seeds that judge, with 95 % intervals", judged, &columns)
}

/// A measure that is the better the smaller it is.
type Measure = (&'static str, fn(&DelayRow) -> Option<f64>);

/// What the architectures are compared by.
const MEASURES: [Measure; 3] = [
    ("relative error", |row| row.relative_error),
    ("aligned error", |row| row.aligned_error),
    ("distance of the apparent mass from 1", |row| {
        Some((row.apparent_mass_ratio? - 1.0).abs())
    }),
];

/// The nearest of the tuned architectures at a delay, beside MMT with replay.
struct Nearest<'a> {
    one_way_ms: u64,
    measure: Measure,
    nearest: &'a Tried,
    replay: &'a Tried,
}

impl Nearest<'_> {
    fn interval(&self, of: &Tried) -> Option<Interval> {
        of.interval(self.measure.1)
    }
}

/// Which architecture is the nearest to the object by each measure: of those that keep contact.
#[rustfmt::skip]
pub(super) fn nearest(judged: &[Judged<'_>], delays_ms: &[u64]) -> Table {
    let mut rows = Vec::new();
    for measure in MEASURES {
        rows.extend(delays_ms.iter().filter_map(|ms| of_delay(judged, *ms, measure)));
    }
    let mut columns = vec![
        column("by", "", 0, |at: &Nearest<'_>| at.measure.0),
        column("one_way_ms", "ms", 0, |at| at.one_way_ms),
        column("nearest", "", 0, |at| at.nearest.case.point.architecture.name()),
    ];
    columns.extend(interval(["of_it", "low", "high"], "", 3, |at: &Nearest<'_>| at.interval(at.nearest)));
    columns.extend(interval(["mmt_replay", "mmt_low", "mmt_high"], "", 3, |at: &Nearest<'_>| at.interval(at.replay)));
    Table::of("The nearest to the object at each delay, of the tuned architectures with at most 2 breaks a push", &rows, &columns)
}

fn of_delay<'a>(judged: &[Judged<'a>], one_way_ms: u64, measure: Measure) -> Option<Nearest<'a>> {
    let here = || {
        judged
            .iter()
            .filter(move |judged| judged.point().one_way_ms == one_way_ms)
    };
    let replay =
        here().find(|judged| judged.point().architecture == ComparedArchitecture::REPLAY)?;
    let kept = here().filter(|judged| keeps_contact(judged.tuned));
    let measured = kept.filter_map(|judged| Some((judged.tuned, judged.tuned.mean(measure.1)?)));
    let (nearest, _) = measured.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
    Some(Nearest {
        one_way_ms,
        measure,
        nearest,
        replay: replay.tuned,
    })
}
