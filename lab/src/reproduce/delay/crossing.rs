//! Where position–force with passivity control and the local model cross.
//!
//! Short delays in narrow steps for the two; the rest of the sweep is too coarse there. What is said of
//! the crossing is read off these runs and must never be written down from elsewhere.

use crate::baselines::Baseline;
use mmt_shared::model::settings::PoseCorrection;

use super::{Group, Place, mean, run};
use crate::architecture::{Architecture, DelayRow};
use crate::reproduce::{Extent, Laboratory, ReproduceError};
use crate::statistics::median;
use crate::table::{Cell, Table};

/// One-way delays, ms.
const NEAR_MS: [u64; 8] = [0, 2, 5, 7, 10, 14, 20, 50];
/// Virtual stiffness k_p, N/m.
const STIFFNESSES: [u64; 2] = [1000, 3000];

const TDPA: Architecture = Architecture::Bilateral(Baseline::Tdpa);
const REPLAY: Architecture = Architecture::Mediated(PoseCorrection::Replay);

/// Runs the short delays and keeps `delay-crossing.csv`; its table, and one of where they cross.
///
/// # Errors
/// As [`Laboratory::duel`] and [`Laboratory::keep`].
pub(super) fn reproduce(
    laboratory: &dyn Laboratory,
    extent: Extent,
) -> Result<[Table; 2], ReproduceError> {
    let place = |k_p, architecture, one_way_ms| Place {
        k_p,
        ..Place::plain(architecture, one_way_ms)
    };
    let mut places = Vec::new();
    for k_p in STIFFNESSES {
        for architecture in [TDPA, REPLAY] {
            places.extend(NEAR_MS.map(|ms| place(k_p, architecture, ms)));
        }
    }
    let rows = run(laboratory, "delay-crossing", &places, extent)?;
    let seeds = extent.seeds.max(1) as usize;
    let groups: Vec<Group> = places.iter().zip(rows.chunks(seeds)).collect();
    let near = near(&groups);
    laboratory.keep("delay-crossing.csv", &near.to_csv())?;
    Ok([near, crossings(&groups)])
}

fn near(groups: &[Group]) -> Table {
    let mut table = Table::new(
        "TDPA and the model at short delays: mean over the seeds",
        &[
            ("k_p", 0),
            ("architecture", 0),
            ("one_way_ms", 0),
            ("relative_error", 3),
            ("apparent_mass_ratio", 2),
            ("breaks_per_push", 2),
            ("force_peak_n", 2),
            ("packet_rate_hz", 1),
        ],
    );
    for (place, rows) in groups {
        table.push([
            place.k_p.into(),
            place.architecture.name().into(),
            place.one_way_ms.into(),
            mean(rows, |row| row.relative_error),
            mean(rows, |row| row.apparent_mass_ratio),
            mean(rows, |row| row.breaks_per_push),
            mean(rows, |row| row.force_peak_n),
            mean(rows, |row| Some(row.packet_rate_hz)),
        ]);
    }
    table
}

/// The delays from which on the model is nearer, by two measures: the medians over the seeds, interpolated.
fn crossings(groups: &[Group]) -> Table {
    let mut table = Table::new(
        "From which one-way delay on the model is nearer than TDPA (medians over the seeds, interpolated)",
        &[("k_p", 0), ("by", 0), ("crossing_ms", 1)],
    );
    type Measure = (&'static str, fn(&DelayRow) -> Option<f64>);
    let measures: [Measure; 2] = [
        ("relative error", |row| row.relative_error),
        ("distance of the apparent mass from 1", |row| {
            row.apparent_mass_ratio.map(|ratio| (ratio - 1.0).abs())
        }),
    ];
    for k_p in STIFFNESSES {
        for (name, of) in measures {
            let curve = |architecture: Architecture| -> Vec<(f64, f64)> {
                let here = groups
                    .iter()
                    .filter(|(place, _)| place.architecture == architecture && place.k_p == k_p);
                here.filter_map(|(place, rows)| {
                    let value = median(rows.iter().filter_map(of))?;
                    Some((place.one_way_ms as f64, value))
                })
                .collect()
            };
            let crossing = crossing(&curve(TDPA), &curve(REPLAY));
            table.push([k_p.into(), name.into(), Cell::from(crossing)]);
        }
    }
    table
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
