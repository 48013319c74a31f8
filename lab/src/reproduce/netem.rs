//! Every network preset: what its settings say that it does, against what it did in virtual time.

use std::time::Duration;

use mmt_netem::config::LinkConfig;
use mmt_netem::effect::Effect;
use mmt_netem::link::{Direction, LinkId};
use mmt_netem::presets::{PRESETS, Preset};
use mmt_netem::record::summary::Summary;
use mmt_netem::record::{End, Entry};
use mmt_netem::{Link, Packet};
use mmt_shared::time::{TICK, Time};

use super::{Extent, Findings, Laboratory, ReproduceError};
use crate::figure::{Axis, Colour, Dot, Figure, Legend, Panel, Series, Stroke};
use crate::statistics::{Interval, quantile};
use crate::table::{Cell, Table};

/// Packets per second that are offered: a haptic stream that sends every sample.
const RATE_HZ: f64 = 1000.0;
/// Length of a packet, bytes: a command of one sample with its QUIC packet.
const BYTES: usize = 90;

/// Runs every preset at 1 kHz and keeps `netem.csv` and `netem.svg`.
///
/// # Errors
/// When a preset's words are not accepted; as [`Laboratory::keep`].
pub fn reproduce(laboratory: &dyn Laboratory, extent: Extent) -> Result<Findings, ReproduceError> {
    let mut table = Table::new(
        format!("Presets at {RATE_HZ} packets/s: configured, and achieved over the seeds (mean)"),
        &[
            ("preset", 0),
            ("packets", 0),
            ("mean_ms", 2),
            ("mean_ms_achieved", 2),
            ("sd_ms", 2),
            ("sd_ms_achieved", 2),
            ("p99_ms", 2),
            ("p99_ms_achieved", 2),
            ("loss", 5),
            ("loss_achieved", 5),
            ("burst_packets", 1),
            ("burst_packets_achieved", 1),
            ("reordered", 4),
            ("reordered_achieved", 4),
        ],
    );
    let mut panels = Vec::new();
    for preset in &PRESETS {
        let refused = |error: &dyn std::fmt::Display| ReproduceError::Network {
            name: preset.name.to_owned(),
            why: error.to_string(),
        };
        let config: LinkConfig = preset.words.parse().map_err(|error| refused(&error))?;
        let configured = config.expected(RATE_HZ).map_err(|error| refused(&error))?;
        let runs = (1..=extent.seeds).map(|seed| run(&config, seed, extent.duration));
        let runs: Result<Vec<Vec<Entry>>, _> = runs.collect();
        let runs = runs.map_err(|error| refused(&error))?;
        let achieved: Vec<Summary> = runs
            .iter()
            .map(|run| Summary::of(run, Direction::Up))
            .collect();
        let delays = delays_ms(&runs);
        table.push(row(preset, &configured, &achieved, &delays));
        panels.push(panel(preset, &config, &configured, &achieved, &delays));
    }
    laboratory.keep("netem.csv", &table.to_csv())?;
    let figure = Figure::of_alike(panels, Legend::UpperLeft, 4, (330, 260));
    laboratory.keep_figure("netem.svg", &figure)?;
    Ok(Findings {
        experiment: "netem",
        extent,
        digest: String::new(),
        configuration: Vec::new(),
        tables: vec![table],
    })
}

/// One packet a tick through the link; packets still in flight at the end are not in the record.
fn run(
    config: &LinkConfig,
    seed: u64,
    duration: Duration,
) -> Result<Vec<Entry>, mmt_netem::config::ConfigError> {
    let mut link: Link<()> = Link::try_new(config.clone(), seed, LinkId::first(Direction::Up))?;
    let mut entries = Vec::new();
    let mut now = Time::ZERO;
    for _ in 0..duration.as_millis() {
        now += TICK;
        let out = std::iter::from_fn(|| link.poll(now));
        entries.extend(out.map(|out| Entry::of(Direction::Up, &out)));
        link.offer(now, Packet::new(BYTES, ()));
    }
    // the last packet is on record if it was dropped at once
    let dropped = std::iter::from_fn(|| link.poll(now)).filter(|out| !out.is_delivered());
    entries.extend(dropped.map(|out| Entry::of(Direction::Up, &out)));
    Ok(entries)
}

/// Delays of all packets that came through, ms, by rising delay.
fn delays_ms(runs: &[Vec<Entry>]) -> Vec<f64> {
    let delays = runs.iter().flatten().filter_map(|entry| match entry.end {
        End::Sent { due, .. } => Some(due.saturating_since(entry.offered).as_secs_f64() * 1e3),
        _ => None,
    });
    let mut delays: Vec<f64> = delays.collect();
    delays.sort_by(f64::total_cmp);
    delays
}

fn row(preset: &Preset, configured: &Effect, achieved: &[Summary], delays: &[f64]) -> Vec<Cell> {
    let mean = |of: &dyn Fn(&Summary) -> f64| {
        Cell::from(Interval::of(achieved.iter().map(of)).map(|i| i.mean))
    };
    let packets: u64 = achieved.iter().map(|summary| summary.offered.packets).sum();
    vec![
        preset.name.into(),
        packets.into(),
        configured.mean_ms.into(),
        mean(&|summary| summary.mean_ms),
        configured.sd_ms.into(),
        mean(&|summary| summary.sd_ms),
        configured.p99_ms.into(),
        quantile(delays, 0.99).into(),
        configured.loss.into(),
        mean(&|summary| summary.loss),
        configured.burst_packets.into(),
        mean(&|summary| summary.burst_packets),
        configured.reordered.into(),
        mean(&|summary| summary.reordered),
    ]
}

/// Shares of packets at which a curve is drawn. The first and the last quarter of a per cent are left out:
/// a single packet would set the axis.
const SHARES: u32 = 400;

/// The share of packets that came within a delay: as the settings draw it, and as it was met; the loss of both
/// in the title.
fn panel(
    preset: &Preset,
    config: &LinkConfig,
    configured: &Effect,
    achieved: &[Summary],
    delays: &[f64],
) -> Panel {
    let shares = (1..SHARES).map(|k| f64::from(k) / f64::from(SHARES));
    let said = |share| config.delay.quantile(share).as_secs_f64() * 1e3;
    let met = shares
        .clone()
        .filter_map(|share| Some(Dot::at(quantile(delays, share)?, share)));
    let said: Vec<Dot> = shares.map(|share| Dot::at(said(share), share)).collect();
    let met: Vec<Dot> = met.collect();
    let loss = Interval::of(achieved.iter().map(|summary| summary.loss)).map_or(0.0, |i| i.mean);
    let title = format!(
        "{}: loss {:.2} %, configured {:.2} %",
        preset.name,
        100.0 * loss,
        100.0 * configured.loss
    );
    let x = Axis::linear("delay, ms").over(range(said.iter().chain(&met)));
    let y = Axis::linear("share of packets").over(0.0..1.0);
    let series = [
        Series::line("achieved", Colour::Sky, met).stroked(Stroke::Solid, 3),
        Series::line("configured", Colour::Black, said).stroked(Stroke::Dashed, 1),
    ];
    Panel::new(title, x, y, series)
}

/// A little more than what the dots take, and never nothing.
fn range<'a>(dots: impl Iterator<Item = &'a Dot>) -> std::ops::Range<f64> {
    let (low, high) = dots.fold((f64::INFINITY, 0.0_f64), |(low, high), dot| {
        (low.min(dot.x), high.max(dot.x))
    });
    let room = (0.05 * (high - low)).max(0.01);
    (low - room).max(0.0)..high + room
}
