//! The link against an independent emulator, the crate `str0m-netem`, where both mean the same: uniform
//! jitter, independent loss, Gilbert–Elliott loss, spacing at a rate. Seeds are fixed.
//!
//! Not compared, because they mean different things there: correlation (an average of uniform numbers),
//! reordering (by swapping neighbours), the moment of departure at a rate (when sending begins).

#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test; and the other emulator counts from an Instant"
)]

use std::time::{Duration, Instant};

use mmt_netem::{Link, LinkId, Packet};
use mmt_shared::time::Time;
use str0m_netem::{
    Bitrate, DataSize, GilbertElliot, Input, Netem, NetemConfig, Output, Probability, RandomLoss,
};

const N: u64 = 50_000;
/// Long enough for each packet to be gone before the next.
const INTERVAL: Duration = Duration::from_millis(100);
const BYTES: usize = 1000;

/// The delays of single packets in ms; `None`: lost.
fn theirs(config: NetemConfig) -> Vec<Option<f64>> {
    let mut netem: Netem<Vec<u8>> = Netem::new(config.seed(1));
    let mut now = Instant::now();
    let mut one = || {
        now += INTERVAL;
        netem.handle_input(Input::Packet(now, vec![0; BYTES]));
        let due = (!netem.is_empty()).then(|| netem.poll_timeout());
        netem.handle_input(Input::Timeout(due.unwrap_or(now)));
        while let Some(output) = netem.poll_output() {
            assert!(matches!(output, Output::Packet(_) | Output::Timeout(_)));
        }
        due.map(|due| due.duration_since(now).as_secs_f64() * 1e3)
    };
    (0..N).map(|_| one()).collect()
}

fn ours(words: &str) -> Vec<Option<f64>> {
    let mut link = Link::try_new(words.parse().unwrap(), 1, LinkId::UP).unwrap();
    let mut now = Time::ZERO;
    let mut one = || {
        now += INTERVAL;
        link.offer(now, Packet::new(BYTES, ()));
        let out = link.poll_delivered(Time::MAX)?;
        Some(out.due.saturating_since(now).as_secs_f64() * 1e3)
    };
    (0..N).map(|_| one()).collect()
}

/// The two-sample Kolmogorov–Smirnov distance, scaled: 1.95 is exceeded once in 1000.
fn kolmogorov_smirnov(a: &[Option<f64>], b: &[Option<f64>]) -> f64 {
    let sorted = |values: &[Option<f64>]| {
        let mut values: Vec<f64> = values.iter().flatten().copied().collect();
        values.sort_unstable_by(f64::total_cmp);
        values
    };
    let (a, b) = (sorted(a), sorted(b));
    let share = |values: &[f64], x: f64| {
        values.partition_point(|value| *value <= x) as f64 / values.len() as f64
    };
    let gap = a
        .iter()
        .map(|x| (share(&a, *x) - share(&b, *x)).abs())
        .fold(0.0, f64::max);
    let (n, m) = (a.len() as f64, b.len() as f64);
    gap * (n * m / (n + m)).sqrt()
}

fn loss(delays: &[Option<f64>]) -> f64 {
    delays.iter().filter(|delay| delay.is_none()).count() as f64 / delays.len() as f64
}

/// The mean run of lost packets.
fn burst(delays: &[Option<f64>]) -> f64 {
    let begins = delays
        .windows(2)
        .filter(|pair| pair[0].is_some() && pair[1].is_none());
    loss(delays) * delays.len() as f64 / begins.count() as f64
}

#[test]
fn uniform_jitter_is_the_same_distribution() {
    let config = || {
        NetemConfig::new()
            .latency(Duration::from_millis(50))
            .jitter(Duration::from_millis(5))
    };
    let ours = ours("delay 50ms 5ms");
    let ks = kolmogorov_smirnov(&ours, &theirs(config()));
    assert!(ks < 1.95, "{ks}");
    // and the test would notice another
    let wider = theirs(config().jitter(Duration::from_micros(5200)));
    assert!(kolmogorov_smirnov(&ours, &wider) > 1.95);
}

#[test]
fn independent_loss_is_the_same_share() {
    for percent in [1.0_f32, 10.0] {
        let config = NetemConfig::new().loss(RandomLoss::new(Probability::new(percent / 100.0)));
        let (ours, theirs) = (
            loss(&ours(&format!("loss {percent}%"))),
            loss(&theirs(config)),
        );
        let p = f64::from(percent) / 100.0;
        let spread = (2.0 * p * (1.0 - p) / N as f64).sqrt();
        assert!((ours - theirs).abs() < 4.0 * spread, "{ours} {theirs}");
    }
}

#[test]
fn gilbert_elliott_has_the_same_share_and_the_same_bursts() {
    let chain = GilbertElliot::new()
        .good_duration(50.0)
        .bad_duration(4.0)
        .loss_in_bad(Probability::new(1.0));
    let theirs = theirs(NetemConfig::new().loss(chain));
    let ours = ours("loss gemodel 2% 25%");
    // 926 bursts each: shares to 1 / sqrt(926) times sqrt(2) each, differences times sqrt(2)
    let spread = 2.0 / 926.0_f64.sqrt();
    let shares = loss(&ours) / loss(&theirs);
    assert!((shares - 1.0).abs() < 4.0 * spread, "{shares}");
    let bursts = burst(&ours) / burst(&theirs);
    assert!((bursts - 1.0).abs() < 4.0 * spread, "{bursts}");
}

#[test]
fn packets_at_a_rate_are_equally_far_apart() {
    let config = NetemConfig::new().link(Bitrate::mbps(1), DataSize::bytes(1_000_000));
    let mut netem: Netem<Vec<u8>> = Netem::new(config);
    let start = Instant::now();
    for _ in 0..10 {
        netem.handle_input(Input::Packet(start, vec![0; BYTES]));
    }
    let mut theirs = Vec::new();
    while !netem.is_empty() {
        let due = netem.poll_timeout();
        netem.handle_input(Input::Timeout(due));
        while let Some(output) = netem.poll_output() {
            if matches!(output, Output::Packet(_)) {
                theirs.push(due.duration_since(start));
            }
        }
    }
    let mut link = Link::try_new("rate 1mbit".parse().unwrap(), 1, LinkId::UP).unwrap();
    (0..10).for_each(|_| link.offer(Time::ZERO, Packet::new(BYTES, ())));
    let ours: Vec<Duration> = std::iter::from_fn(|| link.poll(Time::MAX))
        .map(|out| out.due.saturating_since(Time::ZERO))
        .collect();
    let apart = |dues: &[Duration]| -> Vec<Duration> {
        dues.windows(2).map(|pair| pair[1] - pair[0]).collect()
    };
    assert_eq!(ours.len(), theirs.len());
    assert_eq!(apart(&ours), apart(&theirs));
}
