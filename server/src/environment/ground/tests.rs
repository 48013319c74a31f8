//! Laws of the friction step.

use super::*;
use crate::environment::patch::POINTS;
use mmt_shared::params::{friction_torque_of_square, inertia_of_square};
use mmt_shared::rng::Substream;

const SIDE: f64 = 0.36;

fn load() -> Load {
    let c = 0.3 * 0.7 * 9.81;
    Load {
        m: 0.7,
        inertia: inertia_of_square(0.7, SIDE),
        b: 3.0,
        b_r: 3.0 * SIDE * SIDE / 6.0,
        c,
        e: friction_torque_of_square(c, SIDE),
        static_ratio: 1.0,
        centre_of_mass: Vec2::zeros(),
    }
}

fn square() -> Patch {
    let arm = friction_torque_of_square(1.0, SIDE);
    Patch::rectangle(SIDE, SIDE, arm, Vec2::zeros())
}

/// The velocity that a wrench gives in one period from rest.
fn free(load: &Load, wrench: Vector3<f64>) -> Vector3<f64> {
    wrench.component_div(&load.masses()) * TICK_S
}

fn random(stream: &mut Substream, scale: f64) -> Vector3<f64> {
    let mut draw = || stream.uniform_in(-1.0, 1.0) * scale;
    Vector3::new(draw(), draw(), draw() * 10.0)
}

/// The patch's support function at (v, omega) per c, with eps = 0.
fn support(patch: &Patch, d: &Vector3<f64>) -> f64 {
    let speed = |at: Vec2| {
        let (sx, sy) = (d.x - d.z * at.y, d.y + d.z * at.x);
        (sx * sx + sy * sy).sqrt()
    };
    let sum = patch
        .weighed()
        .map(|(at, weight)| weight * speed(at))
        .sum::<f64>();
    sum / POINTS as f64
}

/// Directions (v, omega) on a fine half sphere on which the ellipsoid's support is 1 per c.
fn directions(load: &Load, n: u32) -> impl Iterator<Item = Vector3<f64>> {
    let arm = load.e / load.c;
    let step = std::f64::consts::PI / f64::from(n);
    (0..=n).flat_map(move |i| {
        let (sin, cos) = libm::sincos(f64::from(i) * step);
        (0..2 * n).map(move |j| {
            let (y, x) = libm::sincos(f64::from(j) * step);
            Vector3::new(x * sin, y * sin, cos / arm)
        })
    })
}

#[test]
fn pure_spin_feels_9_exactly() {
    let load = load();
    let spin = support(&square(), &Vector3::z());
    assert!((spin * load.c / load.e - 1.0).abs() < 1e-12);
}

#[test]
fn the_ellipse_of_the_quick_stick_test_lies_inside_the_limit_surface() {
    let (patch, load) = (square(), load());
    let least = directions(&load, 180)
        .map(|d| support(&patch, &d))
        .fold(f64::MAX, f64::min);
    assert!(least > HELD && least < HELD + 0.02, "{least}");
}

#[test]
fn the_stick_test_agrees_with_the_limit_surface() {
    let (patch, load) = (square(), load());
    let ways: Vec<_> = directions(&load, 90)
        .map(|d| (d, support(&patch, &d) * load.c))
        .collect();
    let mut stream = Substream::new(7, "test/stick", 0);
    let (mut held, mut slid) = (0, 0);
    for _ in 0..400 {
        let mut wrench = random(&mut stream, 1.0);
        wrench.z *= load.e / load.c / 10.0;
        // scaled onto the limit surface, then a little inside and outside
        let at_limit = ways
            .iter()
            .map(|(d, h)| wrench.dot(d) / h)
            .fold(0.0, f64::max);
        for (share, sticks) in [(0.5, true), (0.998, true), (1.003, false), (2.0, false)] {
            let u = patch.step(
                &load,
                &Limits::default(),
                Vector3::zeros(),
                free(&load, wrench * (share / at_limit)),
            );
            assert_eq!(u == Vector3::zeros(), sticks, "{share} of {wrench}: {u}");
            held += u32::from(sticks);
            slid += u32::from(!sticks);
        }
    }
    assert_eq!((held, slid), (800, 800));
}

#[test]
fn sliding_velocities_solve_the_step_to_the_stated_tolerance() {
    let (patch, load) = (square(), load());
    let mut stream = Substream::new(8, "test/newton", 0);
    let mut slid = 0;
    for k in 0..2_000 {
        let scale = [3e-4, 3e-3, 0.03, 0.3, 3.0][k % 5];
        let star = random(&mut stream, scale);
        let u = patch.step(&load, &Limits::default(), Vector3::zeros(), star);
        if u == Vector3::zeros() {
            continue;
        }
        slid += 1;
        // stationary for the eps that was used
        let residual = (0..EPS_LEVELS as i32)
            .map(|level| EPS_M_PER_S * libm::pow(10.0, -f64::from(level)))
            .map(|eps| {
                let friction = patch.sums(&u, eps).gradient * load.c + load.dampings() * u;
                let left = (u - star).component_mul(&load.masses()) + friction * TICK_S;
                left.component_div(&load.masses())
                    .component_mul(&Vector3::new(1.0, 1.0, SIDE))
                    .norm()
            })
            .fold(f64::MAX, f64::min);
        assert!(residual < 1e-9, "{star}: {residual}");
    }
    assert!(slid > 1_000, "{slid}");
}

#[test]
fn friction_never_adds_energy_and_never_reverses() {
    let (patch, load) = (square(), load());
    let mut stream = Substream::new(9, "test/energy", 0);
    for k in 0..2_000 {
        let star = random(&mut stream, [1e-3, 0.01, 0.1, 1.0][k % 4]);
        let u = patch.step(&load, &Limits::default(), Vector3::zeros(), star);
        let energy = |u: &Vector3<f64>| u.component_mul(&load.masses()).dot(u);
        assert!(energy(&u) <= energy(&star));
        let push = Vector3::new(star.x, star.y, 0.0);
        assert!(
            patch
                .step(&load, &Limits::default(), Vector3::zeros(), push)
                .dot(&push)
                >= 0.0
        );
        let spin = Vector3::new(0.0, 0.0, star.z);
        assert!(
            patch
                .step(&load, &Limits::default(), Vector3::zeros(), spin)
                .dot(&spin)
                >= 0.0
        );
    }
}

#[test]
fn without_friction_only_damping_remains() {
    let load = Load {
        c: 0.0,
        e: 0.0,
        ..load()
    };
    let u = square().step(
        &load,
        &Limits::default(),
        Vector3::zeros(),
        Vector3::new(0.1, 0.0, 1.0),
    );
    assert!((u.x - 0.1 * 0.7 / 0.703).abs() < 1e-15);
    assert!(u.z < 1.0 && u.z > 0.99);
}

#[test]
fn the_stick_test_is_sharp_to_1e_4_of_the_limit() {
    let (patch, load) = (square(), load());
    for limit in [
        Vector3::new(load.c, 0.0, 0.0),
        Vector3::new(0.6 * load.c, -0.8 * load.c, 0.0),
        Vector3::new(0.0, 0.0, -load.e),
    ] {
        for (share, sticks) in [(0.9999, true), (1.0001, false)] {
            let u = patch.step(
                &load,
                &Limits::default(),
                Vector3::zeros(),
                free(&load, limit * share),
            );
            assert_eq!(u == Vector3::zeros(), sticks, "{share} of {limit}: {u}");
        }
    }
}
