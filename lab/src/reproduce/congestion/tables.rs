//! What the runs came to: a row a bin, and the phases before, during and after congestion.

use super::grid::{AFTER_S, FROM_S, UNTIL_S};
use super::run::{BIN, Bin, Variant, per_second};
use crate::statistics::{Interval, median};
use crate::table::{Cell, Table};

/// Every bin of every run.
pub(super) fn bins(variants: &[Variant]) -> Table {
    let mut table = Table::new(
        "Congestion, bin by bin",
        &[
            ("answers", 0),
            ("seed", 0),
            ("t_s", 2),
            ("round_trip_ms", 1),
            ("delta", 3),
            ("t_update_ms", 0),
            ("commands_hz", 0),
            ("updates_hz", 0),
            ("messages_hz", 0),
            ("kbit_up_per_s", 1),
            ("kbit_down_per_s", 1),
            ("dropped", 0),
            ("relative_error", 3),
        ],
    );
    for (name, _, runs) in variants {
        for (seed, run) in (1_u64..).zip(runs) {
            for bin in &run.bins {
                let [up, down] = bin.bits.map(|bits| bits / BIN.as_secs_f64() * 1e-3);
                table.push([
                    Cell::from(*name),
                    seed.into(),
                    bin.t_s.into(),
                    bin.round_trip_ms.into(),
                    bin.delta.into(),
                    bin.t_update_ms.into(),
                    per_second(bin.commands).into(),
                    per_second(bin.updates).into(),
                    per_second(bin.messages).into(),
                    up.into(),
                    down.into(),
                    bin.dropped.into(),
                    bin.relative_error().into(),
                ]);
            }
        }
    }
    table
}

/// Before, during and after congestion, as means over the seeds.
pub(super) fn phases(variants: &[Variant]) -> Table {
    let mut table = Table::new(
        "64 kbit/s each way from 10 to 25 s: round trip, traffic and force error, means over the seeds",
        &[
            ("answers", 0),
            ("phase", 0),
            ("round_trip_p50_ms", 0),
            ("round_trip_max_ms", 0),
            ("delta_max", 2),
            ("t_update_max_ms", 0),
            ("commands_hz", 1),
            ("updates_hz", 1),
            ("messages_hz", 1),
            ("kbit_up_per_s", 1),
            ("kbit_down_per_s", 1),
            ("dropped", 0),
            ("known_share", 3),
            ("relative_error", 3),
        ],
    );
    let phases = [
        ("before", 0.0..FROM_S),
        ("congested", FROM_S..UNTIL_S),
        ("returning", UNTIL_S..AFTER_S),
        ("after", AFTER_S..f64::INFINITY),
    ];
    for (phase, when) in phases {
        for (name, _, runs) in variants {
            let of = runs.iter().map(|run| {
                let bins = run.bins.iter();
                // a bin is named after its end
                let bins = bins.filter(|bin| bin.t_s > when.start && bin.t_s <= when.end);
                bins.copied().collect::<Vec<Bin>>()
            });
            let of: Vec<Vec<Bin>> = of.filter(|bins| !bins.is_empty()).collect();
            table.push(phase_row(name, phase, &of));
        }
    }
    table
}

fn phase_row(name: &str, phase: &str, runs: &[Vec<Bin>]) -> Vec<Cell> {
    let mean = |of: &dyn Fn(&[Bin]) -> Option<f64>| {
        let values = runs.iter().filter_map(|bins| of(bins));
        Cell::from(Interval::of(values).map(|interval| interval.mean))
    };
    let most =
        |bins: &[Bin], of: &dyn Fn(&Bin) -> f64| Some(bins.iter().map(of).fold(0.0, f64::max));
    let rate = |bins: &[Bin], of: &dyn Fn(&Bin) -> f64| {
        let seconds = bins.len() as f64 * BIN.as_secs_f64();
        Some(bins.iter().map(of).sum::<f64>() / seconds)
    };
    let share = |bins: &[Bin], of: &dyn Fn(&Bin) -> (f64, f64)| {
        let (part, whole) = bins
            .iter()
            .map(of)
            .fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
        (whole > 0.0).then_some(part / whole)
    };
    let up = |bin: &Bin| bin.bits.first().copied().unwrap_or_default() * 1e-3;
    let down = |bin: &Bin| bin.bits.last().copied().unwrap_or_default() * 1e-3;
    vec![
        name.into(),
        phase.into(),
        mean(&|bins| median(bins.iter().filter_map(|bin| bin.round_trip_ms))),
        mean(&|bins| most(bins, &|bin| bin.round_trip_ms.unwrap_or_default())),
        mean(&|bins| most(bins, &|bin| bin.delta)),
        mean(&|bins| most(bins, &|bin| bin.t_update_ms)),
        mean(&|bins| rate(bins, &|bin| bin.commands as f64)),
        mean(&|bins| rate(bins, &|bin| bin.updates as f64)),
        mean(&|bins| rate(bins, &|bin| bin.messages as f64)),
        mean(&|bins| rate(bins, &up)),
        mean(&|bins| rate(bins, &down)),
        mean(&|bins| Some(bins.iter().map(|bin| bin.dropped as f64).sum())),
        mean(&|bins| share(bins, &|bin| (bin.pairs as f64, bin.ticks as f64))),
        mean(&|bins| share(bins, &|bin| bin.error).map(libm::sqrt)),
    ]
}
