//! The congestion figure: what a run measured and answered, over time.

use super::grid::{FROM_S, UNTIL_S};
use super::run::{BIN, Bin, Variant, per_second};
use crate::figure::{Axis, Colour, Dot, Figure, Legend, Panel, Series, Stroke};

/// Over time, seed 1.
pub(super) fn figure(variants: &[Variant]) -> Figure {
    type Of = fn(&Bin) -> Option<f64>;
    let quantities: [(&str, &str, Of); 6] = [
        ("round trip", "ms", |bin| bin.round_trip_ms),
        ("Delta", "%", |bin| Some(bin.delta * 100.0)),
        ("T_update", "ms", |bin| Some(bin.t_update_ms)),
        ("commands", "1/s", |bin| Some(per_second(bin.commands))),
        ("messages, both ways", "1/s", |bin| {
            Some(per_second(bin.messages))
        }),
        ("sent up", "kbit/s", |bin| {
            bin.bits.first().map(|bits| bits * 1e-3 / BIN.as_secs_f64())
        }),
    ];
    let styles = [
        (Colour::Vermilion, Stroke::Dashed),
        (Colour::Grey, Stroke::Solid),
        (Colour::Blue, Stroke::Solid),
    ];
    let panels = quantities.into_iter().map(|(what, unit, of)| {
        let series = variants
            .iter()
            .zip(styles)
            .map(|((name, _, runs), (colour, stroke))| {
                let bins = runs
                    .first()
                    .map(|run| run.bins.as_slice())
                    .unwrap_or_default();
                let dots = bins
                    .iter()
                    .filter_map(|bin| Some(Dot::at(bin.t_s, of(bin)?)));
                Series::line(name, colour, dots.collect()).stroked(stroke, 2)
            });
        let all = variants.iter().flat_map(|(_, _, runs)| runs.first());
        let values = all.flat_map(|run| run.bins.iter().filter_map(of));
        let most = values.fold(0.0, f64::max);
        let edges = [FROM_S, UNTIL_S].map(|t_s| Dot::at(t_s, most)).to_vec();
        let bottleneck = Series::line("", Colour::Black, edges).stroked(Stroke::Events, 1);
        Panel::new(
            what,
            Axis::linear("time, s"),
            Axis::linear(&format!("{what}, {unit}")),
            std::iter::once(bottleneck).chain(series),
        )
    });
    Figure::of_alike(panels, Legend::UpperRight, 2, (460, 240))
}
