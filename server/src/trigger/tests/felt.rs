//! What the hand would feel: the schemes `useful` and `adaptive`.

use super::*;

/// After how many ms the trigger sends, within five seconds of this input from 1 ms on.
fn first_sent(trigger: &mut Trigger, input: &TriggerInput) -> Option<u64> {
    (1..5000).find(|n| trigger.step(Time::from_millis(*n), input).is_some())
}

#[test]
fn useful_sends_only_what_would_be_felt_and_not_twice_within_ten_milliseconds() {
    let mut trigger = trigger("useful 10% 150ms", Mode::Recommended);
    let at = |n| Time::from_millis(n);
    let violating = input(2.0, 3.0);
    assert_eq!(
        trigger.step(at(0), &violating),
        Some(Cause::Deadband),
        "the first is news"
    );
    assert_eq!(
        trigger.step(at(20), &violating),
        None,
        "it would say the same again"
    );
    let changed = TriggerInput {
        params: params(0.7, 2.2),
        ..violating
    };
    assert_eq!(trigger.step(at(21), &changed), Some(Cause::Deadband));
    let again = TriggerInput {
        params: params(0.7, 2.4),
        ..violating
    };
    assert_eq!(trigger.step(at(30), &again), None);
    assert_eq!(trigger.step(at(31), &again), Some(Cause::Deadband));
    let turned = TriggerInput {
        params: params(0.7, 2.4),
        turn: 0.011,
        ..input(2.0, 2.0)
    };
    assert_eq!(trigger.step(at(180), &turned), None);
    assert_eq!(trigger.step(at(181), &turned), Some(Cause::Timer));
}

#[test]
fn adaptive_sends_sooner_the_more_there_is_to_say_and_never_when_there_is_nothing() {
    // relative force changes of 2, 4 and 8 %: below Delta, so that only what adds up can fire
    let first_after = |change_n: f64| {
        let mut trigger = trigger("adaptive 10% 50ms", Mode::Recommended);
        let start = input(2.0, 2.0);
        let away = TriggerInput {
            f_m: Vec2::new(3.0, 0.0),
            ..start
        };
        assert_eq!(trigger.step(Time::ZERO, &away), Some(Cause::Deadband));
        let changed = TriggerInput {
            params: params(0.7, 2.06 + change_n),
            ..start
        };
        first_sent(&mut trigger, &changed)
    };
    // 10 % for 50 ms: 5e-3 s
    for (change_n, ticks) in [(0.04, 250), (0.08, 125), (0.16, 63)] {
        let sent = first_after(change_n);
        assert!(
            [Some(ticks), Some(ticks + 1)].contains(&sent),
            "{change_n} N after {sent:?} ms"
        );
    }
    assert_eq!(first_after(0.0), None);
}

#[test]
fn adaptive_does_not_send_what_the_estimate_does_not_know() {
    let mut trigger = trigger("adaptive 10% 50ms", Mode::Recommended);
    let start = input(2.0, 3.0);
    assert_eq!(trigger.step(Time::ZERO, &start), Some(Cause::Deadband));
    let unsure = TriggerInput {
        params: params(0.7, 2.16),
        force_deviation: 0.12,
        ..input(2.0, 2.0)
    };
    assert_eq!(first_sent(&mut trigger, &unsure), None);
}

#[test]
fn useful_sends_a_change_of_so_many_deviations_and_of_fewer_where_the_force_is_wrong() {
    let sends = |f_m: f64, deviations: f64, noise_n: f64| {
        let mut trigger = trigger("useful 10% 150ms", Mode::Recommended);
        assert!(trigger.step(Time::ZERO, &input(2.0, 3.0)).is_some());
        let changed = TriggerInput {
            noise_n,
            params: params(0.7, 2.06 + 0.1 * deviations),
            force_deviation: 0.1,
            ..input(2.0, f_m)
        };
        first_sent(&mut trigger, &changed).is_some()
    };
    for (f_m, noise_n, least) in [(2.0, 0.0, 10.0), (3.0, 0.0, 2.0), (3.0, 0.01, 5.0)] {
        assert!(!sends(f_m, 0.9 * least, noise_n), "{f_m} N, {noise_n} N");
        assert!(sends(f_m, 1.1 * least, noise_n), "{f_m} N, {noise_n} N");
    }
}

#[test]
fn useful_sends_a_turn_that_is_more_than_what_is_known_of_the_angle() {
    let sends = |turn: f64, turn_deviation: f64| {
        let mut trigger = trigger("useful 10% 150ms", Mode::Recommended);
        assert!(trigger.step(Time::ZERO, &input(2.0, 3.0)).is_some());
        let turned = TriggerInput {
            turn,
            turn_deviation,
            ..input(2.0, 2.0)
        };
        first_sent(&mut trigger, &turned).is_some()
    };
    assert!(sends(0.011, 0.003) && !sends(0.009, 0.003));
    assert!(sends(0.031, 0.010) && !sends(0.029, 0.010));
}

#[test]
fn useful_sends_an_object_that_is_touched_and_20_mm_from_where_the_model_has_it() {
    let first_after = |shift_m: f64| {
        let mut trigger = trigger("useful 10% 150ms", Mode::Recommended);
        assert!(trigger.step(Time::ZERO, &input(2.0, 3.0)).is_some());
        // along the face: the force is right
        let slipped = TriggerInput {
            shift: Vec2::new(0.0, shift_m),
            ..input(2.0, 2.0)
        };
        first_sent(&mut trigger, &slipped)
    };
    assert_eq!(first_after(0.019), None);
    assert_eq!(first_after(0.021), Some(150));
}

#[test]
fn adaptive_sends_where_a_held_face_is_the_sooner_the_more_the_force_is_wrong() {
    let first_after = |f_m: f64| {
        let mut trigger = trigger("adaptive 10% 50ms", Mode::Recommended);
        assert!(trigger.step(Time::ZERO, &input(1.0, 2.0)).is_some());
        let held = TriggerInput {
            sticking: true,
            speed: 0.0,
            acceleration: 0.0,
            ..input(1.0, f_m)
        };
        first_sent(&mut trigger, &held)
    };
    // 10 % for 50 ms, 5e-3 s, at 25 and 50 %; never within 10 ms of the last
    for (f_m, ticks) in [(1.25, 20), (1.5, 10)] {
        let sent = first_after(f_m);
        assert!(
            [Some(ticks), Some(ticks + 1)].contains(&sent),
            "{f_m} N after {sent:?} ms"
        );
    }
    assert_eq!(first_after(1.05), None);
}

#[test]
fn useful_sends_where_a_held_face_is_once_a_period_while_the_force_is_wrong() {
    let mut trigger = trigger("useful 10% 150ms", Mode::Recommended);
    let held = |f_m: f64| TriggerInput {
        sticking: true,
        speed: 0.0,
        acceleration: 0.0,
        ..input(1.0, f_m)
    };
    let first = trigger.step(Time::ZERO, &input(1.0, 2.0));
    assert_eq!(first, Some(Cause::Deadband));
    let sent = |trigger: &mut Trigger, f_m: f64, from: u64, to: u64| -> Vec<u64> {
        let fires = |n: &u64| trigger.step(Time::from_millis(*n), &held(f_m)).is_some();
        (from..to).filter(fires).collect()
    };
    assert_eq!(sent(&mut trigger, 0.8, 1, 500), [150, 300, 450]);
    assert_eq!(sent(&mut trigger, 0.95, 500, 1000), [0; 0]);
}
