//! The line printed at the start tells the truth.

use super::offers::{CROSS_MAX, PACKETS_MAX, STRETCHES};
use super::*;
use crate::record::summary::runs;

fn at_1_khz(words: &str) -> Effect {
    words
        .parse::<LinkConfig>()
        .unwrap()
        .expected(1000.0, BYTES)
        .unwrap()
}

#[test]
fn a_constant_link_does_just_what_it_states() {
    let effect = at_1_khz("delay 50ms loss 1%");
    assert!((effect.mean_ms - 50.0).abs() < 1e-6, "{effect:?}");
    assert!((effect.p99_ms - 50.0).abs() < 1e-6 && effect.sd_ms < 1e-6);
    assert_eq!((effect.loss, effect.reordered), (0.01, 0.0));
    assert_eq!((effect.waiting_ms, effect.over_limit), (0.0, 0.0));
}

#[test]
fn free_jitter_has_the_moments_of_its_distribution_and_fifo_raises_the_mean() {
    let free = at_1_khz("delay 50ms 5ms distribution normal order free");
    let n = f64::from(PACKETS);
    assert!((free.mean_ms - 50.0).abs() < 4.0 * 5.0 / n.sqrt(), "{free}");
    assert!(
        (free.sd_ms / 5.0 - 1.0).abs() < 4.0 / (2.0 * n).sqrt(),
        "{free}"
    );
    // 2.326 is the 99 % quantile; density there 0.0267
    let p99_error = 4.0 * 5.0 * (0.01_f64 * 0.99 / n).sqrt() / 0.0267;
    assert!(
        (free.p99_ms - 50.0 - 5.0 * 2.326).abs() < p99_error,
        "{free}"
    );

    let fifo = at_1_khz("delay 50ms 5ms distribution normal");
    assert_eq!(fifo.reordered, 0.0);
    assert!(fifo.waiting_ms > 1.0 && fifo.sd_ms < free.sd_ms, "{fifo}");
    assert!((fifo.mean_ms - fifo.waiting_ms - free.mean_ms).abs() < 1e-9);
}

#[test]
fn the_share_reordered_is_the_one_known_of_tc_and_falls_with_the_rate() {
    // re-running the kernel's own arithmetic gave 72 % at 1 kHz
    let config: LinkConfig = "delay 50ms 5ms distribution normal order free"
        .parse()
        .unwrap();
    let fast = config.expected(1000.0, BYTES).unwrap().reordered;
    assert!((fast - 0.72).abs() < 0.02, "{fast}");
    assert_eq!(config.expected(7.0, BYTES).unwrap().reordered, 0.0);
}

#[test]
fn a_limit_below_rate_times_delay_shows() {
    // 20 of each 50 packets find room
    let effect = at_1_khz("delay 50ms limit 20");
    assert!((effect.over_limit - 0.6).abs() < 0.01, "{effect}");
    assert!(effect.to_string().contains("dropped over the limit"));
}

#[test]
fn rates_without_sense_are_taken_to_the_nearest_with_sense() {
    let config = LinkConfig::default();
    let (low, high) = RATE_RANGE_HZ;
    for (asked, used) in [
        (f64::NAN, low),
        (-1.0, low),
        (0.0, low),
        (f64::INFINITY, high),
    ] {
        assert_eq!(config.expected(asked, BYTES).unwrap().rate_hz, used);
    }
}

#[test]
fn the_line_reads_as_documented() {
    assert_eq!(
        at_1_khz("delay 50ms 5ms loss 1%").to_string(),
        "at 1000 packets/s: delay mean 51.86 ms, s.d. 1.73 ms, p99 54.90 ms; loss 1.000 % in \
         bursts of 1.01 packets; reordered 0.0 %; keeping order adds 1.87 ms to the mean"
    );
}

#[test]
fn the_formula_for_bursts_is_what_a_stream_meets() {
    for (words, rate_hz) in [
        ("loss 20%", 1000.0),
        ("loss gemodel 2% 25%", 1000.0),
        ("loss burst 5% 40ms", 1000.0),
        ("loss burst 5% 40ms", 50.0),
        ("loss burst 30% 40ms", 10.0),
    ] {
        let config: LinkConfig = words.parse().unwrap();
        let known = config.expected(rate_hz, BYTES).unwrap().burst_packets;
        let interval = Duration::from_secs_f64(1.0 / rate_hz);
        let packets: Vec<_> = (0..PACKETS_MAX)
            .map(|packet| (Time::ZERO + interval * packet, BYTES))
            .collect();
        let stream = Stream::through(&config, &Offers::recorded(&packets)).unwrap();
        let met = mean_run(&runs(stream.lost.iter().copied()));
        assert!((met / known - 1.0).abs() < 0.15, "{words}: {met} {known}");
    }
}

#[test]
fn a_bottleneck_that_is_too_slow_shows() {
    // 128 bytes at 64 kbit/s: 62.5 of 1000 packets a second
    let effect = at_1_khz("rate 64kbit 28 queue 200ms");
    assert!((effect.queue_drops - 0.9375).abs() < 0.001, "{effect}");
    assert!((200.0..217.0).contains(&effect.p99_ms), "{effect}");
    assert!(effect.to_string().contains("dropped by the queue"));
}

#[test]
fn what_happens_on_time_is_sampled() {
    let effect = at_1_khz("outage 1s for 500ms every 10s");
    assert!((effect.loss - 0.05).abs() < 0.001, "{effect}");
    assert!((effect.burst_packets - 500.0).abs() < 1.0, "{effect}");
}

#[test]
fn what_is_marked_is_not_lost() {
    let effect = at_1_khz("loss 2% ecn");
    assert_eq!((effect.loss, effect.burst_packets), (0.0, 0.0));
    assert!((effect.marked - 0.02).abs() < 0.003, "{}", effect.marked);
    assert!(effect.to_string().contains("% marked (ECN)"), "{effect}");
    assert!(!at_1_khz("loss 2%").to_string().contains("marked"));
}

#[test]
fn the_sizes_of_the_packets_count_and_so_do_their_times() {
    // iperf3's 1448 bytes at 2 Mbit/s into 1 Mbit/s with 100 ms of queue
    let config: LinkConfig = "rate 1mbit 28 queue 100ms".parse().unwrap();
    let even = config.expected(2e6 / 8.0 / 1448.0, 1448).unwrap();
    assert!((even.queue_drops - 0.51).abs() < 0.01, "{even}");
    assert!((100.0..125.0).contains(&even.mean_ms), "{even}");
    assert!(
        even.to_string().contains("packets/s of 1448 bytes"),
        "{even}"
    );
    // ten at once, every 100 ms: each waits for those before it
    let burst = |packet: u64| (Time::from_millis(packet / 10 * 100), 972);
    let bursts: Vec<_> = (0..1000).map(burst).collect();
    let effect = config.expected_of(&bursts).unwrap();
    assert!((effect.mean_ms - 8.0 * 5.5).abs() < 1e-6, "{effect}");
    assert_eq!((effect.queue_drops, effect.bytes), (0.0, 972.0));
}

#[test]
fn the_effect_of_a_chain_is_that_of_all_its_links() {
    let effect = at_1_khz("delay 20ms loss 10%; then delay 30ms loss 20%");
    assert!((effect.mean_ms - 50.0).abs() < 1e-6, "{effect}");
    assert!((effect.loss - 0.28).abs() < 1e-12, "{effect}");
    assert!((effect.burst_packets - 1.0 / 0.72).abs() < 0.02, "{effect}");
    // without a formula it is sampled
    let effect = at_1_khz("loss 10%; then outage 1s for 1s every 2s");
    assert!((effect.loss - 0.55).abs() < 0.01, "{effect}");
    // a queue sends in the order in which packets come to it
    let effect = at_1_khz("delay 20ms 5ms order free; then rate 100mbit");
    assert!(effect.reordered > 0.1, "{effect}");
    let fifo = at_1_khz("delay 20ms 5ms; then delay 20ms 5ms");
    let free = at_1_khz("delay 20ms 5ms order free; then delay 20ms 5ms order free");
    assert_eq!(fifo.reordered, 0.0);
    assert!((fifo.mean_ms - fifo.waiting_ms - free.mean_ms).abs() < 1e-9);
    // half as much again as the second bottleneck sends: all lose, but not all alike
    let effect = at_1_khz("delay 5ms; then rate 1600kbit queue 20p cross 1600kbit poisson 100");
    assert!((0.15..0.35).contains(&effect.queue_drops), "{effect}");
}

#[test]
fn a_whole_trace_shows_and_no_stream_keeps_step_with_it() {
    use crate::trace::Sample;
    use crate::trace::path::{PathTrace, Replay};
    use std::sync::Arc;
    let replayed = |samples: Vec<Sample>| {
        let path = Arc::new(PathTrace::try_new(samples).unwrap());
        LinkConfig {
            replay: Some(Replay {
                name: "t".to_owned(),
                direction: None,
                path,
            }),
            ..LinkConfig::default()
        }
    };
    // an hour whose last half is 60 ms instead of 20
    let sample = |s: u64, ms| Sample {
        at: Duration::from_secs(s),
        delay: Some(Duration::from_millis(ms)),
    };
    let hour = (0..3600).map(|s| sample(s, if s < 1800 { 20 } else { 60 }));
    let effect = replayed(hour.collect()).expected(1000.0, BYTES).unwrap();
    assert!((effect.mean_ms - 40.0).abs() < 0.5, "{effect}");
    // every other sample of a trace as fast as the stream is lost
    let beat = (0..2000).map(|at| Sample {
        at: Duration::from_millis(5 * at),
        delay: (at % 2 == 0).then_some(Duration::from_millis(9)),
    });
    let effect = replayed(beat.collect()).expected(100.0, BYTES).unwrap();
    assert!((effect.loss - 0.5).abs() < 0.2, "{effect}");
}

#[test]
fn fast_cross_traffic_shortens_the_stream() {
    let packets = |words: &str, rate_hz| {
        let offers = Offers::even(&words.parse().unwrap(), rate_hz, BYTES);
        offers.packets.len() as u32
    };
    let ordinary = "rate 10mbit queue 50ms cross 6mbit poisson 1200";
    assert_eq!(packets(ordinary, 100.0), PACKETS);
    // 62 500 packets of others a second
    let fast = "rate 1gbit queue 50ms cross 600mbit poisson 1200";
    for words in [
        fast.to_owned(),
        format!("delay 5ms; then {fast}"),
        format!("rate 1gbit; at 1s {fast}"),
    ] {
        assert_eq!(
            packets(&words, 100.0),
            CROSS_MAX / 625 / 100 * 100,
            "{words}"
        );
        assert_eq!(packets(&words, 0.01), STRETCHES, "{words}");
    }
}

#[test]
fn nothing_is_less_than_zero() {
    for words in [
        "none",
        "loss 100%",
        "delay 5ms",
        "delay 5ms 1us",
        "duplicate 50%",
        "rate 1gbit",
        "outage 0s for 3599s every 3600s delay 1ms",
    ] {
        let config: LinkConfig = words.parse().unwrap();
        let text = config.expected(100.0, BYTES).unwrap().to_string();
        assert!(!text.contains("-0"), "{words}: {text}");
    }
}
