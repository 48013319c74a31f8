//! Laws of the paper's estimator on the plant.

use super::*;

#[test]
fn paper_mode_errs_by_tens_of_percent_at_200_ms_and_less_at_1_s() {
    let of_window = |window_s| accuracy(0.02, || paper(|config| config.window_s = window_s));
    let (short, long) = (of_window(0.2), of_window(1.0));
    let stacked = accuracy(0.02, || paper(|config| config.rows = Rows::Stacked));
    println!("paper: m, b, c at 200 ms {short:?}, x and y stacked {stacked:?}, at 1 s {long:?}");
    assert!(short[0] > 0.10 && short[0] < 0.60);
    assert!(
        stacked[0] > short[0],
        "stacking x and y suffers from a tool that slides"
    );
    assert!(long[0] < 0.5 * short[0]);
}

/// The spring between tool and surface moves with the force.
#[test]
fn the_motion_of_the_surface_shows_m_better_than_that_of_the_tool() {
    let error_of_m = |motion| accuracy(0.0, || paper(|config| config.motion = motion))[0];
    assert!(error_of_m(ObjectMotion::Surface) < error_of_m(ObjectMotion::Tool));
}

/// What happens in the first instants of a contact is not regressed.
#[test]
fn paper_mode_estimates_after_a_stable_contact() {
    let after = |spoiled_ticks: u32, stable_after_s| {
        let mut estimator = paper(|config| config.stable_after_s = stable_after_s);
        let mut plant = Plant::new(1, Noise::NONE);
        let mut touched = 0;
        loop {
            let mut measured = plant.push(&Motion::of_operator(1, 0));
            touched += u32::from(measured.normal.is_some());
            if touched < spoiled_ticks {
                measured.force *= 3.0;
            }
            let estimate = estimator.step(&measured);
            if estimate.excited || touched == PUSH_TICKS {
                break (touched, values(&estimate));
            }
        }
    };
    // a window of 200 ms that begins after 100 ms
    let (ticks, clean) = after(0, 0.1);
    assert_eq!(ticks, 300);
    // a spoiled force moves the surface that is found for 50 ms more, by what the filter remembers
    let (_, spoiled) = after(40, 0.1);
    let (_, ungated) = after(40, 0.0);
    let off = |found: [f64; 3]| errors(found, clean).into_iter().fold(0.0, f64::max);
    assert!(
        off(spoiled) < 0.1 * off(ungated),
        "{} {}",
        off(spoiled),
        off(ungated)
    );
}

/// A box that stands still shows neither m nor b nor c: its force is whatever friction holds.
#[test]
fn paper_mode_takes_standstill_for_friction_unless_it_is_left_out() {
    let after_a_rest = |leave_out_standstill| {
        let mut estimator = paper(|config| config.leave_out_standstill = leave_out_standstill);
        let mut plant = Plant::new(1, Noise::NONE);
        for _ in 0..PUSH_TICKS {
            estimator.step(&plant.push(&Motion::of_operator(1, 0)));
        }
        let moving = values(estimator.estimate());
        for _ in 0..500 {
            estimator.step(&plant.push(&Motion::steady(0.0)));
        }
        errors(values(estimator.estimate()), moving)
    };
    let (left_out, taken) = (after_a_rest(true), after_a_rest(false));
    println!("left out {left_out:?}, taken {taken:?}");
    assert!(left_out[0] < 0.5 * taken[0], "{left_out:?} {taken:?}");
}

#[test]
fn paper_mode_holds_when_not_in_contact_and_publishes_raw_values() {
    let (mut estimator, mut plant) = (paper(|_| {}), Plant::new(1, Noise::DEFAULT));
    let mut least = f64::INFINITY;
    for number in 0..3 {
        let motion = Motion::of_operator(1, number);
        push(&mut estimator, &mut plant, &motion, |_, _, estimate| {
            least = least.min(estimate.m).min(estimate.b).min(estimate.c);
        });
        let held = values(estimator.estimate());
        for _ in 0..100 {
            let estimate = estimator.step(&plant.push(&Motion::steady(0.0)));
            assert!(!estimate.excited);
            assert_eq!(values(&estimate), held);
        }
    }
    assert!(least < 0.0, "unbounded estimates go negative: {least}");
}
