//! Where position–force with passivity control and the local model cross.
//!
//! Short delays in narrow steps for the two; the rest of the sweep is too coarse there. What is written of the
//! crossing is read off these runs and must never be written down from elsewhere.

use super::grid_point::{GridPoint, Group, sweep};
use crate::architecture::{ComparedArchitecture, DelayRow};
use crate::experiment::prelude::*;

/// One-way delays, ms.
const NEAR_MS: [u64; 8] = [0, 2, 5, 7, 10, 14, 20, 50];
/// Virtual stiffness k_p, N/m.
const STIFFNESSES: [u64; 2] = [1000, 3000];

/// The short delays.
pub(super) fn points() -> Vec<GridPoint> {
    let mut points = Vec::new();
    for k_p in STIFFNESSES {
        for architecture in [ComparedArchitecture::TDPA, ComparedArchitecture::REPLAY] {
            points.extend(NEAR_MS.map(|one_way_ms| GridPoint {
                k_p,
                ..GridPoint::plain(architecture, one_way_ms)
            }));
        }
    }
    points
}

/// The runs at the short delays, and where the two cross.
#[rustfmt::skip]
pub(super) fn tables(groups: &[Group]) -> [Table; 2] {
    let near = Table::of(
        "TDPA and the model at short delays: mean over the seeds",
        groups,
        &[
            column("k_p", "N/m", 0, |group| group.case.k_p),
            column("architecture", "", 0, |group| group.case.architecture.name()),
            column("one_way_ms", "ms", 0, |group| group.case.one_way_ms),
            mean("relative_error", "", 3, |row| row.relative_error),
            mean("apparent_mass_ratio", "", 2, |row| row.apparent_mass_ratio),
            mean("breaks_per_push", "", 2, |row| row.breaks_per_push),
            mean("force_peak_n", "N", 2, |row| row.force_peak_n),
            mean("packet_rate_hz", "Hz", 1, |row| Some(row.packet_rate_hz)),
        ],
    );
    let crossings = Table::of(
        "From which one-way delay on the model is nearer than TDPA (medians over the seeds, interpolated)",
        &crossings(groups),
        &[
            column("k_p", "N/m", 0, |at| at.k_p),
            column("by", "", 0, |at| at.by),
            column("crossing_ms", "ms", 1, |at| at.crossing_ms),
        ],
    );
    [near, crossings]
}

/// The delay from which on the model is nearer, by one measure.
struct Crossing {
    k_p: u64,
    by: &'static str,
    crossing_ms: Option<f64>,
}

fn crossings(groups: &[Group]) -> Vec<Crossing> {
    type Measure = (&'static str, fn(&DelayRow) -> Option<f64>);
    let measures: [Measure; 2] = [
        ("relative error", |row| row.relative_error),
        ("distance of the apparent mass from 1", |row| {
            Some((row.apparent_mass_ratio? - 1.0).abs())
        }),
    ];
    let at = |k_p: u64, (by, of): Measure| {
        let curve = |architecture| -> Vec<(f64, f64)> {
            let dots = sweep(groups, architecture, k_p)
                .map(|group| Some((group.case.one_way_ms as f64, group.median(of)?)));
            dots.flatten().collect()
        };
        Crossing {
            k_p,
            by,
            crossing_ms: crossing(
                &curve(ComparedArchitecture::TDPA),
                &curve(ComparedArchitecture::REPLAY),
            ),
        }
    };
    let all = STIFFNESSES.into_iter();
    all.flat_map(|k_p| measures.map(|measure| at(k_p, measure)))
        .collect()
}

/// The first abscissa from which on `rising` lies above `other` at the next point, linear between the points; absent
/// if it never does. Points of one that the other lacks do not count.
fn crossing(rising: &[(f64, f64)], other: &[(f64, f64)]) -> Option<f64> {
    let above: Vec<(f64, f64)> = rising
        .iter()
        .filter_map(|(x, y)| {
            let (_, there) = other.iter().find(|(at, _)| at == x)?;
            Some((*x, y - there))
        })
        .collect();
    let (first_x, first) = *above.first()?;
    if first > 0.0 {
        return Some(first_x);
    }
    above.windows(2).find_map(|pair| match pair {
        [(from, below), (to, over)] if *over > 0.0 => {
            Some(from + (to - from) * (-below / (over - below)))
        }
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_cross_where_they_do_and_absent_points_do_not_count() {
        let rising = [(0.0, 0.0), (2.0, 1.0), (4.0, 9.0), (8.0, 4.0)];
        let level = [(0.0, 2.0), (4.0, 2.0), (8.0, 2.0)];
        // 2 below at 0, 7 above at 4
        let at = crossing(&rising, &level).unwrap();
        assert!((at - 4.0 * 2.0 / 9.0).abs() < 1e-12);
        assert_eq!(crossing(&level, &rising[..1]), Some(0.0));
        assert_eq!(crossing(&rising[..2], &level), None);
        assert_eq!(crossing(&[], &level), None);
    }
}
