//! What a packet costs in the pure link.

#![allow(missing_docs, reason = "criterion's macros make undocumented items")]
#![allow(clippy::unwrap_used, reason = "a bench is a test: it may panic")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use mmt_netem::{Link, LinkId, Packet};
use mmt_shared::time::{TICK, Time};

const SETTINGS: [&str; 12] = [
    "none",
    "delay 50ms",
    "delay 50ms 5ms loss 1%",
    "delay 50ms 5ms distribution normal loss 1%",
    "delay 50ms 5ms 50% distribution paretonormal loss gemodel 1% 10%",
    "delay 50ms 5ms tau 100ms distribution lognormal loss burst 1% 40ms",
    "delay 50ms 5ms distribution gamma",
    "delay 50ms 20ms distribution gamma",
    "delay 50ms 5ms order free reorder 1% gap 5 loss state 1% 10% 5% 20%",
    "delay 50ms slot 10ms 12ms packets 8 loss 1% ecn outage 100ms for 50ms every 1s",
    "delay 50ms rate 10mbit 28 queue 100ms codel duplicate 1% corrupt 1%",
    "delay 50ms 5ms loss 1%; at 1s over 2s delay 80ms; loop 5s",
];

fn offer_and_poll(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("Link: offer and poll");
    for words in SETTINGS {
        let mut link = Link::try_new(words.parse().unwrap(), 1, LinkId::UP).unwrap();
        let mut now = Time::ZERO;
        group.bench_function(words, |bencher| {
            bencher.iter(|| {
                now += TICK;
                while let Some(packet) = link.poll(now) {
                    black_box(packet);
                }
                link.offer(black_box(now), Packet::new(100, 0_u64));
            });
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(50)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    targets = offer_and_poll
}
criterion_main!(benches);
