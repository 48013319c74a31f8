//! When an object that nobody touches is sent.

use super::*;

/// An object that nobody touches and that is so many m away from where the model has it.
fn untouched(shift: f64, shift_deviation: f64) -> TriggerInput {
    TriggerInput {
        slave_in_contact: false,
        shadow_in_contact: false,
        shift: Vec2::new(shift, 0.0),
        shift_deviation,
        ..input(0.0, 0.0)
    }
}

#[test]
fn an_untouched_object_that_is_elsewhere_is_sent_every_50_ms_until_it_is_not() {
    for scheme in ["useful 10% 150ms", "deadband 10%", "timer 10s"] {
        let mut trigger = trigger(scheme, Mode::Recommended);
        let mut sent = |shift: f64, deviation: f64, from: u64| -> Vec<(u64, Cause)> {
            let step = |n| {
                let asked = trigger.step(Time::from_millis(n), &untouched(shift, deviation));
                asked.map(|cause| (n - from, cause))
            };
            (from..from + 120).filter_map(step).collect()
        };
        let often = [0, 50, 100].map(|n| (n, Cause::Elsewhere));
        assert_eq!(sent(1.1e-3, 0.3e-3, 100), often, "{scheme}");
        assert_eq!(sent(0.9e-3, 0.0, 500), [], "{scheme}");
        assert_eq!(sent(1.1e-3, 0.4e-3, 1000), [], "noise of the images");
    }
}

#[test]
fn where_an_object_is_matters_only_while_nobody_touches_it_and_never_in_the_paper() {
    let mut trigger = trigger("deadband 10%", Mode::Recommended);
    let touched = TriggerInput {
        shift: Vec2::new(0.1, 0.0),
        ..input(2.0, 2.0)
    };
    assert_eq!(trigger.step(Time::from_millis(1), &touched), None);
    let mut paper = self::trigger("deadband 10%", Mode::Paper);
    assert_eq!(paper.step(Time::from_millis(1), &untouched(0.1, 0.0)), None);
}

#[test]
fn a_model_that_an_obstacle_held_is_released_once_where_only_friction_holds_the_object() {
    let mut trigger = trigger("useful 10% 150ms", Mode::Recommended);
    let at = |c: f64, only_friction_holds: bool| TriggerInput {
        params: params(0.7, c),
        only_friction_holds,
        ..untouched(0.0, 0.0)
    };
    let pushed = TriggerInput {
        params: params(0.7, 150.0),
        ..input(8.0, 4.0)
    };
    assert_eq!(
        trigger.step(Time::from_millis(1), &pushed),
        Some(Cause::Deadband)
    );
    let mut sent = |input: TriggerInput, from: u64| -> Vec<(u64, Cause)> {
        let step = |n| (trigger.step(Time::from_millis(n), &input)).map(|cause| (n - from, cause));
        (from..from + 200).filter_map(step).collect()
    };
    assert_eq!(
        sent(at(2.0, false), 100),
        [],
        "it would push against that again"
    );
    assert_eq!(sent(at(2.0, true), 300), [(0, Cause::Elsewhere)]);
    // what differs by less is an estimate that has changed
    assert_eq!(sent(at(0.9, true), 500), []);
}
