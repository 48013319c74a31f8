//! Two peers talk over a link that loses, reorders and duplicates by a fixed plan.

use proptest::prelude::*;

use super::*;

const HOLD: u64 = 7;
const UP: u64 = 30;
const DOWN: u64 = 20;

fn ms(ms: u64) -> Time {
    Time::from_millis(ms)
}

/// Number `number` without an echo.
fn plain(number: u32) -> Envelope {
    Envelope {
        number,
        sent: ms(u64::from(number)),
        echo: None,
    }
}

#[test]
fn round_trip_leaves_out_the_time_that_the_answer_was_held_whatever_the_other_clock_shows() {
    let (mut here, mut there) = (Peer::default(), Peer::default());
    let epoch = 1_000_000; // the other clock is far ahead
    for k in 0..100 {
        let question = here.stamp(ms(k * 100)).unwrap();
        there.handle(ms(epoch + k * 100 + UP), &question);
        let answer = there.stamp(ms(epoch + k * 100 + UP + HOLD)).unwrap();
        let arrived = ms(k * 100 + UP + HOLD + DOWN);
        assert_eq!(here.handle(arrived, &answer), Arrival::Newest);
        assert_eq!(
            here.round_trip().latest(),
            Some(Duration::from_millis(UP + DOWN))
        );
    }
    assert_eq!(here.echoes_implausible(), 0);
    assert_eq!(here.round_trip().histogram().total(), 100);
}

#[test]
fn numbers_begin_at_one_and_never_wrap() {
    let mut peer = Peer::default();
    assert_eq!(peer.stamp(ms(0)).unwrap().number, 1);
    peer.sent = NUMBER_LAST - 1;
    assert_eq!(peer.stamp(ms(0)).unwrap().number, NUMBER_LAST);
    assert_eq!(peer.stamp(ms(0)), Err(NumbersSpent));
    assert_eq!(peer.stamp(ms(0)), Err(NumbersSpent));
    assert_eq!(peer.sent, NUMBER_LAST);
}

#[test]
fn loss_reordering_and_duplicates_are_distinguished() {
    let mut peer = Peer::default();
    let arrivals: Vec<_> = [1, 2, 2, 5, 4, 4, 8]
        .into_iter()
        .map(|number| peer.handle(ms(9), &plain(number)))
        .collect();
    assert_eq!(
        arrivals,
        [
            Arrival::Newest,
            Arrival::Newest,
            Arrival::Duplicate,
            Arrival::Newest,
            Arrival::Reordered,
            Arrival::Duplicate,
            Arrival::Newest,
        ]
    );
    // 3, 6 and 7 are missing
    let (expected, received) = (8, 5);
    assert_eq!(peer.incoming(), Loss { expected, received });
    assert_eq!(peer.incoming().share(), Some(3.0 / 8.0));
}

#[test]
fn what_comes_too_late_to_tell_is_dropped_and_stays_lost() {
    let mut peer = Peer::default();
    peer.handle(ms(0), &plain(3));
    peer.handle(ms(0), &plain(WINDOW + 1));
    assert_eq!(peer.handle(ms(0), &plain(1)), Arrival::TooOld);
    assert_eq!(peer.handle(ms(0), &plain(2)), Arrival::Reordered);
    assert_eq!(peer.received, 3);
    assert_eq!(peer.incoming().lost(), WINDOW - 2);
}

#[test]
fn the_other_direction_s_loss_is_what_the_other_side_reports() {
    let (mut here, mut there) = (Peer::default(), Peer::default());
    for k in 1..=20 {
        let question = here.stamp(ms(k)).unwrap();
        if k % 4 != 0 {
            there.handle(ms(k + UP), &question);
        }
    }
    assert_eq!(here.outgoing().share(), None, "nothing reported yet");
    let answer = there.stamp(ms(60)).unwrap();
    here.handle(ms(80), &answer);
    let (expected, received) = (19, 15);
    assert_eq!(here.outgoing(), Loss { expected, received });
    assert_eq!(there.incoming(), here.outgoing());
}

#[test]
fn an_older_report_never_replaces_a_newer_one() {
    let (mut here, mut there) = (Peer::default(), Peer::default());
    let question = here.stamp(ms(0)).unwrap();
    there.handle(ms(1), &question);
    let old = there.stamp(ms(1)).unwrap();
    let question = here.stamp(ms(2)).unwrap();
    there.handle(ms(3), &question);
    let new = there.stamp(ms(3)).unwrap();
    here.handle(ms(4), &new);
    assert_eq!(here.handle(ms(5), &old), Arrival::Reordered);
    assert_eq!(here.outgoing().expected, 2);
}

#[test]
fn an_echo_that_cannot_be_true_teaches_nothing() {
    let true_echo = Echo {
        number: 1,
        sent: ms(0),
        held_ns: 0,
        received: 1,
    };
    let impossible = [
        Echo {
            number: 3,
            ..true_echo
        },
        Echo {
            number: u32::MAX,
            received: u32::MAX,
            ..true_echo
        },
        Echo {
            sent: ms(11),
            ..true_echo
        },
        Echo {
            sent: Time::MAX,
            ..true_echo
        },
        Echo {
            held_ns: 10_000_001,
            ..true_echo
        },
        Echo {
            held_ns: u64::MAX,
            ..true_echo
        },
        Echo {
            received: 2,
            ..true_echo
        },
    ];
    let handled = |echo| {
        let mut peer = Peer::default();
        peer.stamp(ms(0)).unwrap();
        peer.stamp(ms(0)).unwrap();
        let echo = Some(echo);
        peer.handle(ms(10), &Envelope { echo, ..plain(1) });
        (
            peer.echoes_implausible(),
            peer.round_trip().histogram().total(),
        )
    };
    assert_eq!(handled(true_echo), (0, 1));
    for echo in impossible {
        assert_eq!(handled(echo), (1, 0), "{echo:?}");
    }
}

#[test]
fn an_echo_counts_the_newest_and_states_how_long_it_was_held() {
    let mut peer = Peer::default();
    assert_eq!(peer.echo(ms(0)), None);
    peer.handle(ms(10), &plain(2));
    peer.handle(ms(11), &plain(1));
    let echo = peer.stamp(ms(13)).unwrap().echo.unwrap();
    assert_eq!((echo.number, echo.sent), (2, ms(2)));
    assert_eq!((echo.held_ns, echo.received), (3_000_000, 2));
    assert_eq!(peer.last_arrival(), Some(ms(11)));
    peer.handle(ms(20), &plain(2));
    assert_eq!(
        peer.last_arrival(),
        Some(ms(11)),
        "a duplicate is no sign of life"
    );
}

fn is_taken(arrival: Arrival) -> bool {
    matches!(arrival, Arrival::Newest | Arrival::Reordered)
}

proptest! {
    #[test]
    fn one_hostile_number_never_silences_what_follows(
        before in 0_u32..3000,
        hostile in prop_oneof![any::<u32>(), (u32::MAX - 2000)..=u32::MAX, 1_u32..10_000],
        after in prop::collection::vec(1_u32..3, 1..200),
    ) {
        let mut peer = Peer::default();
        (1..=before).for_each(|number| assert!(is_taken(peer.handle(ms(0), &plain(number)))));
        peer.handle(ms(0), &plain(hostile));
        let mut number = before;
        for step in after {
            number += step;
            let arrival = peer.handle(ms(1), &plain(number));
            prop_assert!(is_taken(arrival) || number == hostile, "{number}: {arrival:?}");
        }
    }

    #[test]
    fn an_outage_of_any_length_is_followed_from_its_second_datagram_on(
        before in 0_u32..3000,
        lost in 0_u32..100_000_000,
        after in prop::collection::vec(1_u32..500, 1..100),
    ) {
        let mut peer = Peer::default();
        (1..=before).for_each(|number| assert!(is_taken(peer.handle(ms(0), &plain(number)))));
        let mut number = before + lost;
        for (n, step) in after.into_iter().enumerate() {
            number += step;
            let arrival = peer.handle(ms(1), &plain(number));
            let may_be_refused = n == 0 && number - before >= WINDOW;
            prop_assert!(arrival == Arrival::Newest || may_be_refused, "{number}: {arrival:?}");
        }
    }
}

#[test]
fn a_number_so_far_ahead_is_taken_and_one_further_waits_for_a_second() {
    let mut peer = Peer::default();
    assert_eq!(peer.handle(ms(0), &plain(WINDOW - 1)), Arrival::Newest);
    let far = 2 * WINDOW - 1;
    assert_eq!(peer.handle(ms(0), &plain(far)), Arrival::Implausible);
    assert_eq!(
        peer.handle(ms(0), &plain(far)),
        Arrival::Implausible,
        "twice"
    );
    assert_eq!(peer.incoming().expected, WINDOW - 1);
    assert_eq!(
        peer.handle(ms(0), &plain(far + WINDOW)),
        Arrival::Implausible
    );
    assert_eq!(
        peer.handle(ms(0), &plain(far + 2 * WINDOW - 1)),
        Arrival::Newest
    );
}
