//! Laws of the replay, on pushes made by hand.

use super::*;
use mmt_shared::model::geometry::Pose;
use mmt_shared::recording::{FingerSample, ForceSample};
use mmt_shared::rng::Substream;

const TRUTH: Support = Support {
    friction_n: 4.2,
    arm_m: 0.055,
    centre_m: Vec2::new(0.003, 0.002),
};

/// A push on the block's west side whose force obeys `law`: 1 s in the air, 4 s in contact.
fn push(law: Law, random: &mut Substream) -> Push {
    let before = Pose::new(0.6, 0.1, random.uniform_in(-3.0, 3.0));
    let way = rotate(before.angle, Vec2::new(0.009, 0.006 * random.normal()));
    let after = Pose {
        position: before.position + way,
        angle: before.angle + 0.15 * random.normal(),
    };
    let touched = Vec2::new(-0.05, random.uniform_in(-0.05, 0.09));
    let finger = |t_s| FingerSample {
        t_s,
        pose: Pose {
            position: after.point_to_world(touched),
            angle: 0.0,
        },
    };
    let mut push = Push {
        before,
        after,
        force: Vec::new(),
        finger: vec![finger(0.0), finger(5.0)],
    };
    let motion = PushMotion::of(&push);
    let steady = rotate(motion.halfway, law.force(&TRUTH, &motion));
    push.force = (0..500)
        .map(|k: u32| ForceSample {
            t_s: f64::from(k) * 0.01,
            force: if k < 100 { Vec2::zeros() } else { steady },
        })
        .collect();
    push
}

fn recording(law: Law, count: usize) -> Recording {
    let mut random = Substream::new(11, "test/replay", 0);
    Recording {
        pushes: (0..count).map(|_| push(law, &mut random)).collect(),
    }
}

fn run(recording: &Recording) -> ReplayReport {
    replay(recording, &ReplayConfig::default(), &mut |_, _| {})
}

#[test]
fn the_law_that_made_the_pushes_learns_them_and_decoupled_friction_does_not() {
    for law in [Law::LimitSurfaceTwist, Law::LimitSurface, Law::ThreePoint] {
        let report = run(&recording(law, 40));
        let error = |law| report.held_out(law).unwrap().median_error.unwrap();
        assert!(error(law) < 0.01, "{law:?} {}", error(law));
        assert!(error(Law::Decoupled) > 0.03);
        let own = report.law(law).unwrap();
        assert!((own.friction_n / TRUTH.friction_n - 1.0).abs() < 0.03);
        assert!(own.updates.rate_hz < report.law(Law::Decoupled).unwrap().updates.rate_hz);
    }
}

#[test]
fn a_push_is_predicted_without_its_own_force() {
    let honest = recording(Law::LimitSurface, 8);
    let mut changed = honest.clone();
    let last = changed.pushes.last_mut().unwrap();
    last.force.iter_mut().for_each(|sample| sample.force *= 2.0);
    let predictions = |report: ReplayReport| {
        let laws = report.pushes.last().unwrap().laws.clone();
        laws.iter().map(|law| law.predicted_n).collect::<Vec<_>>()
    };
    assert_eq!(predictions(run(&honest)), predictions(run(&changed)));
    // and it does take part in what is learned afterwards
    let c = |recording| run(recording).law(Law::LimitSurface).unwrap().friction_n;
    assert_ne!(c(&honest), c(&changed));
}

#[test]
fn the_first_push_is_predicted_from_the_start_values_and_the_second_is_better() {
    let report = run(&recording(Law::LimitSurface, 2));
    let error = |push: usize| report.pushes[push].laws[2].relative_error.unwrap();
    assert!(error(0) > 0.5);
    assert!(error(1) < 0.2);
}

#[test]
fn what_has_no_meaning_is_absent() {
    let mut air = recording(Law::LimitSurface, 2);
    for push in &mut air.pushes {
        push.force
            .iter_mut()
            .for_each(|sample| sample.force *= 1e-3);
    }
    let report = run(&air);
    assert!(report.pushes.iter().all(|push| push.measured_n.is_none()));
    for law in &report.laws {
        assert_eq!(law.force_error, Spread::default());
        assert_eq!((law.updates.sent, law.updates.contact_rate_hz), (0, None));
        assert_eq!(law.friction_torque_nm.is_none(), law.law == Law::Decoupled);
    }
    assert!(report.held_out.iter().all(|law| law.median_error.is_none()));
    assert!(report.to_string().contains('-'));
}

#[test]
fn the_steady_force_leaves_out_the_approach_and_does_not_hang_on_a_peak() {
    let config = ReplayConfig::default();
    let mut push = recording(Law::LimitSurface, 1).pushes.remove(0);
    let steady = steady_force(&config, &push).unwrap();
    assert!((steady - push.force[300].force).norm() < 1e-9);
    push.force[100].force *= 3.0;
    let with_peak = steady_force(&config, &push).unwrap();
    assert!((with_peak - steady).norm() < 0.01 * steady.norm());
    assert!((contact_time_s(&config, &push) - 3.99).abs() < 1e-9);
}

#[test]
fn progress_rises_to_the_whole() {
    let mut seen = Vec::new();
    let recording = recording(Law::LimitSurface, 3);
    replay(&recording, &ReplayConfig::default(), &mut |done, whole| {
        seen.push((done, whole));
    });
    assert_eq!(seen.first(), Some(&(0, 8)));
    assert_eq!(seen.last(), Some(&(8, 8)));
    assert!(seen.windows(2).all(|pair| pair[0].0 < pair[1].0));
}

#[test]
fn of_many_splits_the_percentiles_are_shown_and_of_few_each() {
    let recording = recording(Law::LimitSurface, 8);
    let shown = |repeats| {
        let config = ReplayConfig {
            repeats,
            ..ReplayConfig::default()
        };
        replay(&recording, &config, &mut |_, _| {})
    };
    let (few, many) = (shown(3), shown(100));
    assert_eq!(few.held_out[0].median_errors.len(), 3);
    assert_eq!(many.held_out[0].median_errors.len(), 100);
    assert_eq!(
        few.held_out[0].median_errors,
        many.held_out[0].median_errors[..3]
    );
    let text = "percentile:";
    assert!(many.to_string().contains(text) && !few.to_string().contains(text));
}

#[test]
fn two_replays_of_one_recording_are_equal_to_the_bit() {
    let recording = recording(Law::ThreePoint, 10);
    assert_eq!(run(&recording), run(&recording));
}
