//! Every network preset: what its settings ask for against what it did in virtual time.

use mmt_netem::config::LinkConfig;
use mmt_netem::effect::Effect;
use mmt_netem::link::{Direction, LinkId};
use mmt_netem::presets::{PRESETS, Preset};
use mmt_netem::record::summary::Summary;
use mmt_netem::record::{End, Entry};
use mmt_netem::{Link, Packet};
use mmt_shared::time::{TICK, Time};

use crate::experiment::prelude::*;
use crate::statistics::quantile;

/// Packets per second that are offered: a haptic stream that sends every sample.
const RATE_HZ: f64 = 1000.0;
/// Length of a packet, bytes: a command of one sample with its QUIC packet.
const BYTES: usize = 90;

/// The presets of the emulated network.
pub(super) const NETEM: Experiment = Experiment::new(
    "netem",
    "Every network preset: configured against achieved",
    10,
    run,
);

/// A preset and what its settings ask for.
struct Case {
    preset: &'static Preset,
    config: LinkConfig,
    configured: Effect,
}

/// What a preset did with one seed.
struct Met {
    summary: Summary,
    /// Delays of the packets that came through, ms.
    delays_ms: Vec<f64>,
}

type Group = grid::Group<Case, Met>;

fn case(preset: &'static Preset) -> Result<Case, ExperimentError> {
    let refused = |error: &dyn std::fmt::Display| ExperimentError::network(preset.name, error);
    let config: LinkConfig = preset.words.parse().map_err(|error| refused(&error))?;
    let configured = config
        .expected(RATE_HZ, BYTES)
        .map_err(|error| refused(&error))?;
    Ok(Case {
        preset,
        config,
        configured,
    })
}

/// Keeps `netem.csv` and `netem.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let cases: Result<Vec<Case>, ExperimentError> = PRESETS.iter().map(case).collect();
    let groups = runner.grid("netem", extent.seeds, cases?, |case, seed| {
        let run = entries(&case.config, seed, extent.duration);
        let run = run.map_err(|error| ExperimentError::network(case.preset.name, error))?;
        Ok(Met::of(&run))
    })?;
    let title =
        format!("Presets at {RATE_HZ} packets/s: configured, and achieved over the seeds (mean)");
    let table = Table::of(title, &groups, &columns());
    runner.keep_table("netem.csv", &table)?;
    let figure = Figure::of_alike(groups.iter().map(panel), Legend::UpperLeft, 4, (330, 260));
    runner.keep_figure("netem.svg", &figure)?;
    Ok(Findings {
        tables: vec![table],
        ..Findings::default()
    })
}

#[rustfmt::skip]
fn columns<'a>() -> [Column<'a, Group>; 14] {
    [
        column("preset", "", 0, |group| group.case.preset.name),
        column("packets", "", 0, |group| group.runs.iter().map(|met| met.summary.offered.packets).sum::<u64>()),
        column("mean_ms", "ms", 2, |group| group.case.configured.mean_ms),
        mean("mean_ms_achieved", "ms", 2, |met| Some(met.summary.mean_ms)),
        column("sd_ms", "ms", 2, |group| group.case.configured.sd_ms),
        mean("sd_ms_achieved", "ms", 2, |met| Some(met.summary.sd_ms)),
        column("p99_ms", "ms", 2, |group| group.case.configured.p99_ms),
        column("p99_ms_achieved", "ms", 2, |group| quantile(&delays_ms(group), 0.99)),
        column("loss", "", 5, |group| group.case.configured.loss),
        mean("loss_achieved", "", 5, |met| Some(met.summary.loss)),
        column("burst_packets", "", 1, |group| group.case.configured.burst_packets),
        // a seed without a burst has no mean length of one
        mean("burst_packets_achieved", "", 1, |met| (!met.summary.loss_bursts.is_empty()).then_some(met.summary.burst_packets)),
        column("reordered", "", 4, |group| group.case.configured.reordered),
        mean("reordered_achieved", "", 4, |met| Some(met.summary.reordered)),
    ]
}

/// One packet a tick through the link; packets still in flight at the end are not in the record.
fn entries(
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

impl Met {
    fn of(entries: &[Entry]) -> Self {
        let delays = entries.iter().filter_map(|entry| match entry.end {
            End::Sent { due, .. } => Some(due.saturating_since(entry.offered).as_secs_f64() * 1e3),
            _ => None,
        });
        Self {
            summary: Summary::of(entries, Direction::Up),
            delays_ms: delays.collect(),
        }
    }
}

/// Delays of all seeds, ms, by rising delay.
fn delays_ms(group: &Group) -> Vec<f64> {
    let delays = group.runs.iter().flat_map(|met| &met.delays_ms);
    let mut delays_ms: Vec<f64> = delays.copied().collect();
    delays_ms.sort_by(f64::total_cmp);
    delays_ms
}

/// Shares of packets at which a curve is drawn. The first and the last quarter of a per cent are left out:
/// a single packet would set the axis.
const SHARES: u32 = 400;

/// The share of packets that came within a delay: as it is configured and as it was achieved; the loss of both in the
/// title.
fn panel(group: &Group) -> Panel {
    let Case {
        preset,
        config,
        configured,
    } = &group.case;
    let delays_ms = delays_ms(group);
    let shares = (1..SHARES).map(|k| f64::from(k) / f64::from(SHARES));
    let drawn = |share| config.delay.quantile(share).as_secs_f64() * 1e3;
    let met = shares
        .clone()
        .filter_map(|share| Some(Dot::at(quantile(&delays_ms, share)?, share)));
    let met: Vec<Dot> = met.collect();
    let drawn: Vec<Dot> = shares.map(|share| Dot::at(drawn(share), share)).collect();
    let loss = group.mean(|met| Some(met.summary.loss));
    let title = format!(
        "{}: loss {:.2} %, configured {:.2} %",
        preset.name,
        100.0 * loss.unwrap_or(0.0),
        100.0 * configured.loss
    );
    let x = Axis::linear("delay, ms").over(range(drawn.iter().chain(&met)));
    let y = Axis::linear("share of packets").over(0.0..1.0);
    let series = [
        Series::line("achieved", Colour::SKY, met).stroked(Stroke::Solid, 3),
        Series::line("configured", Colour::BLACK, drawn).stroked(Stroke::Dashed, 1),
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
