//! Cross traffic: a queue as theory has it, on the same network whoever sends, counted by itself.

use super::*;

/// What packets without bytes, which take no time on the wire, wait at 1 kHz, ms.
fn waits(words: &str, step: u64) -> (Link<()>, Vec<f64>) {
    let mut link = link(words, 11, LinkId::UP);
    let packets = (0..4 * N).step_by(step as usize);
    let packets = packets.map(|packet| (Time::from_millis(packet), Packet::new(0, ())));
    let out = run(&mut link, packets);
    let wait = |out: &Departure<()>| out.queued.as_secs_f64() * 1e3;
    let waits = out.iter().map(wait).collect();
    (link, waits)
}

#[test]
fn utilisation_and_queue_are_those_of_m_d_1() {
    // 1250 bytes at 10 Mbit/s: 1 ms each
    for (load, tolerance) in [(0.5, 0.02), (0.8, 0.04)] {
        let rate = (1e7 * load) as u64;
        let (link, waits) = waits(
            &format!("rate 10mbit limit 100000 cross {rate}bit poisson 1250"),
            1,
        );
        let n = waits.len() as f64;
        let sent = link.counters().cross.sent.packets as f64;
        // 4 standard deviations of a Poisson count
        assert!(
            (sent - load * n).abs() < 4.0 * (load * n).sqrt() + 1.0,
            "{load}: {sent} in {n} ms"
        );
        let idle = waits.iter().filter(|wait| **wait == 0.0).count() as f64 / n;
        assert!((idle - (1.0 - load)).abs() < 0.01, "{load}: idle {idle}");
        // Pollaczek and Khinchine: rho / (2 (1 - rho)) of a service time
        let (mean, _) = mean_and_sd(&waits);
        let expected = load / (2.0 * (1.0 - load));
        assert!(
            (mean / expected - 1.0).abs() < tolerance,
            "{load}: {mean} instead of {expected}"
        );
        // and the test would notice the queue of exponential services, twice as long
        assert!((mean / (2.0 * expected) - 1.0).abs() > 10.0 * tolerance);
    }
}

#[test]
fn two_packet_rates_meet_the_same_cross_traffic() {
    let words = "rate 10mbit cross 7mbit poisson 1250; at 30s rate 10mbit; at 60s rate 10mbit cross 3mbit poisson 500";
    let (_, fast) = waits(words, 1);
    let (_, slow) = waits(words, 7);
    let same: Vec<f64> = fast.iter().step_by(7).copied().collect();
    assert_eq!(slow, same);
    assert!(fast[..30_000].iter().any(|wait| *wait > 3.0));
    assert!(
        fast[30_100..60_000].iter().all(|wait| *wait == 0.0),
        "none of it from 30 to 60 s"
    );
}

#[test]
fn cross_traffic_leaves_all_other_draws_alone() {
    let effects = "rate 100mbit loss 5% duplicate 5% corrupt 5% delay 9ms 3ms order free";
    let with = format!("{effects} cross 50mbit poisson 1200");
    let packets = || (0..N).map(|packet| (Time::from_millis(packet), Packet::new(100, ())));
    let alone = with_copies(&mut link(effects, 13, LinkId::UP), packets());
    let beside = with_copies(&mut link(&with, 13, LinkId::UP), packets());
    assert_eq!(alone.len(), beside.len());
    for (alone, beside) in alone.iter().zip(&beside) {
        assert_eq!(
            (alone.number, alone.copy, alone.fate),
            (beside.number, beside.copy, beside.fate)
        );
        let due = |out: &Departure<()>| {
            out.is_delivered()
                .then(|| out.due.saturating_since(Time::ZERO) - out.queued)
        };
        assert_eq!(due(alone), due(beside));
    }
}

#[test]
fn cross_traffic_takes_the_room_and_is_counted_by_itself() {
    for (words, least) in [
        ("rate 1mbit queue 20p cross 2mbit poisson 1000", 1000),
        (
            "rate 1mbit queue 20p drop-head cross 2mbit poisson 1000",
            1000,
        ),
        ("rate 1mbit codel limit 500 cross 2mbit poisson 1000", 1000),
        // as many of each as the limit has
        ("rate 1mbit limit 20 cross 2mbit poisson 1000", 0),
    ] {
        let mut link = link(words, 17, LinkId::UP);
        let packets = (0..10_000).map(|at| (Time::from_millis(10 * at), Packet::new(100, ())));
        let out = run(&mut link, packets);
        let counters = link.counters();
        let (own, cross) = (counters.dropped.total().packets, counters.cross);
        assert_eq!(counters.offered.packets, 10_000, "{words}");
        assert_eq!(
            own,
            out.iter().filter(|out| !out.is_delivered()).count() as u64,
            "{words}"
        );
        assert!(own >= least, "{words}: {own}");
        // 250 /s for 100 s, of which 1 Mbit/s takes what is left of ours
        assert!(
            (cross.offered.packets as f64 - 25_000.0).abs() < 4.0 * 25_000_f64.sqrt(),
            "{words}"
        );
        assert_eq!(cross.offered.bytes, 1000 * cross.offered.packets);
        let ended = cross.sent.plus(cross.dropped).packets;
        assert!(cross.offered.packets - ended <= 500, "{words}");
        let bits = 8 * (cross.sent.bytes + counters.delivered.bytes);
        assert!((bits as f64 / 1e8 - 1.0).abs() < 0.02, "{words}: {bits}");
    }
}

#[test]
fn a_long_silence_costs_no_work_and_what_comes_after_meets_cross_traffic_again() {
    let mut link = link("rate 1gbit cross 500mbit poisson 100", 19, LinkId::UP);
    let hours = |ms: u64| Time::from_millis(10 * 3_600_000 + ms);
    let packets = [Time::ZERO].into_iter().chain((0..1000).map(hours));
    let out = run(&mut link, packets.map(|now| (now, Packet::new(0, ()))));
    assert_eq!(link.poll_timeout(), None, "nothing of ours is on the link");
    let waited = out.iter().filter(|out| !out.queued.is_zero()).count();
    assert!((400..600).contains(&waited), "{waited}");
}
