//! The congestion figure: what a run measured and answered, over time.

use super::bins::{Bin, FROM_S, Group, UNTIL_S, per_second};
use crate::experiment::prelude::*;

/// Over time, seed 1.
pub(super) fn figure(groups: &[Group]) -> Figure {
    type Of = fn(&Bin) -> Option<f64>;
    let quantities: [(&str, &str, Of); 6] = [
        ("round trip", "ms", |bin| bin.round_trip_ms),
        ("Delta", "%", |bin| Some(bin.delta * 100.0)),
        ("T_update", "ms", |bin| Some(bin.t_update_ms)),
        ("commands", "1/s", |bin| Some(per_second(bin.commands))),
        ("messages, both ways", "1/s", |bin| {
            Some(per_second(bin.messages))
        }),
        ("sent up", "kbit/s", |bin| Some(bin.kbit_per_s(bin.bits_up))),
    ];
    let styles = [
        (Colour::VERMILION, Stroke::Dashed),
        (Colour::GREY, Stroke::Solid),
        (Colour::BLUE, Stroke::Solid),
    ];
    let panels = quantities.into_iter().map(|(what, unit, of)| {
        let bins = |group: &Group| -> Vec<Bin> {
            let first = group.runs.first().map(|run| run.bins.clone());
            first.unwrap_or_default()
        };
        let series = groups.iter().zip(styles);
        let series = series.map(|(group, (colour, stroke))| {
            let bins = bins(group).into_iter();
            let dots = bins.filter_map(|bin| Some(Dot::at(bin.t_s, of(&bin)?)));
            Series::line(group.case.name, colour, dots.collect()).stroked(stroke, 2)
        });
        let values = groups.iter().flat_map(bins);
        let most = values.filter_map(|bin| of(&bin)).fold(0.0, f64::max);
        let edges = [FROM_S, UNTIL_S].map(|t_s| Dot::at(t_s, most)).to_vec();
        let bottleneck = Series::line("", Colour::BLACK, edges).stroked(Stroke::Events, 1);
        Panel::new(
            what,
            Axis::linear("time, s"),
            Axis::linear(&format!("{what}, {unit}")),
            std::iter::once(bottleneck).chain(series),
        )
    });
    Figure::of_alike(panels, Legend::UpperRight, 2, (460, 240))
}
