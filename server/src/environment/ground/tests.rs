//! Laws of the friction step.

use super::*;
use crate::environment::patch::POINTS;
use mmt_shared::model::params::{friction_torque_of_square, inertia_of_square};
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
    let disc = Patch::disc(SIDE / 2.0, SIDE / 3.0, Vec2::zeros());
    let disc_load = Load {
        e: load().c * SIDE / 3.0,
        ..load()
    };
    for (patch, load) in [(square(), load()), (disc, disc_load)] {
        assert!(patch.round && patch.even);
        let least = directions(&load, 180)
            .map(|d| support(&patch, &d))
            .fold(f64::MAX, f64::min);
        assert!(least > HELD && least < HELD + 0.05, "{least}");
    }
}

/// Every kind of patch: even and uneven, centred and not.
fn patches() -> [Patch; 4] {
    let triangle = [(-0.12, -0.1), (0.24, -0.1), (-0.12, 0.2)].map(|(x, y)| Vec2::new(x, y));
    let triangle = Patch::polygon(&triangle, 0.11, Vec2::new(0.02, 0.01));
    let brick = Patch::rectangle(0.5, 0.2, 0.145, Vec2::zeros());
    let mut uneven = square();
    uneven.weigh(|at| if at.x > 0.0 { 1.6 } else { 0.5 + at.y });
    [square(), brick, triangle, uneven]
}

#[test]
fn the_stick_test_agrees_with_the_limit_surface() {
    for patch in patches() {
        let load = Load {
            e: load().c * patch.hold.arm,
            ..load()
        };
        let ways: Vec<_> = directions(&load, 90)
            .map(|d| (d, support(&patch, &d) * load.c))
            .collect();
        let mut stream = Substream::new(7, "test/stick", 0);
        for _ in 0..200 {
            let mut wrench = random(&mut stream, 1.0);
            wrench.z *= load.e / load.c / 10.0;
            // scaled onto the limit surface, then a little inside and outside
            let at_limit = ways
                .iter()
                .map(|(d, h)| wrench.dot(d) / h)
                .fold(0.0, f64::max);
            for (share, sticks) in [(0.5, true), (0.997, true), (1.003, false), (2.0, false)] {
                let free = free(&load, wrench * (share / at_limit));
                let u = patch.step(&load, Vector3::zeros(), free);
                assert_eq!(u == Vector3::zeros(), sticks, "{share} of {wrench}: {u}");
            }
        }
    }
}

#[test]
fn an_uneven_patch_answers_a_push_at_its_centre_of_friction() {
    let [.., triangle, uneven] = patches();
    assert!(
        (triangle.hold.force - 1.0).abs() < 1e-12,
        "the cells make up the area"
    );
    assert!((triangle.hold.centre + Vec2::new(0.02, 0.01)).norm() < 1e-12);
    assert!((triangle.hold.arm / 0.11 - 1.0).abs() < 1e-12);
    assert!((uneven.hold.force - 1.05).abs() < 1e-12);
    assert!(uneven.hold.centre.x > 0.04 && uneven.hold.drift.norm() > 1e-3);
    let load = load();
    for (patch, c) in [(triangle, load.c), (uneven, 1.05 * load.c)] {
        let centre = patch.hold.centre;
        for degrees in [0.0_f64, 70.0, 200.0] {
            let (y, x) = libm::sincos(degrees.to_radians());
            let push = Vector3::new(x, y, cross(centre, Vec2::new(x, y))) * c;
            let held = |share: f64| {
                let free = free(&load, push * share);
                patch.step(&load, Vector3::zeros(), free) == Vector3::zeros()
            };
            assert!(held(0.9999) && !held(1.0001), "{degrees}");
        }
    }
}

#[test]
fn sliding_velocities_solve_the_step_to_the_stated_tolerance() {
    let (patch, load) = (square(), load());
    let mut stream = Substream::new(8, "test/newton", 0);
    let mut slid = 0;
    for k in 0..2_000 {
        let scale = [3e-4, 3e-3, 0.03, 0.3, 3.0][k % 5];
        let star = random(&mut stream, scale);
        let u = patch.step(&load, Vector3::zeros(), star);
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
    let load = load();
    let mut stream = Substream::new(9, "test/energy", 0);
    let patches = patches();
    for k in 0..2_000 {
        let patch = &patches[k / 4 % 4];
        let star = random(&mut stream, [1e-3, 0.01, 0.1, 1.0][k % 4]);
        let u = patch.step(&load, Vector3::zeros(), star);
        let energy = |u: &Vector3<f64>| u.component_mul(&load.masses()).dot(u);
        assert!(energy(&u) <= energy(&star));
        if patch.hold.centre != Vec2::zeros() {
            continue;
        }
        let push = Vector3::new(star.x, star.y, 0.0);
        assert!(patch.step(&load, Vector3::zeros(), push).dot(&push) >= 0.0);
        let spin = Vector3::new(0.0, 0.0, star.z);
        assert!(patch.step(&load, Vector3::zeros(), spin).dot(&spin) >= 0.0);
    }
}

#[test]
fn without_friction_only_damping_remains() {
    let load = Load {
        c: 0.0,
        e: 0.0,
        ..load()
    };
    let u = square().step(&load, Vector3::zeros(), Vector3::new(0.1, 0.0, 1.0));
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
            let u = patch.step(&load, Vector3::zeros(), free(&load, limit * share));
            assert_eq!(u == Vector3::zeros(), sticks, "{share} of {limit}: {u}");
        }
    }
}
