//! What the master promises its hand.

use super::*;
use crate::failsafe::RELEASE;
use crate::limiter::Limits;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{BoxFootprint, Face, Pose, Twist};
use mmt_shared::model::params::{ModelParams, ModelState};
use mmt_shared::model::settings::Mode;
use mmt_shared::model::tool::TOOL_FORCE_MAX_N;
use mmt_shared::model::update::Cause;
use mmt_shared::pairing::Token;
use mmt_shared::wire::Label;

fn welcome() -> Welcome {
    let coupling = Coupling::for_stiffness(1000.0);
    let params = ModelParams::of_square(0.7, 3.0, 2.06, 0.4, &coupling).unwrap();
    let (footprint, pose) = (BoxFootprint::square(0.4), Pose::default());
    Welcome {
        settings: Mode::Recommended.model_settings(coupling),
        state: ModelState::try_new(params, footprint, pose, Twist::default(), &coupling).unwrap(),
        tool: Vec2::new(-0.45, 0.0),
        tool_force_max_n: TOOL_FORCE_MAX_N,
        resume: Token::new([0; 32]),
        scheme: Label::clipped("timer 150ms"),
        program: Label::clipped("test"),
    }
}

fn master() -> Master {
    Master::new(
        &welcome(),
        ForceLimiter::try_new(Limits::default()).unwrap(),
    )
}

/// Pushes the west face at 0.1 m/s from 1 cm away.
fn push(
    master: &mut Master,
    ticks: std::ops::RangeInclusive<u64>,
    silence: Duration,
) -> MasterTick {
    ticks
        .map(|n| {
            let hip = Vec2::new(-0.21 + 1e-4 * n as f64, 0.0);
            master.tick(Time::from_millis(n), hip, silence)
        })
        .last()
        .unwrap()
}

fn update() -> Update {
    let state = welcome().state;
    Update {
        sequence: 1,
        cause: Cause::Timer,
        answers: Time::from_millis(1),
        touched_face: Some(Face::West),
        state,
    }
}

#[test]
fn the_hand_gets_the_opposite_of_what_the_object_gets() {
    let tick = push(&mut master(), 1..=2000, Duration::ZERO);
    assert!((tick.rendered.force.x - 2.36).abs() < 1e-3);
    assert!((tick.hand_force + tick.rendered.force).norm() < 1e-12);
    let sent = tick.sample.force.newtons();
    assert!(
        (sent - tick.rendered.force).norm() <= 1e-4,
        "sent on the wire's grid"
    );
}

#[test]
fn a_reading_that_is_no_number_is_replaced_by_the_one_before() {
    let mut master = master();
    let before = push(&mut master, 1..=500, Duration::ZERO);
    let tick = master.tick(
        Time::from_millis(501),
        Vec2::new(f64::NAN, 0.0),
        Duration::ZERO,
    );
    assert_eq!(tick.sample.hip, before.sample.hip);
    assert!(tick.hand_force.x.is_finite());
    assert_eq!(master.bad_readings(), 1);
}

#[test]
fn a_silent_link_releases_the_hand_for_good() {
    let mut master = master();
    let just_before = RELEASE - Duration::from_nanos(1);
    let held = push(&mut master, 1..=1000, just_before);
    assert!(
        held.hand_force.norm() > 2.0,
        "the frozen model is rendered on"
    );
    let mut last = push(&mut master, 1001..=1001, RELEASE).hand_force.norm();
    for n in 1002..=1300 {
        // the link is back, the hand is not
        let now = push(&mut master, n..=n, Duration::ZERO).hand_force.norm();
        assert!(now <= last + 1e-12);
        last = now;
    }
    assert_eq!(last, 0.0);
}

#[test]
fn an_update_after_the_release_is_counted_and_not_applied() {
    let mut master = master();
    master.apply(&update());
    push(&mut master, 1..=1, RELEASE);
    master.apply(&update());
    assert_eq!(
        (
            master.applied().iter().sum::<u64>(),
            master.updates_after_release()
        ),
        (1, 1)
    );
}

#[test]
fn both_sides_compute_with_the_rounded_hip() {
    let mut master = master();
    let hip = Vec2::new(-0.190_000_049_9, 0.0);
    master.tick(Time::from_millis(1), hip, Duration::ZERO);
    let met = master.model().history().newest().unwrap().hip;
    assert_eq!(met, HipCounts::nearest(hip).metres());
    assert_ne!(met, hip);
}

#[test]
fn a_hip_that_goes_back_with_the_box_does_not_move_the_hand_and_returns_clear_of_the_box() {
    let mut master = master();
    let state = welcome().state;
    let coupling = Coupling::for_stiffness(1000.0);
    let held = ModelParams::of_square(5.0, 3.0, 150.0, 0.4, &coupling).unwrap();
    let at = |x, answers_ms, sequence| Update {
        sequence,
        answers: Time::from_millis(answers_ms),
        state: ModelState::try_new(
            held,
            state.footprint(),
            Pose::new(x, 0.0, 0.0),
            Twist::default(),
            &coupling,
        )
        .unwrap(),
        ..update()
    };
    let hold = |master: &mut Master, ticks: std::ops::RangeInclusive<u64>, hand| {
        let tick = |n| master.tick(Time::from_millis(n), hand, Duration::ZERO);
        ticks.map(tick).last().unwrap()
    };
    let (pressing, away) = (Vec2::new(-0.196, 0.0), Vec2::new(-0.4, 0.0));
    hold(&mut master, 1..=20, pressing);
    master.apply(&at(0.0, 20, 1));
    let before = hold(&mut master, 21..=200, pressing);
    let given = master.port().energy_j();
    master.apply(&at(-0.03, 200, 2));
    let seen = master.view().pose.position;
    let after = hold(&mut master, 201..=400, pressing);
    let back = before.sample.hip.metres() - after.sample.hip.metres();
    assert!((back - Vec2::new(0.03, 0.0)).norm() < 1e-3, "{back:?}");
    assert!((after.hand_force - before.hand_force).norm() < 1e-3);
    let got = master.port().energy_j() - given;
    assert!(
        got.abs() < 1e-6,
        "the hand did no work and got none: {got} J"
    );
    let hand_sees = master.view().pose.position;
    assert!((hand_sees - seen).norm() < 1e-3, "{hand_sees:?}");

    let first = hold(&mut master, 401..=401, away).sample.hip.metres();
    assert!((first - away + back).norm() < 1e-3, "it is led, not thrown");
    let last = hold(&mut master, 402..=1100, away);
    assert!((last.sample.hip.metres() - away).norm() < 1e-6);
}
