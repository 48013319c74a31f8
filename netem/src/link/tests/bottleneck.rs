//! The bottleneck: exact spacing, exact limits, controlled delay.

use super::*;
use crate::LinkConfig;

const PACKET: PacketMeta = PacketMeta {
    bytes: 1000,
    in_flight: 0,
    ecn_capable: false,
};

#[test]
fn packets_leave_one_after_the_other_at_the_rate() {
    // (1000 + 28) bytes at 1 Mbit/s: 8.224 ms
    let mut link = link("rate 1mbit 28", 1, LinkId::UP);
    for packet in 0..100_u64 {
        let due = link.offer(Time::ZERO, PACKET).due().unwrap();
        assert_eq!(due.as_nanos(), (packet + 1) * 8_224_000);
    }
    // after a pause the wire is free
    let later = Time::from_millis(2000);
    let due = link.offer(later, PACKET).due().unwrap();
    assert_eq!(due.as_nanos(), 2_008_224_000);
}

#[test]
fn overheads_and_cells_weigh_as_in_tc() {
    let weight = |words: &str, bytes| {
        let config: LinkConfig = words.parse().unwrap();
        config.rate.unwrap().framing.weight(bytes)
    };
    assert_eq!(weight("rate 1mbit", 100), 100);
    assert_eq!(weight("rate 1mbit 28", 100), 128);
    assert_eq!(weight("rate 1mbit -200", 100), 0);
    // 100 + 0 bytes in cells of 48, five bytes on each
    assert_eq!(weight("rate 1mbit 0 48 5", 100), 3 * 53);
}

#[test]
fn a_queue_holds_what_its_limit_says_in_packets_bytes_and_time() {
    // 8 ms a packet
    for (limit, held) in [
        ("5p", 5),
        ("5000b", 5),
        ("4999b", 4),
        ("32ms", 5),
        ("31ms", 4),
    ] {
        let mut link = link(&format!("rate 1mbit queue {limit}"), 1, LinkId::UP);
        let fates: Vec<Fate> = (0..10).map(|_| link.offer(Time::ZERO, PACKET)).collect();
        let kept = fates.iter().take_while(|fate| fate.due().is_some()).count();
        assert_eq!(kept, held, "{limit}");
        assert_eq!(link.counters().dropped.queue.packets, 10 - held as u64);
        assert_eq!(link.backlog(), held);
        // room again when one is gone
        let room = link.offer(Time::from_millis(8), PACKET);
        assert!(room.due().is_some(), "{limit}");
    }
}

#[test]
fn an_overloaded_queue_never_outgrows_the_links_own_limit_nor_its_memory() {
    let mut link = link("rate 1kbit limit 50", 1, LinkId::UP);
    for packet in 0..1000 {
        link.offer(Time::from_millis(packet), PACKET);
        assert!(link.backlog() <= 50);
    }
    assert_eq!(link.counters().dropped.queue.packets, 950);
}

/// 1.1 messages a millisecond over a link that takes one: the waits of what arrived, ms.
fn waits(words: &str) -> Vec<f64> {
    let mut link = link(words, 1, LinkId::UP);
    let offer = |number: u64| {
        let now = Time::from_nanos(number * 10_000_000 / 11);
        let due = link.offer(now, PACKET).due()?;
        Some(due.saturating_since(now).as_secs_f64() * 1e3)
    };
    (0..40_000).filter_map(offer).collect()
}

#[test]
fn codel_brings_a_standing_queue_down_to_its_target_and_a_plain_queue_does_not() {
    let plain = waits("rate 8mbit queue 500ms");
    assert!(plain[plain.len() / 2..].iter().all(|wait| *wait > 400.0));
    let controlled = waits("rate 8mbit queue 500ms codel");
    // a sender that does not listen: the drops come faster and faster until they are enough, and the
    // queue swings between empty and what an interval adds
    let late = &controlled[controlled.len() / 2..];
    let (mean, _) = mean_and_sd(late);
    assert!(mean < 40.0, "{mean}");
    // all the same the wire is never idle
    let share = controlled.len() as f64 / (40_000.0 / 1.1);
    assert!((0.98..1.03).contains(&share), "{share}");
}

#[test]
fn codel_leaves_a_short_queue_alone() {
    // bursts of four packets, 1 ms each, every 10 ms: never 5 ms for a whole interval
    let mut link = link("rate 8mbit codel", 1, LinkId::UP);
    for burst in 0..1000 {
        for _ in 0..4 {
            let fate = link.offer(Time::from_millis(10 * burst), PACKET);
            assert!(fate.due().is_some());
        }
    }
    // and a packet that takes longer than the target on a slow wire is no standing queue
    let mut slow = super::link("rate 64kbit codel", 1, LinkId::UP);
    for packet in 0..1000 {
        let fate = slow.offer(Time::from_millis(130 * packet), PACKET);
        assert!(fate.due().is_some());
    }
}

#[test]
fn codel_drops_at_the_times_of_its_control_law() {
    // RFC 8289: after the first interval above the target a drop, the next after interval / sqrt(n)
    let mut state = super::super::codel::CodelState::default();
    let (target, interval) = (5 * MS, 100 * MS);
    let dropped: Vec<u64> = (0..400)
        .filter(|ms| state.drops(target, interval, MS * *ms, 50 * MS, false))
        .map(u64::from)
        .collect();
    // 100, then +100/1, +100/sqrt 2, +100/sqrt 3, rounded up to the next packet
    assert_eq!(dropped[..4], [100, 200, 271, 329]);
}

#[test]
fn a_mahimahi_trace_sends_1500_bytes_at_each_of_its_times_over_and_over() {
    let trace = "10\n10\n20\n50\n";
    let config = crate::words::parse("rate trace cell.up", &mut |_| Ok(trace.to_owned())).unwrap();
    let mut link = Link::try_new(config, 1, LinkId::UP).unwrap();
    let mut due_ms = |now_ms, bytes| {
        let meta = PacketMeta {
            bytes,
            in_flight: 0,
            ecn_capable: false,
        };
        let due = link.offer(Time::from_millis(now_ms), meta).due().unwrap();
        due.as_nanos() / 1_000_000
    };
    // two small ones share an opportunity, the third needs the rest of it and the next
    assert_eq!(
        [due_ms(0, 700), due_ms(0, 700), due_ms(0, 700)],
        [10, 10, 10]
    );
    assert_eq!(due_ms(0, 1500), 20);
    // 4500 bytes: what is left at 20 ms, 50 ms, and 60 ms twice (the trace again)
    assert_eq!(due_ms(0, 4500), 60);
    // opportunities that nobody used are gone
    assert_eq!(due_ms(121, 100), 150);
}
