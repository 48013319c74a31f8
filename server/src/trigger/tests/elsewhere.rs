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
