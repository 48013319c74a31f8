//! What the local model promises: forces, smoothing, and corrections without a jolt.

use super::*;
use crate::fixtures::{self, COUPLING, square_at_rest};
use crate::model::correction::ROOM_M;
use crate::model::geometry::{BoxFootprint, Pose};
use crate::model::settings::Mode;
use crate::model::tool::TOOL_FORCE_MAX_N;
use crate::model::update::Cause;

mod energy;
mod hostile;
mod phantom;
mod replay;

fn state(m: f64, b: f64, c: f64) -> ModelState {
    square_at_rest(m, b, c, 0.4)
}

fn model(mode: Mode, correction: PoseCorrection) -> LocalModel {
    let settings = ModelSettings {
        correction,
        ..mode.model_settings(COUPLING)
    };
    LocalModel::new(settings, state(0.7, 3.0, 2.06), TOOL_FORCE_MAX_N)
}

fn accepted(state: impl Into<BodyState>) -> ModelState {
    let state = state.into();
    ModelState::try_new(
        state.params,
        state.footprint,
        state.pose,
        state.twist,
        &COUPLING,
    )
    .unwrap()
}

fn update(cause: Cause, answers_ms: u64, state: impl Into<BodyState>) -> Update {
    fixtures::update(1, cause, answers_ms, accepted(state))
}

fn replayed() -> LocalModel {
    model(Mode::Recommended, PoseCorrection::Replay)
}

/// Answers with what `model` was at a stamp.
fn answer(model: &LocalModel, ms: u64) -> Update {
    let then = model.history().at(Time::from_millis(ms)).unwrap();
    let state = BodyState {
        pose: then.motion.pose,
        twist: then.motion.twist,
        ..*model.state()
    };
    Update {
        touched_face: then.god.touched(),
        ..update(Cause::Deadband, ms, state)
    }
}

/// The same update with another state.
fn with(mut update: Update, change: impl FnOnce(&mut BodyState)) -> Update {
    let mut state = update.state.into();
    change(&mut state);
    update.state = accepted(state);
    update
}

/// Pushes the west face at 0.1 m/s from a stand-off of 1 cm; ticks from 1 to `until`.
fn push(model: &mut LocalModel, ticks: std::ops::RangeInclusive<u64>) -> Rendered {
    let mut last = Rendered::default();
    for n in ticks {
        let hip = Vec2::new(-0.21 + 1e-4 * n as f64, 0.0);
        last = model.step(Time::from_millis(n), hip);
    }
    last
}

#[test]
fn a_steady_push_is_met_by_friction_and_damping() {
    let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
    let rendered = push(&mut model, 1..=3000);
    // c + b v = 2.06 + 3·0.1
    assert!(
        (rendered.force.x - 2.36).abs() < 1e-6,
        "{:?}",
        rendered.force
    );
    assert!(rendered.force.y.abs() < 1e-12);
}

#[test]
fn equation_4_blends_once_per_packet() {
    let mut model = model(Mode::Paper, PoseCorrection::Snap);
    push(&mut model, 1..=10);
    model.apply(&update(Cause::Timer, 10, state(0.9, 1.0, 4.06)));
    let params = model.state().params;
    assert!((params.m() - 0.8).abs() < 1e-12);
    assert!((params.b() - 2.0).abs() < 1e-12);
    assert!((params.c() - 3.06).abs() < 1e-12);
    push(&mut model, 11..=50);
    assert_eq!(model.state().params, params, "time alone changes nothing");
}

#[test]
fn smoothing_in_time_has_its_time_constant() {
    let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
    push(&mut model, 1..=10);
    model.apply(&update(Cause::Timer, 10, state(1.7, 3.0, 2.06)));
    push(&mut model, 11..=30);
    let expected = 0.7 + 1.0 * (1.0 - libm::exp(-1.0));
    assert!((model.state().params.m() - expected).abs() < 1e-9);
}

#[test]
fn a_received_pose_is_never_set_on_arrival() {
    let mut far = BodyState::from(state(0.7, 3.0, 2.06));
    far.pose = Pose::new(-0.05, 0.03, 0.3);
    let jump = |correction| {
        let mut model = model(Mode::Recommended, correction);
        push(&mut model, 1..=1000);
        let before = model.rendered().force;
        model.apply(&update(Cause::SlaveOnlyContact, 1000, far));
        (push(&mut model, 1001..=1001).force - before).norm()
    };
    assert!(jump(PoseCorrection::Snap) > 10.0, "the effect exists");
    assert!(jump(PoseCorrection::MatchedStamps) < 0.5);
}

#[test]
fn the_pose_is_held_against_what_the_model_was_at_the_stamp() {
    // the slave reports, late, exactly what the model was: nothing must be corrected
    let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
    push(&mut model, 1..=1000);
    let then = model
        .history()
        .at(Time::from_millis(700))
        .unwrap()
        .motion
        .pose;
    let mut late = *model.state();
    late.pose = then;
    model.apply(&update(Cause::Deadband, 700, late));
    assert!(model.correction().remaining.shift.norm() < 1e-15);
    assert!(
        model.state().pose.position.x - then.position.x > 0.01,
        "the box has moved on"
    );
}

#[test]
fn a_learned_offset_does_not_move_the_touched_face() {
    let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
    let before = push(&mut model, 1..=1000).touch.unwrap();
    let mut learned = *model.state();
    learned.footprint = BoxFootprint::square(0.36);
    learned.pose = model
        .history()
        .at(Time::from_millis(1000))
        .unwrap()
        .motion
        .pose;
    learned.pose.position.x -= 0.02;
    model.apply(&update(Cause::Deadband, 1000, learned));
    let after = push(&mut model, 1001..=1001).touch.unwrap();
    assert!((after.penetration - before.penetration).abs() < 1e-5);
    assert_eq!(model.state().footprint.west, 0.18);
    assert!(
        model.correction().remaining.shift.norm() < 1e-9,
        "plane and centre agree already"
    );
}

#[test]
fn mismatch_case_1_releases_the_master() {
    // the slave is free where the master touches: the carved face lets go at once
    let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
    assert!(push(&mut model, 1..=105).in_contact());
    let mut carved = *model.state();
    carved.pose = model
        .history()
        .at(Time::from_millis(105))
        .unwrap()
        .motion
        .pose;
    carved.footprint.west -= 0.005;
    let free = Update {
        touched_face: None,
        ..update(Cause::MasterOnlyContact, 105, carved)
    };
    model.apply(&free);
    assert!(!push(&mut model, 106..=106).in_contact());
}

#[test]
fn mismatch_case_2_brings_the_model_to_the_hand() {
    let mut model = model(Mode::Paper, PoseCorrection::Snap);
    push(&mut model, 1..=50);
    let mut near = *model.state();
    near.pose.position.x -= 0.008;
    assert!(!model.rendered().in_contact());
    model.apply(&update(Cause::SlaveOnlyContact, 50, near));
    assert!(push(&mut model, 51..=51).in_contact());
}

#[test]
fn a_snapped_update_sets_the_whole_pose_whatever_caused_it() {
    for cause in Cause::ALL {
        let mut model = model(Mode::Paper, PoseCorrection::Snap);
        push(&mut model, 1..=50);
        let before = *model.state();
        let mut elsewhere = before;
        elsewhere.pose.position += Vec2::new(0.013, -0.007);
        elsewhere.pose.angle += 0.05;
        model.apply(&update(cause, 50, elsewhere));
        let (is, was) = (model.state().pose, before.pose);
        let shift = is.position - was.position;
        assert!(
            (shift - Vec2::new(0.013, -0.007)).norm() < 1e-12,
            "{cause:?} {shift:?}"
        );
        assert!((is.angle - was.angle - 0.05).abs() < 1e-12, "{cause:?}");
    }
}

#[test]
fn in_free_space_the_box_comes_up_to_the_hip_and_not_over_it() {
    let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
    // not a whole number of the bleed's steps away
    let hip = Vec2::new(-0.2053, 0.0);
    let rest = |model: &mut LocalModel, ticks: std::ops::RangeInclusive<u64>| {
        ticks
            .map(|n| model.step(Time::from_millis(n), hip).force.norm())
            .fold(0.0, f64::max)
    };
    rest(&mut model, 1..=10);
    let mut nearer = *model.state();
    nearer.pose.position.x -= 0.020;
    model.apply(&update(Cause::SlaveOnlyContact, 10, nearer));
    // the tank is empty: nothing has been dissipated yet
    let largest = rest(&mut model, 11..=500);
    let moved = model.state().pose.position.x;
    assert!(
        (moved + 0.0053 - ROOM_M).abs() < 1e-6,
        "up to the HIP: {moved}"
    );
    assert!(largest < 1e-6, "not over it: {largest} N");
}

#[test]
fn two_models_with_the_same_samples_and_updates_are_equal_to_the_bit() {
    let run = || {
        let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
        push(&mut model, 1..=500);
        model.apply(&update(Cause::Deadband, 400, state(0.9, 1.0, 3.0)));
        push(&mut model, 501..=1500);
        *model.state()
    };
    assert_eq!(run(), run());
}
