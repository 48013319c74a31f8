//! The deadband as a rate controller at a bottleneck of 64 kbit/s: what congestion does if nobody, the master or both
//! answer it.
//!
//! The live defaults over 50 ms one way. From 10 to 25 s each direction passes a bottleneck with a second of queue.

use std::time::Duration;

use mmt_netem::config::LinkConfig;
use mmt_server::trigger::Scheme;
use mmt_shared::rate_control::StretchMax;
use mmt_shared::time::Time;
use sha2::{Digest, Sha256};

use super::{Extent, Findings, Laboratory, ReproduceError};
use crate::digest::hex;
use crate::figure::{Axis, Colour, Dot, Figure, Legend, Panel, Series, Stroke};
use crate::statistics::{Interval, median};
use crate::table::{Cell, Table};
use crate::trial::TrialError;
use crate::world::{World, WorldConfig, WorldTick};

/// When the bottleneck comes and goes, s.
const FROM_S: f64 = 10.0;
const UNTIL_S: f64 = 25.0;
/// Each direction; the 58 bytes are the headers of IPv4, UDP and QUIC.
const NETWORK: &str = "delay 50ms; at 10s delay 50ms rate 64kbit 58 queue 1s; at 25s delay 50ms";
/// Length of a bin.
const BIN: Duration = Duration::from_millis(250);
/// Who answers congestion: nobody, the master with its samples alone, both; greatest stretches of master and slave.
const VARIANTS: [(&str, StretchMax, StretchMax); 3] = [
    ("nobody", StretchMax::OFF, StretchMax::OFF),
    ("master", StretchMax::RECOMMENDED, StretchMax::OFF),
    ("both", StretchMax::RECOMMENDED, StretchMax::RECOMMENDED),
];
/// Beginning of the part after congestion: what had queued is gone, and the stretch.
const AFTER_S: f64 = 35.0;

/// What one bin of one run came to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Bin {
    /// Its end, s.
    t_s: f64,
    /// The round trip as the slave last measured it, ms.
    round_trip_ms: Option<f64>,
    /// Delta now, 0 if the scheme has none.
    delta: f64,
    /// T_update now, ms.
    t_update_ms: f64,
    commands: u64,
    /// Messages of all kinds in both directions.
    messages: u64,
    /// Repeats included.
    updates: u64,
    /// Bits in each direction with headers.
    bits: [f64; 2],
    /// Datagrams that the bottleneck's queue dropped.
    dropped: u64,
    /// Σ |f_s − f_m|², N², Σ |f_s|², N², and the number of pairs.
    error: (f64, f64),
    pairs: u64,
    ticks: u64,
}

/// What is counted from the start on.
#[derive(Clone, Copy, Debug, Default)]
struct Totals {
    commands: u64,
    messages: u64,
    updates: u64,
    bytes: [f64; 2],
    dropped: u64,
}

fn totals(world: &World) -> Totals {
    let traffic = world.traffic();
    let (messages, wire) = (&traffic.messages, &traffic.wire);
    let bytes = |of: &mmt_shared::report::WireReport| {
        let headers = of.header_bytes.unwrap_or(0) * of.datagrams.unwrap_or(0);
        (of.bytes.unwrap_or(0) + headers) as f64
    };
    let all = |of: &mmt_shared::report::MessagesReport| {
        let kinds = [of.commands, of.updates, of.scenes, of.heartbeats];
        kinds.into_iter().flatten().sum::<u64>()
    };
    Totals {
        commands: messages.up.commands.unwrap_or(0),
        messages: all(&messages.up) + all(&messages.down),
        updates: messages.down.updates.unwrap_or(0),
        bytes: [bytes(&wire.up), bytes(&wire.down)],
        dropped: world.dropped_in_queues(),
    }
}

fn scheme_numbers(scheme: Scheme) -> (f64, f64) {
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    match scheme {
        Scheme::Hybrid { delta, t_update } | Scheme::Useful { delta, t_update } => {
            (delta, ms(t_update))
        }
        Scheme::Deadband { delta } | Scheme::Adaptive { delta, .. } => (delta, 0.0),
        Scheme::Timer { t_update } => (0.0, ms(t_update)),
        Scheme::EverySample | Scheme::Dis { .. } => (0.0, 0.0),
    }
}

impl Bin {
    fn take(&mut self, tick: &WorldTick) {
        self.ticks += 1;
        let Some(slave) = &tick.slave else {
            return;
        };
        if let Some(f_m) = slave.f_m {
            self.error.0 += (slave.f_s - f_m).norm_squared();
            self.error.1 += slave.f_s.norm_squared();
            self.pairs += 1;
        }
    }

    fn close(&mut self, now: Time, world: &World, before: &Totals) -> Totals {
        let totals = totals(world);
        let peer = world.slave_link().end().peer();
        let latest = peer.round_trip().latest();
        (self.delta, self.t_update_ms) = scheme_numbers(world.slave().scheme_now());
        self.t_s = now.as_secs_f64();
        self.round_trip_ms = latest.map(|took| took.as_secs_f64() * 1e3);
        self.commands = totals.commands - before.commands;
        self.messages = totals.messages - before.messages;
        self.updates = totals.updates - before.updates;
        self.bits = [0, 1].map(|way: usize| {
            let of = |bytes: [f64; 2]| bytes.get(way).copied().unwrap_or_default();
            8.0 * (of(totals.bytes) - of(before.bytes))
        });
        self.dropped = totals.dropped - before.dropped;
        totals
    }
}

/// One run.
struct Run {
    bins: Vec<Bin>,
    digest: String,
}

fn world(master: StretchMax, slave: StretchMax) -> Result<WorldConfig, ReproduceError> {
    let link: Result<LinkConfig, _> = NETWORK.parse();
    let link = link.map_err(
        |error: mmt_netem::words::ParseError| ReproduceError::Network {
            name: "bottleneck".to_owned(),
            why: error.to_string(),
        },
    )?;
    let mut world = WorldConfig {
        up: link.clone(),
        down: link,
        stretch_max: master,
        ..WorldConfig::default()
    };
    world.slave.stretch_max = slave;
    Ok(world)
}

fn run(config: &WorldConfig, duration: Duration) -> Result<Run, ReproduceError> {
    let mut world = World::try_new(config).map_err(TrialError::from)?;
    let (mut bins, mut before) = (Vec::new(), Totals::default());
    for _ in 0..duration.as_millis() / BIN.as_millis() {
        let mut bin = Bin::default();
        let mut now = Time::ZERO;
        world.run(BIN, |tick| {
            bin.take(tick);
            now = tick.now;
        });
        before = bin.close(now, &world, &before);
        bins.push(bin);
    }
    Ok(Run {
        bins,
        digest: world.digest(),
    })
}

/// Runs every variant over the seeds and keeps `congestion.csv` (a row a bin) and `congestion.svg` (seed 1).
///
/// # Errors
/// As [`Laboratory::keep`]; when a world is not accepted.
pub fn reproduce(laboratory: &dyn Laboratory, extent: Extent) -> Result<Findings, ReproduceError> {
    let mut hash = Sha256::new();
    let mut variants = Vec::new();
    for (name, master, slave) in VARIANTS {
        let config = world(master, slave)?;
        let runs =
            (1..=extent.seeds).map(|seed| run(&config.clone().seeded(seed), extent.duration));
        let runs: Vec<Run> = runs.collect::<Result<_, _>>()?;
        runs.iter()
            .for_each(|run| hash.update(run.digest.as_bytes()));
        variants.push((name, config, runs));
    }
    let (all, summary) = (series_table(&variants), summary(&variants));
    laboratory.keep("congestion.csv", &all.to_csv())?;
    laboratory.keep_figure("congestion.svg", &figure(&variants))?;
    Ok(Findings {
        experiment: "congestion",
        extent,
        digest: hex(&hash.finalize()),
        configuration: variants.into_iter().map(|(_, config, _)| config).collect(),
        tables: vec![summary],
    })
}

type Variant = (&'static str, WorldConfig, Vec<Run>);

fn per_second(count: u64) -> f64 {
    count as f64 / BIN.as_secs_f64()
}

fn relative_error(bin: &Bin) -> Option<f64> {
    (bin.error.1 > 0.0).then(|| libm::sqrt(bin.error.0 / bin.error.1))
}

fn series_table(variants: &[Variant]) -> Table {
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
                    relative_error(bin).into(),
                ]);
            }
        }
    }
    table
}

/// Before, during and after congestion, as means over the seeds.
fn summary(variants: &[Variant]) -> Table {
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

/// Over time, seed 1.
fn figure(variants: &[Variant]) -> Figure {
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

#[cfg(test)]
mod tests {
    use super::*;

    const DURATION: Duration = Duration::from_secs(45);

    fn run_of(master: StretchMax, slave: StretchMax) -> Vec<Bin> {
        let config = world(master, slave).unwrap().seeded(1);
        run(&config, DURATION).unwrap().bins
    }

    fn within(bins: &[Bin], from_s: f64, until_s: f64) -> impl Iterator<Item = &Bin> {
        let of = move |bin: &&Bin| bin.t_s > from_s && bin.t_s <= until_s;
        bins.iter().filter(of)
    }

    fn round_trip(bins: &[Bin]) -> f64 {
        median(within(bins, FROM_S + 3.0, UNTIL_S).filter_map(|bin| bin.round_trip_ms)).unwrap()
    }

    #[test]
    fn who_answers_congestion_has_a_short_queue_and_comes_back_to_what_was_configured() {
        let nobody = run_of(StretchMax::OFF, StretchMax::OFF);
        let both = run_of(StretchMax::RECOMMENDED, StretchMax::RECOMMENDED);
        let dropped = |bins: &[Bin]| bins.iter().map(|bin| bin.dropped).sum::<u64>();
        let (without, with) = (round_trip(&nobody), round_trip(&both));
        println!(
            "round trip {without} ms and {with} ms, dropped {} and {}",
            dropped(&nobody),
            dropped(&both)
        );
        assert!(without > 1000.0 && with < 200.0, "{without} ms, {with} ms");
        assert!(dropped(&nobody) > 500 && dropped(&both) < 50);
        assert!(
            nobody
                .iter()
                .all(|bin| (bin.delta, bin.t_update_ms) == (0.10, 150.0))
        );

        // all three rates give way, to their bounds and no further, and come back
        let most = |of: fn(&Bin) -> f64| both.iter().map(of).fold(0.0, f64::max);
        assert!((most(|bin| bin.delta) - 0.30).abs() < 1e-12);
        assert!((most(|bin| bin.t_update_ms) - 450.0).abs() < 1e-6);
        let least = within(&both, FROM_S + 3.0, UNTIL_S)
            .map(|bin| bin.commands)
            .min();
        assert_eq!(least, Some(8), "a third of 25 in a quarter of a second");
        let last = both.last().unwrap();
        assert_eq!(
            (last.delta, last.t_update_ms, last.commands),
            (0.10, 150.0, 25)
        );
    }

    #[test]
    fn without_a_queue_rate_control_changes_nothing() {
        for words in [
            "delay 50ms",
            "delay 50ms 20ms",
            "delay 50ms loss 20%",
            "delay 400ms loss burst 5% 100ms",
        ] {
            let digest = |stretch_max| {
                let mut config = world(stretch_max, stretch_max).unwrap();
                (config.up, config.down) = (words.parse().unwrap(), words.parse().unwrap());
                run(&config, Duration::from_secs(15)).unwrap().digest
            };
            assert_eq!(
                digest(StretchMax::OFF),
                digest(StretchMax::RECOMMENDED),
                "{words}"
            );
        }
    }
}
