//! Reconciliation by replay: exact, sliced, and without a jolt.

use super::*;

/// Pushes with a wavering speed, so that mass and damping matter.
fn waver(model: &mut LocalModel, ticks: std::ops::RangeInclusive<u64>) {
    for n in ticks {
        let t = n as f64 * 1e-3;
        let x = -0.21 + 0.1 * t + 0.01 * libm::sin(9.0 * t);
        model.step(Time::from_millis(n), Vec2::new(x, 0.03));
    }
}

#[test]
fn an_old_answer_that_the_model_was_right_corrects_nothing_to_the_bit() {
    let mut model = replayed();
    waver(&mut model, 1..=1500);
    model.apply(&answer(&model, 600));
    waver(&mut model, 1501..=1600);
    assert!(model.is_replayed());
    assert_eq!(model.correction().remaining, Default::default());
}

#[test]
fn a_replay_gets_to_where_a_right_model_is_now_to_the_bit() {
    let (mut right, mut wrong) = (replayed(), replayed());
    wrong.body.state = state(0.4, 0.0, 1.0).into();
    wrong.body.state.pose.angle = 0.1;
    wrong.target = wrong.body.state.params;
    waver(&mut right, 1..=1500);
    waver(&mut wrong, 1..=1500);
    let error = |wrong: &LocalModel| wrong.state().pose.angle - right.state().pose.angle;
    assert!(error(&wrong).abs() > 0.05, "the effect exists");
    wrong.apply(&answer(&right, 600));
    waver(&mut right, 1501..=1600);
    waver(&mut wrong, 1501..=1600);
    let (remaining, own) = (wrong.correction().remaining, wrong.state().pose);
    let right = right.state().pose;
    assert_eq!(own.angle + remaining.turn, right.angle);
    assert!((own.position + remaining.shift - right.position).norm() < 1e-15);
}

#[test]
fn a_second_of_history_is_replayed_in_21_ticks_and_no_tick_takes_more_than_its_share() {
    let mut model = replayed();
    waver(&mut model, 1..=2000);
    model.apply(&answer(&model, 1001));
    // 1000 samples, and one more each tick, by 50 a tick: 1000 + 21 <= 50·21
    for n in 2001..=2020 {
        waver(&mut model, n..=n);
        assert!(!model.is_replayed(), "tick {n}");
    }
    waver(&mut model, 2021..=2021);
    assert!(model.is_replayed());
}

#[test]
fn an_update_that_comes_during_a_replay_waits_and_only_the_newest_does() {
    let mut model = replayed();
    waver(&mut model, 1..=2000);
    let first = answer(&model, 1001);
    let (mut older, newer) = (answer(&model, 1900), answer(&model, 1990));
    older.state = state(2.0, 3.0, 2.06);
    let newer = with(newer, |of| of.params = state(3.0, 3.0, 2.06).params());
    for update in [first, older, newer] {
        model.apply(&update);
    }
    assert_eq!(model.target, first.state.params());
    waver(&mut model, 2001..=2021);
    assert_eq!(
        model.target,
        newer.state.params(),
        "the older was never applied"
    );
    waver(&mut model, 2022..=2060);
    assert!(model.is_replayed());
}

#[test]
fn with_an_update_at_every_sample_and_any_delay_the_replay_still_arrives() {
    let (mut right, mut wrong) = (replayed(), replayed());
    wrong.body.state = state(0.4, 0.0, 1.0).into();
    for n in 1..=4000 {
        waver(&mut right, n..=n);
        if n > 1000 {
            wrong.apply(&answer(&right, n - 1000));
        }
        waver(&mut wrong, n..=n);
    }
    let error = (wrong.state().pose.angle - right.state().pose.angle).abs();
    assert!(error < 1e-3, "{error}");
}

#[test]
fn an_answer_from_before_the_history_leaves_the_pose_alone() {
    let mut model = replayed();
    waver(&mut model, 101..=500);
    let mut early = with(answer(&model, 200), |of| of.pose = Pose::new(1.0, 1.0, 1.0));
    early.answers = Time::from_millis(99);
    model.apply(&early);
    waver(&mut model, 501..=520);
    assert_eq!(model.correction().remaining, Default::default());
}

#[test]
fn a_face_that_is_not_there_goes_away_from_the_hand_without_letting_go_at_once() {
    let mut model = replayed();
    let before = push(&mut model, 1..=200);
    let mut carved = with(answer(&model, 200), |of| of.footprint.west -= 0.01);
    carved.touched_face = None;
    carved.cause = Cause::MasterOnlyContact;
    model.apply(&carved);
    let after = push(&mut model, 201..=201);
    assert!((after.force - before.force).norm() < 0.1, "no jolt");
    // a hand that stays where it is is let go by and by
    let hip = Vec2::new(-0.21 + 1e-4 * 201.0, 0.0);
    for n in 202..=2000 {
        model.step(Time::from_millis(n), hip);
    }
    assert!(!model.rendered().in_contact());
}

#[test]
fn while_an_answer_is_replayed_the_face_does_not_leave_a_resting_hand() {
    let mut model = replayed();
    push(&mut model, 1..=1500);
    let hip = model.history().newest().unwrap().hip + Vec2::new(5e-4, 0.0);
    let rest = |model: &mut LocalModel, n| model.step(Time::from_millis(n), hip);
    let held = (1501..=2000).map(|n| rest(&mut model, n)).last().unwrap();
    assert!(held.force.x > 0.2, "it rests lightly: {held:?}");
    // the slave met the same face on a box that is 2 cm narrower
    model.apply(&with(answer(&model, 600), |of| {
        of.footprint = BoxFootprint::square(0.36);
        of.pose.position.x -= 0.02;
    }));
    let (mut ticks, mut softest) = (0, f64::MAX);
    for n in 2001..=2500 {
        let rendered = rest(&mut model, n);
        ticks += u64::from(!model.is_replayed());
        softest = softest.min(rendered.force.x);
    }
    assert!(ticks > 25, "the replay takes its time: {ticks} ticks");
    assert!(
        softest > held.force.x - 1e-3,
        "{softest} N, before {held:?}"
    );
    assert!((model.state().footprint.west - 0.18).abs() < 1e-12);
}

#[test]
fn a_hand_that_was_let_into_what_no_tool_moves_does_not_move_it_in_the_replay() {
    let mut model = replayed();
    waver(&mut model, 1..=2000);
    let held = update(Cause::Timer, 800, state(5.0, 0.0, 20.0));
    model.apply(&held);
    waver(&mut model, 2001..=2100);
    assert!(model.is_replayed());
    let (remaining, own) = (model.correction().remaining, model.state().pose);
    assert!(own.position.norm() > 0.1, "the effect exists: {own:?}");
    let place = own.position + remaining.shift;
    assert!(place.norm() < 1e-3, "{place:?}");
}
