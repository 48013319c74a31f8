//! Every network preset in virtual time: what follows from its words by formula against what the link did.

use mmt_netem::config::{LinkConfig, Order};
use mmt_netem::link::{Direction, LinkId};
use mmt_netem::presets::{PRESETS, Preset};
use mmt_netem::record::summary::Summary;
use mmt_netem::record::{End, Entry};
use mmt_netem::{Link, Packet};
use mmt_shared::stats::values::{quantile, rms};
use mmt_shared::time::{TICK, Time};

use crate::experiment::prelude::*;

mod closed_form;

use closed_form::{ClosedForm, Curve};

/// Packets per second that are offered: a haptic stream that sends every sample.
const RATE_HZ: f64 = 1000.0;
/// Length of a packet, bytes: a command of one sample with its QUIC packet.
const BYTES: usize = 90;

/// The presets of the emulated network.
pub(super) const NETEM: Experiment = Experiment::new(
    "netem",
    "Every network preset: by formula against achieved",
    10,
    run,
);

/// A preset and what follows from its words.
struct Case {
    preset: &'static Preset,
    config: LinkConfig,
    known: ClosedForm,
}

/// What a preset did with one seed.
struct Met {
    /// As it is.
    summary: Summary,
    /// With each packet by itself (`order free`), of which the formulas are.
    free: Summary,
    /// Delays of the packets that came through, as it is, ms.
    delays_ms: Vec<f64>,
    /// The same of the packets by themselves.
    free_ms: Vec<f64>,
    /// Steps of the delay between neighbouring packets, ms, without sign.
    steps_ms: Vec<f64>,
}

type Group = grid::Group<Case, Met>;

fn case(preset: &'static Preset) -> Result<Case, ExperimentError> {
    let config = preset.words.parse();
    let config = config.map_err(|error| ExperimentError::network(preset.name, &error))?;
    Ok(Case {
        preset,
        known: ClosedForm::of(&config, RATE_HZ, BYTES),
        config,
    })
}

/// Keeps `netem.csv`, `netem-steps.csv` and `netem.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let cases: Result<Vec<Case>, ExperimentError> = PRESETS.iter().map(case).collect();
    let groups = runner.grid("netem", extent.seeds, cases?, |case, seed| {
        let met = Met::of(&case.config, seed, extent.duration);
        met.map_err(|error| ExperimentError::network(case.preset.name, error))
    })?;
    let title = format!(
        "Presets at {RATE_HZ} packets/s: by formula, of each packet by itself (free), and as they are (mean over the seeds)"
    );
    let presets = Table::of(title, &groups, &columns());
    runner.keep_table("netem.csv", &presets)?;
    let title = format!(
        "Steps of the delay between neighbours of {RATE_HZ} packets/s, each by itself (order free)"
    );
    let steps = Table::of(title, &groups, &step_columns());
    runner.keep_table("netem-steps.csv", &steps)?;
    let figure = Figure::of_alike(groups.iter().map(panel), Legend::UpperLeft, 4, (330, 260));
    runner.keep_figure("netem.svg", &figure)?;
    Ok(Findings {
        tables: vec![presets, steps],
        ..Findings::default()
    })
}

#[rustfmt::skip]
fn columns<'a>() -> [Column<'a, Group>; 16] {
    [
        column("preset", "", 0, |group| group.case.preset.name),
        column("packets", "", 0, |group| group.runs.iter().map(|met| met.summary.offered.packets).sum::<u64>()),
        column("mean_ms", "ms", 2, |group| group.case.known.mean_ms),
        mean("mean_ms_free", "ms", 2, |met| Some(met.free.mean_ms)),
        mean("mean_ms_achieved", "ms", 2, |met| Some(met.summary.mean_ms)),
        column("sd_ms", "ms", 2, |group| group.case.known.sd_ms),
        mean("sd_ms_free", "ms", 2, |met| Some(met.free.sd_ms)),
        mean("sd_ms_achieved", "ms", 2, |met| Some(met.summary.sd_ms)),
        column("p99_ms", "ms", 2, |group| group.case.known.p99_ms),
        column("p99_ms_free", "ms", 2, |group| quantile(&sorted(group, |met| &met.free_ms), 0.99)),
        column("p99_ms_achieved", "ms", 2, |group| quantile(&sorted(group, |met| &met.delays_ms), 0.99)),
        column("loss", "", 5, |group| group.case.known.loss),
        mean("loss_achieved", "", 5, |met| Some(met.summary.loss)),
        column("burst_packets", "", 1, |group| group.case.known.burst_packets),
        // a seed without a burst has no mean length of one
        mean("burst_packets_achieved", "", 1, |met| (!met.summary.loss_bursts.is_empty()).then_some(met.summary.burst_packets)),
        mean("reordered_achieved", "", 4, |met| Some(met.summary.reordered)),
    ]
}

#[rustfmt::skip]
fn step_columns<'a>() -> [Column<'a, Group>; 8] {
    fn of_steps(group: &Group, share: f64) -> Option<f64> {
        quantile(&sorted(group, |met| &met.steps_ms), share)
    }
    [
        column("preset", "", 0, |group| group.case.preset.name),
        column("step_rms_ms", "ms", 3, |group| group.case.known.step_rms_ms),
        column("step_rms_ms_achieved", "ms", 3, |group| rms(sorted(group, |met| &met.steps_ms))),
        column("step_p50_ms", "ms", 3, |group| of_steps(group, 0.5)),
        column("step_p90_ms", "ms", 3, |group| of_steps(group, 0.9)),
        column("step_p99_ms", "ms", 3, |group| of_steps(group, 0.99)),
        column("step_p999_ms", "ms", 3, |group| of_steps(group, 0.999)),
        mean("reordered", "", 4, |met| Some(met.free.reordered)),
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
    fn of(
        config: &LinkConfig,
        seed: u64,
        duration: Duration,
    ) -> Result<Self, mmt_netem::config::ConfigError> {
        let free = LinkConfig {
            order: Order::Free,
            ..config.clone()
        };
        let mut free = entries(&free, seed, duration)?;
        free.sort_by_key(|entry| entry.number);
        let numbered: Vec<(u64, f64)> = free.iter().filter_map(delay_ms).collect();
        let neighbours = numbered.iter().zip(numbered.iter().skip(1));
        let steps = neighbours.filter(|((n, _), (next, _))| n + 1 == *next);
        let achieved = entries(config, seed, duration)?;
        let delays = achieved.iter().filter_map(delay_ms).map(|(_, delay)| delay);
        Ok(Self {
            delays_ms: delays.collect(),
            summary: Summary::of(&achieved, Direction::Up),
            free: Summary::of(&free, Direction::Up),
            steps_ms: steps.map(|((_, a), (_, b))| (b - a).abs()).collect(),
            free_ms: numbered.into_iter().map(|(_, delay)| delay).collect(),
        })
    }
}

/// The number of a packet that came through, and its delay in ms.
fn delay_ms(entry: &Entry) -> Option<(u64, f64)> {
    match entry.end {
        End::Sent { due, .. } => {
            let delay = due.saturating_since(entry.offered);
            Some((entry.number, delay.as_secs_f64() * 1e3))
        }
        _ => None,
    }
}

/// Values of all seeds, rising.
fn sorted(group: &Group, of: fn(&Met) -> &Vec<f64>) -> Vec<f64> {
    let mut values: Vec<f64> = group.runs.iter().flat_map(of).copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Shares of packets at which a curve is drawn. The first and the last quarter of a per cent are left out:
/// a single packet would set the axis.
const SHARES: u32 = 400;

/// The share of packets that came within a delay, each by itself: by formula and as it was achieved; the loss of both in
/// the title.
fn panel(group: &Group) -> Panel {
    let Case {
        preset,
        config,
        known,
    } = &group.case;
    let delays_ms = sorted(group, |met| &met.free_ms);
    let shares = (1..SHARES).map(|k| f64::from(k) / f64::from(SHARES));
    let curve = Curve::of(&config.delay);
    let met = shares
        .clone()
        .filter_map(|share| Some(Dot::at(quantile(&delays_ms, share)?, share)));
    let met: Vec<Dot> = met.collect();
    let drawn = shares.filter_map(|share| Some(Dot::at(curve.as_ref()?.quantile(share), share)));
    let drawn: Vec<Dot> = drawn.collect();
    let loss = group.mean(|met| Some(met.summary.loss));
    let title = format!(
        "{}: loss {:.2} %, by formula {:.2} %",
        preset.name,
        100.0 * loss.unwrap_or(0.0),
        100.0 * known.loss.unwrap_or(0.0)
    );
    let x = Axis::linear("delay, ms").over(range(drawn.iter().chain(&met)));
    let y = Axis::linear("share of packets").over(0.0..1.0);
    let series = [
        Series::line("achieved", Colour::SKY, met).stroked(Stroke::Solid, 3),
        Series::line("by formula", Colour::BLACK, drawn).stroked(Stroke::Dashed, 1),
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
