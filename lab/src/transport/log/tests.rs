//! What is counted, on runs worked out by hand.

use mmt_netem::Probability;

use super::*;
use crate::transport::{Conditions, Flow, Stack};

const MS: Duration = Duration::from_millis(1);
const START: Time = Time::from_millis(5000);

/// 1000 messages/s for 8 ms over a path of 10 ms; nothing gets through from 2 to 5 ms after the start.
fn case() -> Case {
    Case {
        stack: Stack::Ours,
        flow: Flow::EVERY_SAMPLE,
        conditions: Conditions {
            round_trip: 20 * MS,
            loss: Probability::ZERO,
            jitter: Duration::ZERO,
            outage: 3 * MS,
            bottleneck: None,
        },
        duration: 8 * MS,
        seed: 1,
    }
}

/// Messages by number with the delay that each met beyond the path's 10 ms.
fn outcome(added_ms: &[(u32, u32)]) -> FlowOutcome {
    let mut log = Log::new(&case(), START);
    let messages: Vec<Vec<u8>> = (0..8).map(|_| log.send()).collect();
    for (number, added) in added_ms {
        let at = START + (*number + 10 + *added) * MS;
        log.arrived(&messages[*number as usize], at, 10 * MS);
    }
    log.outcome(Sent::default(), Sent::default())
}

#[test]
fn messages_are_sent_at_the_flows_rate_and_have_its_length() {
    let mut log = Log::new(&case(), START);
    assert_eq!(log.next_send(), START);
    assert_eq!(log.send().len(), 100);
    assert_eq!(log.next_send(), START + MS);
}

#[test]
fn what_the_path_takes_is_not_added_and_what_waits_is() {
    let outcome = outcome(&[(0, 0), (1, 0), (5, 1), (6, 4)]);
    assert_eq!(outcome.added_p50_ms, Some(0.0));
    assert_eq!(outcome.added_p99_ms, Some(4.0));
    assert_eq!(outcome.added_max_ms, Some(4.0));
    // 2, 3 and 4 were sent into the outage; 7 never came
    assert_eq!((outcome.possible, outcome.delivered), (5, 4));
    assert_eq!(outcome.share(), Some(0.8));
}

#[test]
fn what_was_sent_into_the_outage_and_comes_is_stale_and_not_fresh() {
    let outcome = outcome(&[(0, 0), (2, 30), (3, 30), (7, 2)]);
    assert_eq!((outcome.stale, outcome.delivered), (2, 2));
    // number 5 was the first after the outage; 7 came 2 + 2 ms after its time
    assert_eq!(outcome.fresh_ms, Some(4.0));
}

#[test]
fn nothing_that_came_is_no_zero() {
    let outcome = outcome(&[]);
    assert_eq!(outcome.added_max_ms, None);
    assert_eq!(outcome.fresh_ms, None);
    assert_eq!(outcome.share(), Some(0.0));
}

#[test]
fn what_is_no_message_of_the_run_is_passed_over() {
    let mut log = Log::new(&case(), START);
    let message = log.send();
    log.arrived(&message[..3], START + 10 * MS, 10 * MS);
    log.arrived(&[9; 100], START + 10 * MS, 10 * MS);
    let outcome = log.outcome(Sent::default(), Sent::default());
    assert_eq!(outcome.delivered, 0);
}

#[test]
fn the_digest_shows_any_nanosecond() {
    assert_eq!(outcome(&[(0, 1)]).digest, outcome(&[(0, 1)]).digest);
    assert_ne!(outcome(&[(0, 1)]).digest, outcome(&[(0, 2)]).digest);
    assert_ne!(outcome(&[(0, 1)]).digest, outcome(&[(1, 1)]).digest);
}
