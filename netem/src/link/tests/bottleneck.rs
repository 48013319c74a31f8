//! The bottleneck: exact spacing, exact limits, changes of rate with a backlog, controlled delay.

use super::*;
use crate::LinkConfig;

fn packet() -> Packet<()> {
    Packet::new(1000, ())
}

fn at_ms(ms: impl Iterator<Item = u64>) -> impl Iterator<Item = (Time, Packet<()>)> {
    ms.map(|ms| (Time::from_millis(ms), packet()))
}

fn dues_ms(departures: &[Departure<()>]) -> Vec<u64> {
    let dues = departures.iter().map(|out| met(out).unwrap());
    dues.map(|due| due.as_nanos() / 1_000_000).collect()
}

#[test]
fn packets_leave_one_after_the_other_at_the_rate() {
    // (1000 + 28) bytes at 1 Mbit/s: 8.224 ms
    let mut link = link("rate 1mbit 28", 1, LinkId::UP);
    let out = run(&mut link, at_ms(std::iter::repeat_n(0, 100)));
    for (before, out) in (0_u64..).zip(&out) {
        assert_eq!(out.due.as_nanos(), (before + 1) * 8_224_000);
        assert_eq!(out.queued.as_nanos(), u128::from(before) * 8_224_000);
    }
    // after a pause the wire is free
    let due = one(&mut link, Time::from_millis(2000), 1000).unwrap();
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
fn a_queue_holds_what_its_limit_states_in_packets_bytes_and_time() {
    // 8 ms a packet
    for (limit, held) in [
        ("5p", 5),
        ("5000b", 5),
        ("4999b", 4),
        ("32ms", 5),
        ("31ms", 4),
    ] {
        let mut link = link(&format!("rate 1mbit queue {limit}"), 1, LinkId::UP);
        (0..10).for_each(|_| link.offer(Time::ZERO, packet()));
        assert_eq!(link.in_flight(), held, "{limit}");
        let dropped: Vec<Departure<()>> = std::iter::from_fn(|| link.poll(Time::ZERO)).collect();
        let numbers: Vec<usize> = dropped.iter().map(|out| out.number as usize).collect();
        assert_eq!(numbers, (held..10).collect::<Vec<_>>(), "the last ones");
        assert_eq!(link.counters().dropped.queue.packets, 10 - held as u64);
        // room again when one is gone
        link.offer(Time::from_millis(8), packet());
        assert_eq!(link.counters().dropped.queue.packets, 10 - held as u64);
    }
}

#[test]
fn a_queue_that_drops_at_its_head_keeps_the_newest() {
    for limit in ["5p", "5000b", "32ms"] {
        let words = format!("rate 1mbit queue {limit} drop-head");
        let out = run(
            &mut link(&words, 1, LinkId::UP),
            at_ms(std::iter::repeat_n(0, 10)),
        );
        let kept: Vec<usize> = (0..10).filter(|at| met(&out[*at]).is_ok()).collect();
        // the first is on the wire already
        assert_eq!(kept, [0, 6, 7, 8, 9], "{limit}");
        assert!(
            out.iter()
                .all(|out| met(out).is_ok() || met(out) == Err(DropCause::Queue))
        );
    }
}

#[test]
fn who_finds_no_room_beside_the_packet_on_the_wire_drives_nobody_out() {
    let mut link = link("rate 1mbit queue 1500b drop-head", 1, LinkId::UP);
    // 1000 bytes are on the wire
    let offers = [1000, 200, 1400, 300].map(|bytes| (Time::ZERO, Packet::new(bytes, ())));
    let out = run(&mut link, offers.into_iter());
    let kept: Vec<bool> = out.iter().map(|out| met(out).is_ok()).collect();
    assert_eq!(kept, [true, true, false, true]);
}

#[test]
fn an_overloaded_queue_never_outgrows_the_links_own_limit() {
    let mut link = link("rate 1kbit limit 50", 1, LinkId::UP);
    for packets in 0..1000 {
        link.offer(Time::from_millis(packets), packet());
        assert!(link.in_flight() <= 50);
    }
    assert_eq!(link.counters().dropped.limit.packets, 950);
}

/// 1.1 messages a millisecond over a link that takes one: the waits of what arrived, ms.
fn waits(words: &str) -> Vec<f64> {
    let offers =
        (0..40_000).map(|number: u64| (Time::from_nanos(number * 10_000_000 / 11), packet()));
    let out = run(&mut link(words, 1, LinkId::UP), offers);
    let delivered = out.iter().filter(|out| out.is_delivered());
    let wait = |out: &Departure<()>| out.due.saturating_since(out.offered_at).as_secs_f64() * 1e3;
    delivered.map(wait).collect()
}

#[test]
fn codel_brings_a_standing_queue_down_to_its_target_and_a_plain_queue_does_not() {
    let plain = waits("rate 8mbit queue 500ms");
    assert!(plain[plain.len() / 2..].iter().all(|wait| *wait > 400.0));
    let controlled = waits("rate 8mbit queue 500ms codel");
    // a sender that does not slow down: the drops come faster and faster until they are enough, and the
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
    let bursts = (0..4000).map(|number| number / 4 * 10);
    let out = run(&mut link("rate 8mbit codel", 1, LinkId::UP), at_ms(bursts));
    assert!(out.iter().all(Departure::is_delivered));
    // and a packet that takes longer than the target on a slow wire is no standing queue
    let slow = (0..1000).map(|number| 130 * number);
    let out = run(&mut link("rate 64kbit codel", 1, LinkId::UP), at_ms(slow));
    assert!(out.iter().all(Departure::is_delivered));
}

#[test]
fn codel_drops_at_the_times_of_its_control_law() {
    // RFC 8289: after the first interval above the target a drop, the next after interval / sqrt(n)
    let mut state = super::super::codel::CodelState::default();
    let (target, interval) = (5 * MS, 100 * MS);
    let dropped: Vec<u64> = (0..400)
        .filter(|ms| state.drops(target, interval, MS * *ms, 50 * MS))
        .map(u64::from)
        .collect();
    // 100, then +100/1, +100/sqrt 2, +100/sqrt 3, rounded up to the next packet
    assert_eq!(dropped[..4], [100, 200, 271, 329]);
}

/// Settings with traces: SLOW gives 1500 bytes a second, FAST 1500 bytes a millisecond.
fn traced(words: &str) -> LinkConfig {
    let read = &mut |name: &str| match name {
        "SLOW" => Ok("1000\n".to_owned()),
        "FAST" => Ok("1\n".to_owned()),
        other => Ok(other.replace('_', "\n")),
    };
    crate::words::parse(words, read).unwrap()
}

#[test]
fn a_mahimahi_trace_sends_1500_bytes_at_each_of_its_times_over_and_over() {
    let mut link = Link::try_new(traced("rate trace 10_10_20_50"), 1, LinkId::UP).unwrap();
    // two small ones share an opportunity, the third needs the rest of it and the next; of 4500 bytes goes
    // what is left at 20 ms, 50 ms, and 60 ms twice (the trace again); opportunities that nobody used are gone
    let offers = [
        (0, 700),
        (0, 700),
        (0, 700),
        (0, 1500),
        (0, 4500),
        (121, 100),
    ];
    let offers = offers.map(|(ms, bytes)| (Time::from_millis(ms), Packet::new(bytes, ())));
    let out = run(&mut link, offers.into_iter());
    assert_eq!(dues_ms(&out), [10, 10, 10, 20, 60, 150]);
    assert_eq!(out[4].queued, 20 * MS, "until its first byte was sent");
}

/// Offers at the times given; the settings change at `change_ms`.
fn changed(from: &str, to: &str, change_ms: u64, offers_ms: &[u64]) -> Vec<Departure<()>> {
    let mut link = Link::try_new(traced(from), 1, LinkId::UP).unwrap();
    let (before, after): (Vec<u64>, Vec<u64>) = offers_ms.iter().partition(|ms| **ms < change_ms);
    for ms in before {
        link.offer(Time::from_millis(ms), packet());
    }
    link.reconfigure(Time::from_millis(change_ms), traced(to))
        .unwrap();
    run(&mut link, at_ms(after.into_iter()))
}

#[test]
fn a_change_to_another_trace_sends_at_the_pace_of_the_new_one() {
    for (from, to) in [("SLOW", "FAST"), ("FAST", "SLOW")] {
        // one packet a second before, one a millisecond after, or the other way round
        let slow = if from == "SLOW" {
            (0..3000).step_by(1000)
        } else {
            (3000..90_000).step_by(1000)
        };
        let fast = if from == "SLOW" { 3000..6000 } else { 0..3000 };
        let mut offers: Vec<u64> = slow.chain(fast).collect();
        offers.sort_unstable();
        let words = |trace| format!("rate trace {trace} queue 50p");
        let out = changed(&words(from), &words(to), 3000, &offers);
        assert_eq!(out.len(), offers.len());
        assert!(out.iter().all(Departure::is_delivered), "{from} to {to}");
        let worst = out
            .iter()
            .map(|out| out.due.saturating_since(out.offered_at));
        assert!(worst.max().unwrap() <= 1000 * MS, "{from} to {to}");
    }
}

#[test]
fn what_waits_is_sent_at_the_new_rate_and_in_order() {
    let backlog = [0; 10];
    // by 3 s four packets are sent, and half of the fifth
    let slow_to_fast = changed("rate trace SLOW", "rate trace FAST", 3000, &backlog);
    let expected = [1000, 2000, 2000, 3000, 3000, 3000, 3001, 3002, 3002, 3003];
    assert_eq!(dues_ms(&slow_to_fast), expected);
    let fast_to_slow = changed("rate trace FAST", "rate trace SLOW", 3, &backlog);
    let expected = [1, 2, 2, 3, 1000, 1000, 2000, 3000, 3000, 4000];
    assert_eq!(dues_ms(&fast_to_slow), expected);
    // 100 ms a packet; the third is on the wire at the change and leaves as it would have
    let constant_to_trace = changed("rate 80kbit", "rate trace FAST", 250, &backlog);
    let expected = [100, 200, 300, 300, 301, 301, 302, 303, 303, 304];
    assert_eq!(dues_ms(&constant_to_trace), expected);
    // half of the second packet went with the first
    let trace_to_constant = changed("rate trace 100_1100", "rate 8mbit", 500, &backlog);
    let expected = [100, 500, 501, 502, 503, 504, 505, 506, 507, 508];
    assert_eq!(dues_ms(&trace_to_constant), expected);
    let faster = changed("rate 80kbit", "rate 8mbit", 250, &backlog);
    assert_eq!(
        dues_ms(&faster),
        [100, 200, 300, 301, 302, 303, 304, 305, 306, 307]
    );
    let slower = changed("rate 8mbit", "rate 80kbit", 2, &backlog);
    assert_eq!(
        dues_ms(&slower),
        [1, 2, 3, 103, 203, 303, 403, 503, 603, 703]
    );
    // without a rate everything leaves as soon as the wire is free
    let none = changed("rate 80kbit", "delay 1ms", 250, &backlog);
    assert_eq!(
        dues_ms(&none),
        [100, 200, 301, 301, 301, 301, 301, 301, 301, 301]
    );
}

#[test]
fn a_limit_in_time_counts_what_waits_at_the_rate_of_now() {
    // ten packets wait 8 ms each at first, then 80 ms each: of those that come then none finds room
    for (to, kept) in [
        ("rate 100kbit queue 100ms", 10),
        ("rate 10mbit queue 100ms", 20),
    ] {
        let offers: Vec<u64> = std::iter::repeat_n(0, 10)
            .chain(std::iter::repeat_n(4, 10))
            .collect();
        let out = changed("rate 1mbit queue 100ms", to, 4, &offers);
        let delivered = out.iter().filter(|out| out.is_delivered()).count();
        assert_eq!(delivered, kept, "{to}");
    }
    let offers: Vec<u64> = std::iter::repeat_n(0, 10)
        .chain(std::iter::repeat_n(4, 10))
        .collect();
    let out = changed(
        "rate 1mbit queue 100ms",
        "rate trace SLOW queue 100ms",
        4,
        &offers,
    );
    assert_eq!(out.iter().filter(|out| out.is_delivered()).count(), 10);
}

#[test]
fn traces_take_turns_in_a_loop() {
    let words = "rate trace SLOW queue 5000p; at 2s rate trace FAST queue 5000p; loop 4s";
    let mut link = Link::try_new(traced(words), 1, LinkId::UP).unwrap();
    let out = run(&mut link, at_ms((0..12_000).step_by(4)));
    assert!(out.iter().all(Departure::is_delivered), "nothing is lost");
    assert!(out.is_sorted_by_key(|out| out.due), "nothing overtakes");
    for round in 0..3 {
        let (begin, fast, end) = (4000 * round, 4000 * round + 2000, 4000 * (round + 1));
        let dues = dues_ms(&out);
        let slow: Vec<u64> = dues
            .iter()
            .copied()
            .filter(|due| (begin + 1..fast).contains(due))
            .collect();
        // 1500 bytes after a second; after two the fast trace is in force
        assert!((1..=2).contains(&slow.len()), "round {round}: {slow:?}");
        let drained = dues
            .iter()
            .filter(|due| (fast..fast + 400).contains(due))
            .count();
        assert!(
            drained > 550,
            "round {round}: {drained} at 1.5 packets a millisecond"
        );
        assert!(
            dues.iter()
                .filter(|due| (fast + 400..end).contains(due))
                .count()
                > 380
        );
    }
}
