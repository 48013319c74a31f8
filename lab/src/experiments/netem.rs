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

use crate::experiment::description::{DURATION, Experiment, Request};
use crate::experiment::findings::{ExperimentError, Findings};
use crate::experiment::grid;
use crate::figure::{Axis, Colour, Dot, Figure, Legend, Panel, Series, Stroke};
use crate::io::Runner;
use crate::statistics::quantile;
use crate::table::{Column, Table, column};

/// Packets per second that are offered: a haptic stream that sends every sample.
const RATE_HZ: f64 = 1000.0;
/// Length of a packet, bytes: a command of one sample with its QUIC packet.
const BYTES: usize = 90;

/// The presets of the emulated network.
pub(super) const NETEM: Experiment = Experiment {
    name: "netem",
    about: "Every network preset: configured against achieved",
    seeds: 10,
    duration: DURATION,
    arguments: &[],
    run,
};

/// A preset and what its settings say that it does.
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

/// What a preset did.
struct Achieved {
    group: grid::Group<Case, Met>,
    /// Delays of all seeds, ms, by rising delay.
    delays_ms: Vec<f64>,
}

fn case(preset: &'static Preset) -> Result<Case, ExperimentError> {
    let refused = |error: &dyn std::fmt::Display| ExperimentError::network(preset.name, error);
    let config: LinkConfig = preset.words.parse().map_err(|error| refused(&error))?;
    let configured = config.expected(RATE_HZ).map_err(|error| refused(&error))?;
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
    let achieved: Vec<Achieved> = groups.into_iter().map(Achieved::of).collect();
    let title =
        format!("Presets at {RATE_HZ} packets/s: configured, and achieved over the seeds (mean)");
    let table = Table::of(title, &achieved, &columns());
    runner.keep_table("netem.csv", &table)?;
    let figure = Figure::of_alike(achieved.iter().map(panel), Legend::UpperLeft, 4, (330, 260));
    runner.keep_figure("netem.svg", &figure)?;
    Ok(Findings {
        experiment: NETEM.name,
        extent,
        digest: String::new(),
        configuration: Vec::new(),
        tables: vec![table],
    })
}

#[rustfmt::skip]
fn columns<'a>() -> [Column<'a, Achieved>; 14] {
    fn mean(achieved: &Achieved, of: fn(&Summary) -> f64) -> Option<f64> {
        achieved.group.mean(|met| Some(of(&met.summary)))
    }
    fn configured(achieved: &Achieved) -> &Effect {
        &achieved.group.case.configured
    }
    [
        column("preset", "", 0, |of| of.group.case.preset.name),
        column("packets", "", 0, |of| {
            let offered = of.group.runs.iter().map(|met| met.summary.offered.packets);
            offered.sum::<u64>()
        }),
        column("mean_ms", "ms", 2, |of| configured(of).mean_ms),
        column("mean_ms_achieved", "ms", 2, |of| mean(of, |run| run.mean_ms)),
        column("sd_ms", "ms", 2, |of| configured(of).sd_ms),
        column("sd_ms_achieved", "ms", 2, |of| mean(of, |run| run.sd_ms)),
        column("p99_ms", "ms", 2, |of| configured(of).p99_ms),
        column("p99_ms_achieved", "ms", 2, |of| quantile(&of.delays_ms, 0.99)),
        column("loss", "", 5, |of| configured(of).loss),
        column("loss_achieved", "", 5, |of| mean(of, |run| run.loss)),
        column("burst_packets", "", 1, |of| configured(of).burst_packets),
        column("burst_packets_achieved", "", 1, |of| mean(of, |run| run.burst_packets)),
        column("reordered", "", 4, |of| configured(of).reordered),
        column("reordered_achieved", "", 4, |of| mean(of, |run| run.reordered)),
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

impl Achieved {
    fn of(group: grid::Group<Case, Met>) -> Self {
        let delays = group.runs.iter().flat_map(|met| &met.delays_ms);
        let mut delays_ms: Vec<f64> = delays.copied().collect();
        delays_ms.sort_by(f64::total_cmp);
        Self { group, delays_ms }
    }
}

/// Shares of packets at which a curve is drawn. The first and the last quarter of a per cent are left out:
/// a single packet would set the axis.
const SHARES: u32 = 400;

/// The share of packets that came within a delay: as the settings draw it, and as it was met; the loss of both
/// in the title.
fn panel(achieved: &Achieved) -> Panel {
    let Case {
        preset,
        config,
        configured,
    } = &achieved.group.case;
    let shares = (1..SHARES).map(|k| f64::from(k) / f64::from(SHARES));
    let said = |share| config.delay.quantile(share).as_secs_f64() * 1e3;
    let met = shares
        .clone()
        .filter_map(|share| Some(Dot::at(quantile(&achieved.delays_ms, share)?, share)));
    let said: Vec<Dot> = shares.map(|share| Dot::at(said(share), share)).collect();
    let met: Vec<Dot> = met.collect();
    let loss = achieved.group.mean(|met| Some(met.summary.loss));
    let title = format!(
        "{}: loss {:.2} %, configured {:.2} %",
        preset.name,
        100.0 * loss.unwrap_or(0.0),
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
