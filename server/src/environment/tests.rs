//! Laws of the environment.

use super::*;
use mmt_shared::model::geometry::rotate;
use mmt_shared::time::TICK_S;

mod bodies;
mod ground;
mod scenes;

fn default() -> Environment {
    Environment::try_new(EnvironmentConfig::default()).unwrap()
}

/// Pushes the west face off-centre at 0.15 m/s for the given ticks, then goes back.
fn pushed(environment: &mut Environment, ticks: u32) {
    for tick in 0..ticks {
        let x = -0.19 + 0.15e-3 * f64::from(tick);
        environment.step(Vec2::new(x, 0.03), Vec2::new(0.15, 0.0));
    }
}

fn bits(environment: &Environment) -> [u64; 6] {
    let (pose, twist) = (environment.pose(), environment.twist());
    [
        pose.position.x,
        pose.position.y,
        pose.angle,
        twist.linear.x,
        twist.linear.y,
        twist.angular,
    ]
    .map(f64::to_bits)
}

#[test]
fn a_body_at_rest_stays_bitwise_at_rest() {
    for angle in [0.0, 0.3, -2.0, 3.2, 17.0] {
        let mut environment = Environment::try_new(EnvironmentConfig {
            pose: Pose::new(0.1, -0.2, angle),
            ..EnvironmentConfig::default()
        })
        .unwrap();
        let before = bits(&environment);
        for _ in 0..1_000 {
            environment.step(Vec2::new(-1.0, 0.0), Vec2::zeros());
        }
        assert_eq!(bits(&environment), before);
    }
    // also where a push left it
    let mut environment = default();
    pushed(&mut environment, 1_000);
    assert!(environment.pose().angle.abs() > 0.01);
    for _ in 0..1_000 {
        environment.step(Vec2::new(-1.0, 0.0), Vec2::zeros());
    }
    let before = bits(&environment);
    for _ in 0..1_000 {
        environment.step(Vec2::new(-1.0, 0.0), Vec2::zeros());
    }
    assert_eq!(bits(&environment), before);
}

#[test]
fn energy_does_not_grow_without_a_force() {
    let mut environment = default();
    environment.set_twist(Twist::new(0.3, -0.2, 4.0));
    let mut energy = environment.kinetic_energy();
    while energy > 0.0 {
        environment.step_with_wrench(Vec2::zeros(), 0.0);
        assert!(environment.kinetic_energy() < energy);
        energy = environment.kinetic_energy();
    }
    assert_eq!(environment.twist(), Twist::default());
}

#[test]
fn two_runs_are_equal_to_the_bit() {
    let (mut one, mut two) = (default(), default());
    pushed(&mut one, 2_000);
    pushed(&mut two, 2_000);
    assert!(one.pose().position.x > 0.1);
    assert_eq!(bits(&one), bits(&two));
}

#[test]
fn rapier_moves_the_body_by_exactly_its_velocity() {
    let mut environment = default();
    environment.set_twist(Twist::new(0.3, -0.2, 4.0));
    for _ in 0..30 {
        let before = environment.pose();
        environment.step_with_wrench(Vec2::zeros(), 0.0);
        let (after, twist) = (environment.pose(), environment.twist());
        assert_eq!(after.position, before.position + twist.linear * TICK_S);
        let turn = twist.angular * TICK_S;
        assert!((after.angle - before.angle - turn).abs() < turn.abs().powi(3) / 3.0 + 1e-15);
    }
}

#[test]
fn the_angle_counts_whole_turns() {
    let mut environment = Environment::try_new(EnvironmentConfig {
        friction_coefficient: 0.0,
        damping_ns_per_m: 0.0,
        ..EnvironmentConfig::default()
    })
    .unwrap();
    environment.set_twist(Twist::new(0.0, 0.0, -9.0));
    for _ in 0..2_000 {
        environment.step_with_wrench(Vec2::zeros(), 0.0);
    }
    assert!((environment.pose().angle + 18.0).abs() < 1e-3);
}

#[test]
fn the_tool_pushes_with_6_and_meets_the_real_surface() {
    let mut environment = default();
    let contact = environment.step(Vec2::new(-0.179, 0.0), Vec2::zeros());
    assert!((contact.force.x - 1.0).abs() < 1e-9 && contact.force.y == 0.0);
    assert!((contact.touch.unwrap().proxy.x + 0.18).abs() < 1e-12);
    assert_eq!(environment.pose(), Pose::default(), "1 N is held by 2.06 N");
    let free = environment.step(Vec2::new(-0.3, 0.0), Vec2::zeros());
    assert_eq!(free, Contact::default());
}

#[test]
fn a_steady_push_is_answered_by_coulomb_and_damping() {
    let mut environment = default();
    let mut force = 0.0;
    for tick in 0..2_000 {
        let x = -0.181 + 0.15e-3 * f64::from(tick);
        force = environment
            .step(Vec2::new(x, 0.0), Vec2::new(0.15, 0.0))
            .force
            .x;
    }
    let expected = environment.truth().c() + environment.truth().b() * 0.15;
    assert!(
        (force / expected - 1.0).abs() < 1e-3,
        "{force} against {expected}"
    );
}

#[test]
fn friction_and_mass_change_in_mid_run() {
    let mut environment = default();
    environment.set_friction(0.45).unwrap();
    assert!((environment.truth().c() - 0.45 * 0.7 * 9.81).abs() < 1e-12);
    environment.set_mass(1.4).unwrap();
    assert!((environment.truth().c() - 0.45 * 1.4 * 9.81).abs() < 1e-12);
    assert!((environment.truth().inertia() - 1.4 * 0.36 * 0.36 / 6.0).abs() < 1e-12);
    let before = environment.truth();
    assert!(environment.set_mass(f64::NAN).is_err());
    assert!(environment.set_friction(-0.1).is_err());
    assert_eq!(environment.truth(), before);
}

#[test]
fn nothing_that_is_not_finite_gets_in() {
    let mut environment = default();
    pushed(&mut environment, 500);
    let bad = [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::MAX,
        -f64::MAX,
    ];
    for value in bad {
        environment.step(Vec2::new(value, 0.0), Vec2::zeros());
        environment.step(Vec2::zeros(), Vec2::new(0.0, value));
        environment.step_with_wrench(Vec2::new(value, value), 0.0);
        environment.step_with_wrench(Vec2::zeros(), value);
        environment.set_twist(Twist::new(value, 0.0, value));
    }
    assert_eq!(environment.refused(), 20);
    // absurd but finite: still bounded, still answering
    for _ in 0..100 {
        environment.step_with_wrench(Vec2::new(9e5, -9e5), 9e5);
    }
    let twist = environment.twist();
    assert!(environment.pose().is_finite() && twist.linear.norm() <= 10.000_001);
    assert!(twist.angular <= 100.0 && twist.angular > 0.0);
}

#[test]
fn a_wrong_configuration_is_named() {
    let wrong = |change: fn(&mut EnvironmentConfig)| {
        let mut config = EnvironmentConfig::default();
        change(&mut config);
        Environment::try_new(config).err().unwrap().to_string()
    };
    assert_eq!(
        wrong(|c| c.side_m = 0.0),
        "environment: side 0 is outside the accepted range 0.02 to 2 m"
    );
    assert!(wrong(|c| c.mass_kg = f64::NAN).contains("mass is not a finite number"));
    assert!(wrong(|c| c.friction_coefficient = -1.0).contains("friction coefficient -1"));
    assert!(wrong(|c| c.pose.angle = f64::INFINITY).contains("angle inf"));
    assert!(wrong(|c| c.coupling.stiffness_n_per_m = 1e9).contains("stiffness"));
    assert!(wrong(|c| c.rotational_damping_nms = Some(-1.0)).contains("rotational"));
}
