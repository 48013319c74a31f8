//! Laws of the pipeline, on pushes made by hand.

use super::*;
use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::model::update::Cause;
use mmt_shared::recording::{FingerSample, ForceSample, Push};

/// How far the finger goes in the air and at the block, m.
const WAY_M: (f64, f64) = (0.003, 0.010);
const FINGER_M_PER_S: f64 = 0.0025;

/// Pushes at one point of the block.
fn recording(pushes: u32, friction: impl Fn(u32) -> f64) -> Recording {
    recording_along(pushes, friction, |_| 0.01)
}

/// Pushes of a block of 0.1 m in x by `friction` (N) after an onset of 0.04 s, each from where the last one ended, at a place
/// along its west side, m.
fn recording_along(
    pushes: u32,
    friction: impl Fn(u32) -> f64,
    along: impl Fn(u32) -> f64,
) -> Recording {
    let (air_s, end_s) = (
        WAY_M.0 / FINGER_M_PER_S,
        (WAY_M.0 + WAY_M.1) / FINGER_M_PER_S,
    );
    let push = |n: u32| {
        let at = f64::from(n) * WAY_M.1;
        let finger = |t_s: f64| FingerSample {
            t_s,
            pose: Pose::new(at - 0.05 - WAY_M.0 + t_s * FINGER_M_PER_S, along(n), 0.0),
        };
        let force = |t_s: f64| ForceSample {
            t_s,
            force: Vec2::new(friction(n) * ((t_s - air_s) / 0.04).clamp(0.0, 1.0), 0.0),
        };
        let times = |hz: f64| (0..=(end_s * hz) as u32).map(move |k| f64::from(k) / hz);
        Push {
            before: Pose::new(at, 0.0, 0.3),
            after: Pose::new(at + WAY_M.1, 0.0, 0.3),
            force: times(100.0).map(force).collect(),
            finger: times(33.0).map(finger).collect(),
        }
    };
    Recording {
        pushes: (0..pushes).map(push).collect(),
    }
}

fn mmt(course: &Course, delay_ms: u64) -> PipelineReport {
    let run = system::run(course, MMT, Duration::from_millis(delay_ms)).unwrap();
    run.report("mmt", MMT.to_string(), delay_ms)
}

#[test]
fn a_steady_friction_is_rendered_and_costs_less_than_to_hold_the_force() {
    let course = Course::of(&recording(6, |_| 4.0));
    for delay_ms in DELAYS_MS {
        let report = mmt(&course, delay_ms);
        let errors = report.errors;
        assert!(
            errors.force_median.unwrap() < 0.02,
            "{delay_ms}: {errors:?}"
        );
        assert!(
            errors.vector_median.unwrap() < 0.03,
            "{delay_ms}: {errors:?}"
        );
        let held = Hold::new(0.08, None).run(&course, Duration::from_millis(delay_ms));
        assert!(report.sent < held.sent, "{} of {}", report.sent, held.sent);
        assert!((report.contact_s / 24.0 - 1.0).abs() < 0.05);
    }
}

#[test]
fn a_side_that_earlier_pushes_have_shown_is_felt_without_the_round_trip() {
    let course = Course::of(&recording_along(
        10,
        |_| 4.0,
        |n| 0.01 * f64::from(n % 4) - 0.02,
    ));
    let delay = Duration::from_millis(250);
    let (mut late_s, mut refuted) = (vec![None; 10], 0);
    system::drive(&course, MMT, delay, |t_s, tick| {
        let felt = tick.slave.as_ref().and_then(|slave| slave.f_m);
        let cause = tick
            .slave
            .as_ref()
            .and_then(|slave| slave.update)
            .map(|update| update.cause);
        refuted += usize::from(cause == Some(Cause::MasterOnlyContact));
        if let (Some(push), Some(force)) = (course.push_at(t_s), felt)
            && force.x > 2.0
        {
            let touched_s = course.pushes[push].0 + WAY_M.0 / FINGER_M_PER_S;
            late_s[push].get_or_insert(t_s - touched_s);
        }
    })
    .unwrap();
    let late_s: Vec<f64> = late_s.into_iter().flatten().collect();
    assert!(late_s[0] > 0.5, "{late_s:?}");
    assert_eq!(refuted, 0, "what is felt a little too early is no mismatch");
    // half of the force comes when the finger is at the side, to some tenths of a millimetre
    assert!(
        late_s[5..].iter().all(|late_s| late_s.abs() < 0.15),
        "{late_s:?}"
    );
}

#[test]
fn another_friction_is_learned_from_its_own_pushes_only() {
    let course = Course::of(&recording(6, |n| if n < 3 { 4.0 } else { 2.5 }));
    let errors = mmt(&course, 0).errors;
    assert!(errors.force_median_of_pushes.unwrap() < 0.02, "{errors:?}");
}

/// Every force that was rendered and every update up to a time, s.
fn history(course: &Course, until_s: f64) -> Vec<(Option<Vec2>, bool)> {
    let mut seen = Vec::new();
    system::drive(course, MMT, Duration::from_millis(50), |t_s, tick| {
        if let Some(slave) = tick.slave.as_ref().filter(|_| t_s <= until_s) {
            seen.push((slave.f_m, slave.update.is_some()));
        }
    })
    .unwrap();
    seen
}

#[test]
fn no_sample_changes_what_was_rendered_or_sent_before_it() {
    let course = Course::of(&recording(3, |_| 4.0));
    let other = Course::of(&recording(3, |n| if n < 2 { 4.0 } else { 2.0 }));
    let (third_s, end_s) = course.pushes[2];
    let touched_s = third_s + WAY_M.0 / FINGER_M_PER_S;
    assert_eq!(history(&course, touched_s), history(&other, touched_s));
    assert_ne!(history(&course, end_s), history(&other, end_s));
}

#[test]
fn a_held_force_is_sent_when_it_is_off_and_once_when_contact_ends() {
    // contact from 1 s: 1, 1.05, 1.2 N (off by 16 %), 0.2 N (no contact)
    let steps = [(0.0, 0.0), (1.0, 1.0), (1.1, 1.05), (1.2, 1.2), (1.3, 0.2)];
    let force = |(t_s, x): &(f64, f64)| ForceSample {
        t_s: *t_s,
        force: Vec2::new(*x, 0.0),
    };
    let mut only = recording(1, |_| 4.0);
    only.pushes[0].force = steps.iter().map(force).collect();
    let course = Course::of(&only);
    let held =
        |delta, delay_ms| Hold::new(delta, None).run(&course, Duration::from_millis(delay_ms));
    assert_eq!(
        (held(0.15, 0).sent, held(0.10, 0).sent, held(0.5, 0).sent),
        (3, 3, 2)
    );
    // 298 ms in contact: 1 ms late at 1 N and at 1.2 N, 100 ms off by 0.05 of 1.05
    let report = held(0.10, 0).report("hold", String::new(), 0);
    assert!(
        (report.contact_s - 0.3).abs() < 0.0021,
        "{}",
        report.contact_s
    );
    let mean = (1.0 + 100.0 * (0.05 / 1.05) + (0.2 / 1.2)) / 300.0;
    assert!(
        (report.errors.force_mean.unwrap() - mean).abs() < 2e-3,
        "{report:?}"
    );
    assert_eq!(report.errors.force_median, Some(0.0));
    // over all of the time: a tick late at each change, and 0.2 N to the end that no contact is
    let (began_s, _) = course.pushes[0];
    let rest = 0.2 * (course.duration_s() - began_s - 1.3) * 1e3;
    let (error, all) = (1.0 + 100.0 * 0.05 + 0.2 + 1.0 + rest, 100.0 * 3.25 + rest);
    let impulse_error = report.errors.impulse_error.unwrap();
    assert!((impulse_error - error / all).abs() < 2e-3, "{report:?}");
    // a round trip late, nothing is felt of so short a touch
    let late = held(0.10, 250).report("hold", String::new(), 250);
    assert_eq!(late.errors.force_median, Some(1.0));
}

#[test]
fn the_timer_sends_in_contact_only() {
    let course = Course::of(&recording(1, |_| 4.0));
    let timed = Hold::new(0.5, Some(Duration::from_millis(150))).run(&course, Duration::ZERO);
    let quiet = Hold::new(0.5, None).run(&course, Duration::ZERO);
    let more = timed.sent - quiet.sent;
    assert!((24..=27).contains(&more), "{more}");
}
