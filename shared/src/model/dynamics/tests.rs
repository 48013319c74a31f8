//! The promises of `dynamics`.

use super::*;
use crate::fixtures::COUPLING;
use crate::rng::Substream;

fn params(b: f64) -> ModelParams {
    ModelParams::of_square(0.7, b, 2.06, 0.36, &COUPLING).unwrap()
}

fn energy(motion: &Motion, params: &ModelParams) -> f64 {
    0.5 * params.m() * motion.twist.linear.norm_squared()
        + 0.5 * params.inertia() * motion.twist.angular * motion.twist.angular
}

fn run(law: FrictionLaw, params: &ModelParams, start: Motion, force: Vec2, ticks: u32) -> Motion {
    (0..ticks).fold(start, |motion, _| {
        motion.step(law, params, force, Vec2::zeros())
    })
}

#[test]
fn equation_5_by_hand_for_two_steps() {
    // m 0.7, b 3, c 2.06, f 4 in x: a1 = 4/0.7 (sign(0) = 0), then with v1 = a1 T
    let p = params(3.0);
    let one = run(
        FrictionLaw::Sign,
        &p,
        Motion::default(),
        Vec2::new(4.0, 0.0),
        1,
    );
    let v1 = 4.0 / 0.7 * 1e-3;
    assert!((one.twist.linear.x - v1).abs() < 1e-15);
    assert!((one.pose.position.x - v1 * 1e-3).abs() < 1e-15);
    let two = run(FrictionLaw::Sign, &p, one, Vec2::new(4.0, 0.0), 1);
    let v2 = v1 + (4.0 - 3.0 * v1 - 2.06) / 0.7 * 1e-3;
    assert!((two.twist.linear.x - v2).abs() < 1e-15);
}

#[test]
fn equations_10_and_11_turn_the_box_by_the_moment_less_friction() {
    let p = params(0.0);
    let start = Motion {
        twist: Twist::new(0.0, 0.0, 1.0),
        ..Motion::default()
    };
    // f = 4 in x at d = (0, -0.1): M = 0·0 − (−0.1)·4 = 0.4
    let next = start.step(
        FrictionLaw::Sign,
        &p,
        Vec2::new(4.0, 0.0),
        Vec2::new(0.0, -0.1),
    );
    let alpha = (0.4 - p.e()) / p.inertia();
    assert!((next.twist.angular - (1.0 + alpha * 1e-3)).abs() < 1e-12);
}

#[test]
fn sign_friction_cannot_hold_and_the_implicit_step_can() {
    let p = params(0.0);
    let half = Vec2::new(0.5 * p.c(), 0.0);
    let literal = run(FrictionLaw::Sign, &p, Motion::default(), half, 1000);
    assert!(literal.pose.position.x > 1e-6, "the effect exists");
    let implicit = run(FrictionLaw::LimitSurface, &p, Motion::default(), half, 1000);
    assert_eq!(
        implicit,
        Motion::default(),
        "a body at rest stays bitwise at rest"
    );
}

#[test]
fn implicit_friction_never_reverses_and_energy_never_grows() {
    let p = params(3.0);
    let mut motion = Motion {
        twist: Twist::new(0.3, -0.1, 4.0),
        ..Motion::default()
    };
    let mut last = energy(&motion, &p);
    for _ in 0..2000 {
        let next = motion.step(FrictionLaw::LimitSurface, &p, Vec2::zeros(), Vec2::zeros());
        assert!(next.twist.linear.dot(&motion.twist.linear) >= 0.0);
        assert!(next.twist.angular * motion.twist.angular >= 0.0);
        let now = energy(&next, &p);
        assert!(now <= last);
        (motion, last) = (next, now);
    }
    assert_eq!(motion.twist, Twist::default(), "it comes to rest exactly");
}

#[test]
fn straight_push_follows_the_closed_form() {
    // implicit Euler of m v' = f − c − b v from rest: v_n exact by its own recursion
    let p = params(3.0);
    let (f, mut v) = (4.0, 0.0);
    let motion = run(
        FrictionLaw::LimitSurface,
        &p,
        Motion::default(),
        Vec2::new(f, 0.0),
        500,
    );
    for _ in 0..500 {
        v = (v + (f - p.c()) * 1e-3 / p.m()) / (1.0 + p.b() * 1e-3 / p.m());
    }
    assert!(
        (motion.twist.linear.x - v).abs() < 1e-9,
        "{} {v}",
        motion.twist.linear.x
    );
}

#[test]
fn the_step_minimises_its_own_functional() {
    let p = params(3.0);
    let before = Twist::new(0.05, -0.02, 0.8);
    let (force, moment) = (Vec2::new(1.0, 2.0), 0.1);
    let free = Twist {
        linear: before.linear + force * (TICK_S / p.m()),
        angular: before.angular + moment * (TICK_S / p.inertia()),
    };
    let cost = |u: &Twist| {
        let r = p.e() / p.c();
        let root = (u.linear.norm_squared() + r * r * u.angular * u.angular).sqrt();
        0.5 * p.m() * (u.linear - free.linear).norm_squared()
            + 0.5 * p.inertia() * (u.angular - free.angular).powi(2)
            + TICK_S * p.c() * root
            + 0.5 * TICK_S * p.b() * u.linear.norm_squared()
    };
    let best = limit_surface_step(&before, &p, force, moment);
    for d in [1e-4, -1e-4] {
        for shift in [
            Twist::new(d, 0.0, 0.0),
            Twist::new(0.0, d, 0.0),
            Twist::new(0.0, 0.0, d),
        ] {
            let other = Twist {
                linear: best.linear + shift.linear,
                angular: best.angular + shift.angular,
            };
            assert!(cost(&other) > cost(&best));
        }
    }
}

#[test]
fn sliding_weakens_the_resistance_to_turning() {
    // coupling: a sliding body is turned by a moment that a resting body holds
    let p = params(0.0);
    let moment_arm = Vec2::new(0.0, -0.5 * p.e() / 1.0);
    let push = Vec2::new(1.0, 0.0);
    let rest = Motion::default().step(FrictionLaw::LimitSurface, &p, push, moment_arm);
    assert_eq!(rest.twist, Twist::default());
    let sliding = Motion {
        twist: Twist::new(0.2, 0.0, 0.0),
        ..Motion::default()
    };
    let turned = sliding.step(FrictionLaw::LimitSurface, &p, push, moment_arm);
    assert!(turned.twist.angular > 0.0);
}

#[test]
fn what_a_step_loses_besides_what_was_pushed_in_is_at_least_its_dissipation() {
    let mut draw = Substream::new(1, "test/dissipation", 0);
    for law in [FrictionLaw::Sign, FrictionLaw::LimitSurface] {
        for _ in 0..20_000 {
            // fast, slow, and so slow that (5) reverses it
            let size = libm::exp10(draw.uniform_in(-6.0, 0.0));
            let mut part = || draw.uniform_in(-size, size);
            let twist = Twist::new(part(), part(), 5.0 * part());
            let (m, b, c) = (
                draw.uniform_in(0.2, 5.0),
                draw.uniform_in(0.0, 10.0),
                draw.uniform_in(0.0, 6.0),
            );
            let p = ModelParams::of_square(m, b, c, 0.36, &COUPLING).unwrap();
            let force = Vec2::new(draw.uniform_in(-3.0, 3.0), draw.uniform_in(-3.0, 3.0));
            let lever = Vec2::new(draw.uniform_in(-0.2, 0.2), 0.18);
            let before = Motion {
                twist,
                ..Motion::default()
            };
            let after = before.step(law, &p, force, lever);
            let (linear, angular) = match law {
                // explicit: the step goes at the mean of both velocities
                FrictionLaw::Sign => (
                    0.5 * (twist.linear + after.twist.linear),
                    0.5 * (twist.angular + after.twist.angular),
                ),
                FrictionLaw::LimitSurface => (after.twist.linear, after.twist.angular),
            };
            let pushed = force.dot(&linear) + cross(lever, force) * angular;
            let lost = energy(&before, &p) + pushed * TICK_S - energy(&after, &p);
            let taken = after.dissipation(law, &p, &twist) * TICK_S;
            assert!(
                taken <= lost + 1e-12,
                "{law:?} {twist:?}: {taken} J of {lost} J"
            );
            assert!(
                law == FrictionLaw::LimitSurface || taken >= lost - 1e-12,
                "{twist:?}: {taken} J of {lost} J"
            );
        }
    }
}

#[test]
fn a_box_that_stands_dissipates_nothing_under_either_law() {
    for (law, m, c) in [
        (FrictionLaw::Sign, 0.7, 2.06),
        (FrictionLaw::Sign, 0.2, 6.0),
        (FrictionLaw::LimitSurface, 0.2, 6.0),
    ] {
        let p = ModelParams::of_square(m, 3.0, c, 0.36, &COUPLING).unwrap();
        let push = Vec2::new(c + 0.5, 0.0);
        let mut motion = run(law, &p, Motion::default(), push, 1);
        let mut taken = 0.0;
        for tick in 0..10_000 {
            let after = motion.step(law, &p, Vec2::zeros(), Vec2::zeros());
            if tick >= 1000 {
                taken += after.dissipation(law, &p, &motion.twist) * TICK_S;
            }
            motion = after;
        }
        // explicit friction makes it tremble: it takes and gives back what that holds
        assert!(taken.abs() < 1e-4, "{law:?}: {taken} J in 9 s");
    }
}

#[test]
fn dissipation_is_the_energy_that_a_coasting_step_loses() {
    let p = params(3.0);
    let motion = Motion {
        twist: Twist::new(0.3, 0.0, 2.0),
        ..Motion::default()
    };
    let next = motion.step(FrictionLaw::LimitSurface, &p, Vec2::zeros(), Vec2::zeros());
    let lost = energy(&motion, &p) - energy(&next, &p);
    let power = next.dissipation(FrictionLaw::LimitSurface, &p, &motion.twist);
    assert!(
        (lost / (power * TICK_S) - 1.0).abs() < 0.02,
        "first order in T"
    );
    assert!(
        power * TICK_S <= lost,
        "what the tank is given has been dissipated"
    );
}
