//! The environment against motions whose outcome is known: in closed form, or from a much finer patch.
//!
//! mu = 0.3, b = 0, l = 0.36 m, m = 0.7 kg, g = 9.81 m/s², e by (9); wrenches fixed in the world.

#![allow(clippy::unwrap_used, reason = "tests may panic")]

use mmt_server::environment::{Environment, EnvironmentConfig};
use mmt_shared::model::geometry::{Pose, Twist, Vec2};

/// c = mu m g, N.
const C: f64 = 0.3 * 0.7 * 9.81;

fn reference() -> EnvironmentConfig {
    EnvironmentConfig {
        damping_ns_per_m: 0.0,
        ..EnvironmentConfig::default()
    }
}

fn with_twist(twist: Twist) -> Environment {
    let mut environment = Environment::try_new(reference()).unwrap();
    environment.set_twist(twist);
    environment
}

/// Where a wrench of some duration leaves the object.
fn pushed(config: EnvironmentConfig, force: Vec2, torque: f64, millis: usize) -> Pose {
    let mut environment = Environment::try_new(config).unwrap();
    for _ in 0..millis {
        environment.step_with_wrench(force, torque);
    }
    environment.pose()
}

/// Coasts to rest; returns the seconds that it took.
fn coast(environment: &mut Environment) -> f64 {
    let mut millis = 0_u32;
    while environment.twist() != Twist::default() {
        environment.step_with_wrench(Vec2::zeros(), 0.0);
        millis += 1;
        assert!(millis < 10_000, "never comes to rest");
    }
    f64::from(millis) * 1e-3
}

#[track_caller]
fn assert_within_1_5_percent(what: &str, got: f64, want: f64) {
    let error = 100.0 * (got / want - 1.0);
    assert!(error.abs() < 1.5, "{what}: {got} is {error} % off {want}");
}

#[test]
fn a_push_of_4_n_for_half_a_second_moves_as_far_as_by_newtons_law() {
    let pose = pushed(reference(), Vec2::new(4.0, 0.0), 0.0, 500);
    assert_within_1_5_percent("push", pose.position.x, 0.34641);
    assert!(pose.position.y.abs() < 1e-12 && pose.angle.abs() < 1e-12);
}

#[test]
fn the_same_push_at_45_degrees_moves_as_far() {
    let force = Vec2::new(8.0_f64.sqrt(), 8.0_f64.sqrt());
    let pose = pushed(reference(), force, 0.0, 500);
    assert_within_1_5_percent("push at 45 degrees", pose.position.norm(), 0.34641);
}

#[test]
fn friction_is_the_same_in_every_direction() {
    let reach = |degrees: f64| {
        let (sin, cos) = libm::sincos(degrees.to_radians());
        let pose = pushed(reference(), Vec2::new(4.0 * cos, 4.0 * sin), 0.0, 500);
        let along = pose.position.x * cos + pose.position.y * sin;
        let across = pose.position.y * cos - pose.position.x * sin;
        assert!(across.abs() < 1e-3 * along, "drifts sideways by {across} m");
        along
    };
    let straight = reach(0.0);
    for degrees in [10.0, 22.5, 35.0, 45.0, 90.0] {
        let deviation = reach(degrees) / straight - 1.0;
        assert!(deviation.abs() < 1e-3, "{degrees} degrees: {deviation}");
    }
}

#[test]
fn a_stop_from_half_a_metre_per_second_slides_as_far_as_by_coulombs_law() {
    let mut environment = with_twist(Twist::new(0.5, 0.0, 0.0));
    coast(&mut environment);
    assert_within_1_5_percent("stop", environment.pose().position.x, 0.04247);
}

#[test]
fn a_spin_of_5_rad_per_second_dies_when_9_predicts() {
    let mut environment = with_twist(Twist::new(0.0, 0.0, 5.0));
    let seconds = coast(&mut environment);
    assert_within_1_5_percent("spin-down", seconds, 0.2664);
}

#[test]
fn a_turning_coast_ends_where_the_fine_patch_ends() {
    let mut environment = with_twist(Twist::new(0.3, 0.0, 3.0));
    coast(&mut environment);
    assert_within_1_5_percent("coast x", environment.pose().position.x, 0.03074);
    assert_within_1_5_percent("coast theta", environment.pose().angle, 0.29449);
}

#[test]
fn an_off_centre_wrench_turns_the_body_as_the_fine_patch_does() {
    let pose = pushed(reference(), Vec2::new(3.0, 0.0), -0.18, 400);
    assert_within_1_5_percent("wrench x", pose.position.x, 0.12747);
    assert_within_1_5_percent("wrench theta", pose.angle, -0.46979);
}

#[test]
fn static_friction_holds_half_and_nine_tenths_of_its_limit_for_ten_seconds() {
    for share in [0.5, 0.9] {
        let pose = pushed(reference(), Vec2::new(share * C, 0.0), 0.0, 10_000);
        assert!(pose.position.norm() < 1e-6, "{share} c moves it");
    }
    // and lets go just beyond
    let pose = pushed(reference(), Vec2::new(1.01 * C, 0.0), 0.0, 1_000);
    assert!(pose.position.x > 5e-3, "1.01 c does not move it");
}

#[test]
fn a_push_differs_from_newton_by_the_half_period_of_the_step_and_no_more() {
    // semi-implicit Euler overshoots ½ a t² by ½ a t T; eps takes a little of the first step
    let (a, t) = (4.0 / 0.7 - 0.3 * 9.81, 0.5);
    let x = pushed(reference(), Vec2::new(4.0, 0.0), 0.0, 500)
        .position
        .x;
    let exact = 0.5 * a * t * (t + 1e-3);
    assert!((x / exact - 1.0).abs() < 1e-5, "{x} against {exact}");
}

#[test]
fn a_held_oblique_wrench_does_not_creep() {
    // 0.6 c and 0.6 e together are inside the limit surface; 0.85 of both are outside
    let e = 0.382_598 * C * 0.36;
    let force = |share: f64| Vec2::new(0.6 * share * C, -0.8 * share * C);
    let pose = pushed(reference(), force(0.6), 0.6 * e, 10_000);
    assert_eq!(pose, Pose::default());
    let pose = pushed(reference(), force(0.85), 0.85 * e, 1_000);
    assert!(pose.position.norm() > 0.01 && pose.angle > 0.01, "{pose:?}");
}
