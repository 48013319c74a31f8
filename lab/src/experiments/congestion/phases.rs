//! What the runs came to before, during and after congestion, as means over the seeds.

use mmt_shared::stats::values::median;

use super::bins::{AFTER_S, BIN, Bin, FROM_S, Group, UNTIL_S};
use crate::experiment::prelude::*;

/// The name of who answers and the phase, with the bins of each run in that phase.
type Phase = grid::Group<(&'static str, &'static str), Vec<Bin>>;

pub(super) fn table(groups: &[Group]) -> Table {
    let phases = [
        ("before", 0.0..FROM_S),
        ("congested", FROM_S..UNTIL_S),
        ("returning", UNTIL_S..AFTER_S),
        ("after", AFTER_S..f64::INFINITY),
    ];
    let mut rows = Vec::new();
    for (phase, when) in phases {
        rows.extend(groups.iter().map(|group| {
            let of = group.runs.iter().map(|run| {
                // a bin is named after its end
                let bins = run.bins.iter();
                let bins = bins.filter(|bin| bin.t_s > when.start && bin.t_s <= when.end);
                bins.copied().collect::<Vec<Bin>>()
            });
            Phase {
                case: (group.case.name, phase),
                runs: of.filter(|bins| !bins.is_empty()).collect(),
            }
        }));
    }
    let title = "64 kbit/s each way from 10 to 25 s: round trip, traffic and force error, means over the seeds";
    Table::of(title, &rows, &columns())
}

#[rustfmt::skip]
fn columns<'a>() -> [Column<'a, Phase>; 14] {
    [
        column("answers", "", 0, |phase| phase.case.0),
        column("phase", "", 0, |phase| phase.case.1),
        mean("round_trip_p50_ms", "ms", 0, |bins| median(bins.iter().filter_map(|bin| bin.round_trip_ms))),
        mean("round_trip_max_ms", "ms", 0, |bins| most(bins, |bin| bin.round_trip_ms.unwrap_or_default())),
        mean("delta_max", "", 2, |bins| most(bins, |bin| bin.delta)),
        mean("t_update_max_ms", "ms", 0, |bins| most(bins, |bin| bin.t_update_ms)),
        mean("commands_hz", "Hz", 1, |bins| rate(bins, |bin| bin.commands as f64)),
        mean("updates_hz", "Hz", 1, |bins| rate(bins, |bin| bin.updates as f64)),
        mean("messages_hz", "Hz", 1, |bins| rate(bins, |bin| bin.messages as f64)),
        mean("kbit_up_per_s", "kbit/s", 1, |bins| rate(bins, |bin| bin.bits_up * 1e-3)),
        mean("kbit_down_per_s", "kbit/s", 1, |bins| rate(bins, |bin| bin.bits_down * 1e-3)),
        mean("dropped", "", 0, |bins| Some(bins.iter().map(|bin| bin.dropped as f64).sum())),
        mean("known_share", "", 3, |bins| share(bins, |bin| (bin.pairs as f64, bin.ticks as f64))),
        mean("relative_error", "", 3, |bins| share(bins, |bin| bin.error).map(libm::sqrt)),
    ]
}

fn most(bins: &[Bin], of: fn(&Bin) -> f64) -> Option<f64> {
    Some(bins.iter().map(of).fold(0.0, f64::max))
}

fn rate(bins: &[Bin], of: fn(&Bin) -> f64) -> Option<f64> {
    let seconds = bins.len() as f64 * BIN.as_secs_f64();
    Some(bins.iter().map(of).sum::<f64>() / seconds)
}

/// A sum over another; none if that is zero.
fn share(bins: &[Bin], of: fn(&Bin) -> (f64, f64)) -> Option<f64> {
    let add = |(a, b), (c, d)| (a + c, b + d);
    let (part, whole) = bins.iter().map(of).fold((0.0, 0.0), add);
    (whole > 0.0).then_some(part / whole)
}
