//! quinn in virtual time: repeatable, exact, and better than its defaults where it matters.

use std::process::Command;
use std::time::Duration;

use mmt_netem::Probability;

use super::*;
use crate::transport::{Bottleneck, Case, Conditions, Flow, FlowOutcome, Stack};

const MS: Duration = Duration::from_millis(1);

/// A path without loss, jitter, outage or bottleneck, for 4 s.
fn clean(stack: Stack, flow: Flow, round_trip: Duration) -> Case {
    Case {
        stack,
        flow,
        conditions: Conditions {
            round_trip,
            loss: Probability::ZERO,
            jitter: Duration::ZERO,
            outage: Duration::ZERO,
            bottleneck: None,
        },
        duration: 4000 * MS,
        seed: 1,
    }
}

fn with(case: Case, change: impl Fn(&mut Conditions)) -> Case {
    let mut case = case;
    change(&mut case.conditions);
    case
}

/// Random loss and reordering at once.
fn rough(stack: Stack, flow: Flow) -> Case {
    with(clean(stack, flow, 100 * MS), |conditions| {
        conditions.loss = Probability::from_percent(5.0).unwrap();
        conditions.jitter = 20 * MS;
    })
}

fn narrow(stack: Stack, round_trip: Duration) -> Case {
    with(clean(stack, Flow::EVERY_SAMPLE, round_trip), |conditions| {
        conditions.bottleneck = Some(Bottleneck::NARROW);
    })
}

fn outage(stack: Stack, flow: Flow) -> Case {
    with(clean(stack, flow, 100 * MS), |conditions| {
        conditions.outage = 1000 * MS;
    })
}

fn measured(case: Case) -> FlowOutcome {
    run(&case).unwrap()
}

/// Digests of runs in which every timer, queue and random number has a part.
fn digests() -> String {
    let cases = Stack::ALL.map(|stack| {
        with(rough(stack, Flow::EVERY_SAMPLE), |conditions| {
            conditions.outage = 500 * MS;
            conditions.bottleneck = Some(Bottleneck::NARROW);
        })
    });
    cases.map(|case| measured(case).digest).join(" ")
}

/// What a child process of this test prints before its digests.
const MARK: &str = "digests of this process: ";
const CHILD: &str = "MMT_TEST_DIGESTS_OF_A_CHILD";

#[test]
fn two_runs_of_one_seed_are_equal_in_one_process_and_in_two() {
    let here = digests();
    if std::env::var_os(CHILD).is_some() {
        println!("{MARK}{here}");
        return;
    }
    assert_eq!(here, digests());
    let name = "io::virtual_time::tests::two_runs_of_one_seed_are_equal_in_one_process_and_in_two";
    let child = Command::new(std::env::current_exe().unwrap())
        .args([name, "--exact", "--nocapture"])
        .env(CHILD, "1")
        .output()
        .unwrap();
    let printed = String::from_utf8_lossy(&child.stdout);
    let there = printed.lines().find_map(|line| line.split_once(MARK));
    assert_eq!(there.map(|(_, digests)| digests), Some(&*here), "{printed}");
}

#[test]
fn another_seed_is_another_run() {
    let case = rough(Stack::Ours, Flow::EAGER);
    let other = Case { seed: 2, ..case };
    assert_ne!(measured(case).digest, measured(other).digest);
}

#[test]
fn virtual_time_is_exact_to_the_nanosecond() {
    let jittered = with(clean(Stack::Ours, Flow::EAGER, 100 * MS), |conditions| {
        conditions.jitter = 20 * MS;
    });
    let outcome = measured(jittered);
    assert_eq!(outcome.added_max_ms, Some(0.0));
    assert_eq!((outcome.delivered, outcome.possible), (600, 600));
    // the bottleneck's own serialisation is the path's, and this flow leaves it idle in between
    let alone = with(clean(Stack::Ours, Flow::USUAL, 100 * MS), |conditions| {
        conditions.bottleneck = Some(Bottleneck::NARROW);
    });
    assert_eq!(measured(alone).added_max_ms, Some(0.0));
}

#[test]
fn random_loss_and_reordering_add_nothing_to_ours_and_seconds_to_stock() {
    for flow in Flow::ALL {
        let outcome = measured(rough(Stack::Ours, flow));
        assert_eq!(outcome.added_max_ms, Some(0.0), "{flow:?}");
        assert!(outcome.share().unwrap() > 0.93, "{flow:?}: {outcome:?}");
    }
    let stock = measured(rough(Stack::Stock, Flow::EVERY_SAMPLE));
    assert!(stock.added_p50_ms.unwrap() > 500.0, "{stock:?}");
}

#[test]
fn after_an_outage_the_next_message_is_on_time() {
    for flow in Flow::ALL {
        let outcome = measured(outage(Stack::Ours, flow));
        assert_eq!(outcome.fresh_ms, Some(0.0), "{flow:?}");
        assert_eq!(outcome.stale, 0, "{flow:?}");
        assert_eq!(outcome.delivered, outcome.possible, "{flow:?}");
    }
    let stock = measured(outage(Stack::Stock, Flow::EVERY_SAMPLE));
    assert!(stock.stale > 500, "{stock:?}");
    assert!(stock.fresh_ms.unwrap() > 100.0, "{stock:?}");
}

#[test]
fn an_outage_far_longer_than_the_window_ends_without_a_wait_too() {
    let long = with(outage(Stack::Ours, Flow::EVERY_SAMPLE), |conditions| {
        conditions.outage = 8000 * MS;
    });
    let long = Case {
        duration: 16_000 * MS,
        ..long
    };
    let outcome = measured(long);
    assert_eq!(outcome.fresh_ms, Some(0.0));
    assert_eq!(outcome.delivered, outcome.possible);
}

#[test]
fn at_a_bottleneck_the_queue_is_short_and_the_path_is_used() {
    for round_trip in [100 * MS, 200 * MS] {
        let case = Case {
            duration: 10_000 * MS,
            ..narrow(Stack::Ours, round_trip)
        };
        let outcome = measured(case);
        assert!(outcome.added_p50_ms.unwrap() <= 25.0, "{outcome:?}");
        // 1 Mbit/s carries 80 % of 1000 messages/s of 100 bytes with their headers
        assert!(outcome.share().unwrap() > 0.78, "{outcome:?}");
    }
    let stock = measured(narrow(Stack::Stock, 100 * MS));
    assert!(stock.added_p50_ms.unwrap() > 200.0, "{stock:?}");
}

#[test]
fn the_queue_stays_short_for_minutes() {
    let case = Case {
        duration: 120_000 * MS,
        ..narrow(Stack::Ours, 100 * MS)
    };
    let outcome = measured(case);
    assert!(outcome.added_p50_ms.unwrap() <= 25.0, "{outcome:?}");
    assert!(outcome.added_p99_ms.unwrap() <= 50.0, "{outcome:?}");
}

#[test]
fn acknowledgements_are_a_tenth_of_the_packets_at_1_khz() {
    let outcome = measured(clean(Stack::Ours, Flow::EVERY_SAMPLE, 100 * MS));
    let heartbeats = 4 * 20;
    let own = outcome.down.packets - heartbeats;
    assert!(own * 100 <= outcome.up.packets * 15, "{outcome:?}");
}
