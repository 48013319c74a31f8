//! Packets that overtake on purpose.

use super::*;

#[test]
fn the_chosen_leave_at_once_and_the_others_wait() {
    let fates = fates("delay 10ms reorder 25%", 211, LinkId::UP);
    let delays = delays(&fates);
    let at_once = delays.iter().filter(|delay| **delay == Some(0.0)).count() as f64;
    assert!(
        delays
            .iter()
            .all(|delay| [Some(0.0), Some(10.0)].contains(delay))
    );
    let n = N as f64;
    assert!(
        (at_once - 0.25 * n).abs() < 4.0 * (0.1875 * n).sqrt(),
        "{at_once}"
    );
}

#[test]
fn with_a_gap_only_every_nth_packet_can_overtake() {
    let fates = fates("delay 10ms reorder 100% gap 5", 1, LinkId::UP);
    for (packet, delay) in delays(&fates).into_iter().enumerate() {
        let expected = if packet % 5 == 4 { 0.0 } else { 10.0 };
        assert_eq!(delay, Some(expected), "{packet}");
    }
}

#[test]
fn what_overtakes_does_not_hold_up_what_follows() {
    let jitter = fates("delay 50ms 5ms", 217, LinkId::UP);
    let both = fates("delay 50ms 5ms reorder 10%", 217, LinkId::UP);
    let never_later = jitter.iter().zip(&both).all(|(a, b)| b <= a);
    assert!(never_later && jitter != both);
}

/// What a driver may rely on that leaves packets unread for a while.
#[test]
fn nothing_that_comes_later_leaves_before_the_bound() {
    let at = |n: u64| Time::ZERO + Duration::from_micros(300 * n);
    let packet = || Packet {
        payload: (),
        bytes: 500,
        ecn_capable: false,
    };
    for words in [
        "none",
        "delay 5ms",
        "delay 5ms 2ms",
        "delay 5ms 2ms order free",
        "delay 5ms 5ms distribution normal",
        "delay 5ms 3ms tau 10ms distribution lognormal loss 10% duplicate 10%",
        "delay 5ms reorder 25%",
        "rate 10mbit queue 20p cross 5mbit poisson 800 delay 2ms",
        "delay 9ms; at 20ms delay 1ms order free; at 40ms delay 4ms; loop 50ms",
        "delay 2ms 2ms; then delay 3ms 1ms order free; then delay 1ms",
        "slot 3ms delay 1ms",
    ] {
        let mut link = link(words, 31, LinkId::UP);
        let mut bounds = Vec::new();
        let mut out = Vec::new();
        for n in 0..1000 {
            out.extend(std::iter::from_fn(|| link.poll(at(n))));
            bounds.push(link.earliest_of_later(at(n)));
            link.offer(at(n), packet());
        }
        out.extend(std::iter::from_fn(|| link.poll(Time::MAX)));
        out.retain(Departure::is_delivered);
        assert!(!out.is_empty());
        for departure in out {
            for (n, bound) in bounds.iter().enumerate() {
                let later = departure.offered_at >= at(n as u64);
                assert!(
                    !later || departure.due >= *bound,
                    "{words}: {departure:?} {n}"
                );
            }
        }
    }
}

#[test]
fn the_bound_is_as_late_as_delay_and_order_allow() {
    let bound = |words: &str| {
        let mut link = link(words, 31, LinkId::UP);
        let packet = Packet {
            payload: (),
            bytes: 500,
            ecn_capable: false,
        };
        link.offer(Time::ZERO, packet);
        link.earliest_of_later(Time::from_millis(2))
    };
    assert_eq!(bound("delay 5ms"), Time::from_millis(7));
    assert_eq!(bound("delay 5ms 2ms order free"), Time::from_millis(5));
    // in order: not before the one that is on the link
    assert!(bound("delay 90ms 9ms distribution normal") > Time::from_millis(30));
    assert_eq!(bound("delay 5ms reorder 25%"), Time::from_millis(2));
    assert_eq!(bound("delay 5ms; at 3ms none"), Time::from_millis(3));
    let chain = "delay 5ms; then delay 4ms";
    assert_eq!(bound(chain), Time::from_millis(11));
}
