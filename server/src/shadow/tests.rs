//! What the shadow promises: an update counts for the master's when the master says so, and not before.

use super::*;
use mmt_shared::fixtures::{self, COUPLING, square_at_rest};
use mmt_shared::model::sample::{ForceCounts, HipCounts};
use mmt_shared::model::settings::Mode;
use mmt_shared::model::tool::TOOL_FORCE_MAX_N;

fn state(m: f64) -> ModelState {
    square_at_rest(m, 3.0, 2.06, 0.4)
}

fn shadow() -> Shadow {
    let settings = Mode::Recommended.model_settings(COUPLING);
    Shadow::new(settings, state(0.7), TOOL_FORCE_MAX_N)
}

fn update(sequence: u32, answers_ms: u64, m: f64) -> Update {
    Update {
        touched_face: None,
        ..fixtures::update(sequence, Cause::Deadband, answers_ms, state(m))
    }
}

fn sample(ms: u64) -> HipSample {
    HipSample {
        stamp: Time::from_millis(ms),
        hip: HipCounts {
            x: -5_000_000,
            y: 0,
        },
        force: ForceCounts::default(),
    }
}

/// Plays the ticks of a hand at rest away from the box; how often an update was found to be lost.
fn play(shadow: &mut Shadow, ticks: std::ops::RangeInclusive<u64>) -> usize {
    let mut lost = 0;
    for ms in ticks {
        let stamp = Time::from_millis(ms);
        let cause = shadow.step(stamp, stamp, |_| Some(Vec2::new(-0.5, 0.0)));
        lost += usize::from(cause == Some(Cause::Deadband));
    }
    lost
}

fn masses(shadow: &Shadow) -> [f64; 2] {
    [shadow.confirmed(), shadow.ahead()].map(|copy| (copy.state().params.m() * 1e2).round() / 1e2)
}

#[test]
fn what_is_sent_is_ahead_at_once_and_confirmed_from_the_sample_that_acknowledges_it() {
    let mut shadow = shadow();
    play(&mut shadow, 1..=100);
    shadow.send(&update(1, 100, 2.0));
    play(&mut shadow, 101..=300);
    assert_eq!(masses(&shadow), [0.7, 2.0]);
    shadow.acknowledge(&sample(310), 1);
    // another sample of the same command came first on its way
    shadow.acknowledge(&sample(305), 1);
    play(&mut shadow, 301..=304);
    assert_eq!(
        (shadow.newest_confirmed(), masses(&shadow)),
        (0, [0.7, 2.0])
    );
    play(&mut shadow, 305..=305);
    assert_eq!(shadow.newest_confirmed(), 1);
    play(&mut shadow, 306..=600);
    assert_eq!((shadow.lost(), masses(&shadow)), (0, [2.0, 2.0]));
}

#[test]
fn an_update_that_is_not_acknowledged_in_time_is_taken_back() {
    let mut shadow = shadow();
    play(&mut shadow, 1..=100);
    shadow.send(&update(1, 100, 2.0));
    shadow.acknowledge(&sample(150), 1);
    assert_eq!(play(&mut shadow, 101..=200), 0);
    shadow.send(&update(2, 200, 4.0));
    // the loop takes 50 ms, and 100 more are waited
    assert_eq!(play(&mut shadow, 201..=350), 0);
    assert_eq!((shadow.lost(), shadow.unacknowledged()), (0, 1));
    assert_eq!(masses(&shadow), [2.0, 4.0]);
    assert_eq!(play(&mut shadow, 351..=351), 1);
    assert_eq!((shadow.lost(), masses(&shadow)), (1, [2.0, 2.0]));
    assert_eq!(play(&mut shadow, 352..=900), 0, "once");
    assert!(shadow.nothing_in_flight());
    assert_eq!(shadow.unacknowledged(), 1);
}

#[test]
fn updates_that_are_never_acknowledged_are_counted_however_many_there_are() {
    let mut shadow = shadow();
    play(&mut shadow, 1..=100);
    for sequence in 1..=5000 {
        shadow.send(&update(sequence, 100, 2.0));
    }
    assert_eq!(shadow.unacknowledged(), 5000);
}

#[test]
fn an_update_that_was_given_up_too_early_is_taken_in_after_all() {
    let mut shadow = shadow();
    play(&mut shadow, 1..=100);
    shadow.send(&update(1, 100, 2.0));
    shadow.acknowledge(&sample(150), 1);
    play(&mut shadow, 101..=200);
    shadow.send(&update(2, 200, 4.0));
    assert_eq!(play(&mut shadow, 201..=400), 1);
    shadow.acknowledge(&sample(420), 2);
    play(&mut shadow, 401..=700);
    assert_eq!((shadow.lost(), masses(&shadow)), (0, [4.0, 4.0]));
}

#[test]
fn an_update_that_a_newer_one_overtook_is_counted_and_not_confirmed() {
    let mut shadow = shadow();
    play(&mut shadow, 1..=100);
    for (sequence, m) in [(1, 2.0), (2, 4.0)] {
        shadow.send(&update(sequence, 100, m));
    }
    shadow.acknowledge(&sample(150), 2);
    // what comes late of older commands says nothing new
    shadow.acknowledge(&sample(140), 0);
    play(&mut shadow, 101..=400);
    assert_eq!((shadow.lost(), masses(&shadow)), (1, [4.0, 4.0]));
    shadow.acknowledge(&sample(410), 1);
    play(&mut shadow, 401..=450);
    assert_eq!(shadow.newest_confirmed(), 2);
}

#[test]
fn samples_between_two_ticks_are_all_taken_and_a_long_gap_is_not_made_up_for() {
    let mut shadow = shadow();
    let at = |ms| Time::from_millis(ms);
    let hip = |_| Some(Vec2::new(-0.5, 0.0));
    shadow.step(at(1), at(1), hip);
    shadow.step(at(3), at(3), hip);
    assert_eq!(shadow.confirmed().history().len(), 3);
    shadow.step(at(3), at(3), hip);
    assert_eq!(shadow.confirmed().history().len(), 3, "no sample twice");
    shadow.step(at(500), at(500), hip);
    let history = shadow.confirmed().history();
    assert_eq!(history.len(), 4);
    assert_eq!(history.newest().unwrap().stamp, at(500));
}

#[test]
fn hours_in_which_neither_host_ticked_cost_a_tick_no_more_than_a_second_of_the_hand() {
    let mut shadow = shadow();
    play(&mut shadow, 1..=100);
    let asked = std::cell::Cell::new(0_u64);
    let (last, until) = (Time::from_millis(100), Time::from_millis(100 + 3_600_000));
    // the sample of before is the newest that is not later than what is played
    shadow.step(last, until, |_| {
        asked.set(asked.get() + 1);
        Some(Vec2::new(-0.5, 0.0))
    });
    assert_eq!(asked.get(), 1001);
    assert_eq!(play(&mut shadow, 3_600_101..=3_600_200), 0);
    assert_eq!(masses(&shadow), [0.7, 0.7]);
}
