//! Delays of a run: of each way where both ends are there, and round trips by the echoes in what arrived.

use mmt_shared::record::messages::Arrival;
use mmt_shared::stats::values::quantile;
use mmt_shared::wire::{Datagram, Side};

use super::packets::Matched;
use crate::figure::{Axis, Colour, Dot, Figure, Legend, Panel, Series};
use crate::table::{Column, Table, column};

/// Parts that a histogram's range is divided into.
const BINS: usize = 60;

/// Round trips as they were handed over, s.
#[derive(Default)]
pub(super) struct Delays {
    round_trips: Vec<f64>,
}

impl Delays {
    /// A datagram that `from` sent and the other side received.
    pub(super) fn arrival(&mut self, from: Side, arrival: &Arrival) {
        let datagram = Datagram::decode(&arrival.datagram, from).ok();
        if let Some(echo) = datagram.and_then(|datagram| datagram.envelope.echo) {
            let held = echo.sent.as_nanos().saturating_add(echo.held_ns);
            let round_trip = arrival.at_ns.saturating_sub(held);
            self.round_trips.push(round_trip as f64 * 1e-9);
        }
    }

    /// With what both ends together show.
    pub(super) fn with(&self, packets: &Matched<'_>) -> Spreads {
        let [up, down] = [false, true].map(|down| packets.delays(down));
        let all = [
            ("up", up),
            ("down", down),
            ("round trip", self.round_trips.clone()),
        ];
        let sorted = all.into_iter().map(|(name, mut delays)| {
            delays.sort_by(f64::total_cmp);
            (name, delays)
        });
        Spreads(sorted.filter(|(_, delays)| !delays.is_empty()).collect())
    }
}

/// Delays by name, each sorted, s.
pub(super) struct Spreads(Vec<(&'static str, Vec<f64>)>);

type Spread = (&'static str, Vec<f64>);

/// The delay that a share `q` of sorted delays does not exceed, ms.
fn quantile_ms(delays: &[f64], q: f64) -> Option<f64> {
    quantile(delays, q).map(|delay| delay * 1e3)
}

impl Spreads {
    /// A row a way.
    pub(super) fn table(&self) -> Table {
        let quantile = |key, q: f64| {
            Column::new(key, "ms", 2, move |(_, delays): &Spread| {
                quantile_ms(delays, q).into()
            })
        };
        Table::of(
            "Delays",
            &self.0,
            &[
                column("way", "", 0, |(way, _): &Spread| *way),
                column("packets", "", 0, |(_, delays): &Spread| delays.len() as u64),
                quantile("p50_ms", 0.5),
                quantile("p90_ms", 0.9),
                quantile("p99_ms", 0.99),
                quantile("max_ms", 1.0),
            ],
        )
    }

    /// Histograms: the share of the packets in each part of the range.
    pub(super) fn figure(&self) -> Figure {
        let most = self
            .0
            .iter()
            .filter_map(|(_, delays)| quantile_ms(delays, 0.999));
        let range_ms = most.fold(0.1, f64::max);
        let colours = [Colour::BLUE, Colour::VERMILION, Colour::GREY];
        let ways = self.0.iter().zip(colours);
        let series = ways
            .map(|((way, delays), colour)| Series::line(way, colour, histogram(delays, range_ms)));
        let x = Axis::linear("delay, ms");
        let y = Axis::linear("share of the packets, %");
        let panel = Panel::new("delays", x, y, series).with_legend(Legend::UpperRight);
        Figure {
            panels: vec![panel],
            columns: 1,
            panel_size: (680, 360),
        }
    }
}

/// A flat top for each part.
fn histogram(delays: &[f64], range_ms: f64) -> Vec<Dot> {
    let width_ms = range_ms / BINS as f64;
    let mut counts = [0_u32; BINS];
    for delay in delays {
        let bin = (delay * 1e3 / width_ms) as usize;
        if let Some(count) = counts.get_mut(bin) {
            *count += 1;
        }
    }
    let tops = counts.into_iter().enumerate().flat_map(|(bin, count)| {
        let (from, share) = (bin as f64 * width_ms, 100.0 * f64::from(count));
        let share = share / delays.len().max(1) as f64;
        [Dot::at(from, share), Dot::at(from + width_ms, share)]
    });
    tops.collect()
}
