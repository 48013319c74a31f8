//! Laws of the pipe: conservation at every moment, order of departure, the limit.

use std::time::Duration;

use proptest::prelude::*;

use super::*;
use crate::fate::DropCause;

fn pipe(words: &str) -> SimPath<u64> {
    Pipe::try_new(words.parse().unwrap(), 1, LinkId::UP).unwrap()
}

#[test]
fn packets_leave_at_their_time_and_not_before() {
    let mut pipe = pipe("delay 50ms");
    pipe.push(Time::ZERO, 10, 7);
    let just_before = Time::from_nanos(49_999_999);
    assert_eq!(pipe.next_due(), Some(Time::from_millis(50)));
    assert_eq!(pipe.pop_due(just_before), None);
    assert_eq!(
        pipe.clone()
            .pop_due(Time::from_millis(50))
            .map(|p| p.payload),
        Some(7)
    );
    // taken out late, it still carries its theoretical time
    let released = pipe.pop_due(Time::from_millis(80)).unwrap();
    assert_eq!((released.due, released.payload), (Time::from_millis(50), 7));
    assert_eq!(pipe.next_due(), None);
}

#[test]
fn packets_due_together_leave_in_the_order_of_their_offers() {
    let mut pipe = pipe("delay 50ms");
    for number in 0..100 {
        pipe.push(Time::ZERO, 0, number);
    }
    let order: Vec<u64> = std::iter::from_fn(|| pipe.pop_due(Time::MAX))
        .map(|packet| packet.payload)
        .collect();
    assert_eq!(order, (0..100).collect::<Vec<_>>());
}

#[test]
fn the_limit_bounds_what_is_in_flight_and_names_what_it_drops() {
    let mut pipe = pipe("delay 50ms limit 20");
    for number in 0..100 {
        let now = Time::from_millis(number);
        while pipe.pop_due(now).is_some() {}
        let full = pipe.in_flight() == 20;
        let fate = pipe.push(now, 0, number);
        assert_eq!(full, fate == Fate::Drop(DropCause::Limit));
        assert!(pipe.in_flight() <= 20);
    }
    assert!(pipe.counters().dropped.limit.packets > 0);
}

#[test]
fn lateness_of_one_link_does_not_reach_the_next() {
    // two links in a row, emptied every 7 ms only: the times are those of exact emptying
    let (mut near, mut far) = (pipe("delay 10ms"), pipe("delay 20ms"));
    near.push(Time::ZERO, 0, 0);
    for wake in (0..10).map(|n| Time::from_millis(7 * n)) {
        while let Some(packet) = near.pop_due(wake) {
            far.push(packet.due, 0, packet.payload);
        }
    }
    assert_eq!(far.next_due(), Some(Time::from_millis(30)));
}

proptest! {
    #[test]
    fn nothing_is_lost_without_a_name_and_departures_are_in_order(
        words in prop::sample::select(vec![
            "none", "delay 5ms", "delay 5ms 4ms order free loss 10%", "delay 5ms 9ms limit 3",
            "delay 2ms 9ms distribution normal loss 50% order free limit 5",
        ]),
        steps in prop::collection::vec((0_u64..3_000_000, 0_usize..2000, any::<bool>()), 1..300),
    ) {
        let mut pipe = pipe(words);
        let mut now = Time::ZERO;
        let mut latest = Time::ZERO;
        for (gap, bytes, empties) in steps {
            now += Duration::from_nanos(gap);
            while let Some(packet) = empties.then(|| pipe.pop_due(now)).flatten() {
                prop_assert!(packet.due <= now && packet.due >= packet.offered_at);
                prop_assert!(packet.due >= latest || pipe.config().order == crate::Order::Free);
                latest = packet.due;
            }
            pipe.push(now, bytes, 0);
            let counters = pipe.counters();
            let in_flight = counters.delivered.packets - pipe.released().packets;
            prop_assert_eq!(in_flight, pipe.in_flight() as u64);
            prop_assert_eq!(counters.offered, counters.delivered.plus(counters.dropped.total()));
        }
        while pipe.pop_due(Time::MAX).is_some() {}
        prop_assert_eq!(pipe.released(), pipe.counters().delivered);
    }
}
