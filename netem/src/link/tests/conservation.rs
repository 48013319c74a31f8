//! Conservation at every moment, order of departure, and that it does not matter when somebody polls.

use proptest::prelude::*;

use super::*;

fn pushed(words: &str, packets: u64) -> Link<u64> {
    let mut link = Link::try_new(words.parse().unwrap(), 1, LinkId::UP).unwrap();
    (0..packets).for_each(|number| link.offer(Time::ZERO, Packet::new(0, number)));
    link
}

#[test]
fn packets_leave_at_their_time_and_not_before() {
    let mut link = pushed("delay 50ms", 1);
    let due = Time::from_millis(50);
    assert_eq!(link.poll_timeout(), Some(due));
    assert_eq!(link.poll(Time::from_nanos(49_999_999)), None);
    assert_eq!(link.clone().poll(due).map(|out| out.payload), Some(0));
    // polled late, it still has its theoretical time
    assert_eq!(
        link.poll(Time::from_millis(80)).map(|out| out.due),
        Some(due)
    );
    assert_eq!(link.poll_timeout(), None);
}

#[test]
fn packets_due_together_leave_in_the_order_of_their_offers() {
    let mut link = pushed("delay 50ms", 100);
    let order = std::iter::from_fn(|| link.poll(Time::MAX)).map(|out| out.payload);
    assert!(order.eq(0..100));
}

#[test]
fn the_limit_bounds_what_is_in_flight_and_names_what_it_drops() {
    let out = run(
        &mut link("delay 50ms limit 20", 1, LinkId::UP),
        (0..100).map(|ms| (Time::from_millis(ms), Packet::new(0, ()))),
    );
    for out in &out {
        let full = out.backlog == 20;
        assert_eq!(full, met(out) == Err(DropCause::Limit), "{out:?}");
        assert!(out.backlog <= 20);
    }
    assert!(out.iter().any(|out| out.backlog == 20));
}

#[test]
fn the_limit_bounds_bytes_too() {
    let offers = |n: u64, bytes| (0..n).map(move |_| (Time::ZERO, Packet::new(bytes, ())));
    let dropped = |words: &str, n, bytes| {
        let mut link = link(words, 1, LinkId::UP);
        run(&mut link, offers(n, bytes));
        link.counters().dropped.limit.packets
    };
    assert_eq!(dropped("delay 1s limit 100 10kb", 20, 1024), 10);
    // who gives none has 64 MiB
    assert_eq!(
        dropped("delay 1s", 2000, 60_000),
        2000 - (64 << 20) / 60_000
    );
    assert_eq!(dropped("delay 1s limit 10000 1024mb", 2000, 60_000), 0);
}

#[test]
fn lateness_of_one_link_does_not_reach_the_next() {
    // two links in a row, polled every 7 ms only: the times are those of exact polling
    let mut near = pushed("delay 10ms rate 8mbit", 1);
    let mut far = pushed("delay 20ms", 0);
    for wake in (0..10).map(|n| Time::from_millis(7 * n)) {
        while let Some(out) = near.poll(wake) {
            far.offer(out.due, Packet::new(0, out.payload));
        }
    }
    assert_eq!(far.poll_timeout(), Some(Time::from_millis(30)));
}

#[test]
fn a_link_that_nobody_polls_stays_small_and_counts_all() {
    let mut link = pushed("loss 100% limit 10", 1000);
    assert_eq!(link.counters().dropped.loss.packets, 1000);
    assert_eq!(std::iter::from_fn(|| link.poll(Time::MAX)).count(), 10);
}

const WORDS: [&str; 12] = [
    "none",
    "delay 5ms",
    "delay 5ms 4ms order free loss 10%",
    "delay 5ms 9ms limit 3 duplicate 30%",
    "delay 2ms 9ms distribution normal loss 50% order free limit 5",
    "rate 4mbit queue 3p delay 1ms duplicate 20%",
    "rate 2mbit 28 queue 9ms drop-head loss 5% corrupt 50%",
    "rate 3mbit codel 1ms 5ms limit 20; at 20ms over 9ms rate 9mbit codel; at 50ms none; loop 60ms",
    "rate 2mbit queue 5p cross 1mbit poisson 300 delay 1ms loss 5%",
    "rate 2mbit queue 9ms drop-head codel 1ms 5ms cross 3mbit poisson 900; at 20ms rate 9mbit; loop 60ms",
    "delay 5ms 4ms order free loss 10% duplicate 20%; then rate 4mbit queue 3p; then delay 2ms 1ms loss 10%",
    "rate 3mbit cross 1mbit poisson 300; at 20ms none; then duplicate 30% rate 2mbit queue 5p drop-head",
];

proptest! {
    #[test]
    fn nothing_is_lost_without_a_name_and_departures_are_in_order(
        words in prop::sample::select(WORDS.to_vec()),
        steps in prop::collection::vec((0_u64..3_000_000, 0_usize..2000, any::<bool>()), 1..300),
    ) {
        let mut link = link(words, 1, LinkId::UP);
        let (mut now, mut latest) = (Time::ZERO, Time::ZERO);
        for (gap, bytes, polls) in steps {
            now += Duration::from_nanos(gap);
            while let Some(out) = polls.then(|| link.poll(now)).flatten() {
                prop_assert!(out.due <= now && out.due >= out.offered_at + out.queued);
                prop_assert!(out.due >= latest || words.contains("free") || !out.is_delivered());
                latest = out.due.max(latest);
            }
            link.offer(now, Packet::new(bytes, ()));
            let counters = link.counters();
            let gone = counters.delivered.plus(counters.dropped.total()).packets;
            let offered = counters.offered.plus(counters.duplicated).packets;
            prop_assert_eq!(offered, gone + link.in_flight() as u64);
        }
        while link.poll(Time::MAX).is_some() {}
        prop_assert_eq!((link.in_flight(), link.poll_timeout()), (0, None));
    }

    #[test]
    fn when_somebody_polls_changes_nothing(
        words in prop::sample::select(WORDS.to_vec()),
        gaps in prop::collection::vec((0_u64..3_000_000, 0_usize..2000), 1..200),
    ) {
        // a limit counts what is in flight until it is polled, so it has no part here
        let words = words.split("limit").next().unwrap_or_default();
        let mut now = Time::ZERO;
        let offers: Vec<(Time, usize)> = gaps.iter().map(|(gap, bytes)| {
            now += Duration::from_nanos(*gap);
            (now, *bytes)
        }).collect();
        let mut at_events = link(words, 1, LinkId::UP);
        let mut stepped = Vec::new();
        for (now, bytes) in &offers {
            while let Some(event) = at_events.poll_timeout().filter(|event| event <= now) {
                stepped.extend(std::iter::from_fn(|| at_events.poll(event)));
            }
            at_events.offer(*now, Packet::new(*bytes, ()));
        }
        stepped.extend(std::iter::from_fn(|| at_events.poll(Time::MAX)));
        let mut at_the_end = link(words, 1, LinkId::UP);
        offers.iter().for_each(|(now, bytes)| at_the_end.offer(*now, Packet::new(*bytes, ())));
        let late: Vec<_> = std::iter::from_fn(|| at_the_end.poll(Time::MAX)).collect();
        let of = |out: &Departure<()>| (out.number, out.copy, out.due, out.queued, out.fate);
        prop_assert_eq!(stepped.iter().map(of).collect::<Vec<_>>(), late.iter().map(of).collect::<Vec<_>>());
    }
}
