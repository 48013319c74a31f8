//! What turning takes from the push: the row of (1) for a contact off the object's centre.
//!
//! A tool that pushes beside the centre turns the object, so the contact point moves unlike the centre and
//! friction does not oppose the push alone. The turning acceleration is not measured, which would take the
//! second derivative of a noisy angle: it follows from the moment of the push, and m, b and c stay linear.
//! It must never change the row of a push through the centre of an object that does not turn.

use mmt_shared::model::geometry::{Vec2, cross};
use nalgebra::Vector3;

use super::filter::Row;
use super::measured::Seen;
use super::surface::SurfaceMotion;
use crate::square_friction::friction;

/// e/(c l) of the ellipse through the wrenches with which a slow tool pushes a square.
const CREEP_RADIUS: f64 = 0.30;

/// The row of a raw surface motion of an object that is where it is `seen` to be.
///
/// `normal` is the inward unit normal n, `speed` the smoothed v·n (m/s) that decides which way friction
/// acts. The centre obeys `m a_c·n + b v_c·n + c F = f`, turning `I alpha + b l²/6 omega + c M = d f` with F
/// and M of [`friction`], the lever d of the force about the centre and I = m l²/6. The contact point has
/// `v·n = v_c·n + omega d` and `a·n = a_c·n + alpha d − omega (2 v·t + omega h)`, with h from the face to the
/// centre, the tangent t, and v_c·t left out because nothing pushes that way. Without alpha that is
/// `m (a·n + omega (2 v·t + omega h)) + b v·n + c (F + 6 d/l² M) = (1 + 6 d²/l²) f`.
#[must_use]
pub(super) fn shared(motion: &SurfaceMotion, normal: Vec2, speed: f64, seen: &Seen) -> Row {
    let Seen {
        centre,
        turning: omega,
        body_turning: spin,
        side,
    } = *seen;
    let lever = motion.point - centre;
    let (d, h) = (cross(lever, normal), -lever.dot(&normal));
    let carried = omega * (2.0 * cross(normal, motion.velocity) + omega * h);
    let (force, torque) = friction(speed - omega * d, spin, side);
    let per_moment = 6.0 * d / (side * side);
    let raw = motion.row.regressor;
    let s = force + per_moment * torque;
    let scale = 1.0 / (1.0 + per_moment * d);
    Row {
        regressor: Vector3::new(raw.x + carried, raw.y, s) * scale,
        force: motion.row.force,
        scale,
    }
}

/// Lever about the centre of a push along `normal` at `point` (m), over the side.
fn lever_over_side(point: Vec2, normal: Vec2, seen: &Seen) -> f64 {
    cross(point - seen.centre, normal) / seen.side
}

/// Share of c that a slow push along `normal` at `point` (m) meets.
///
/// Without inertia the moment and the force on a square lie on its limit surface, so that f = c s with
/// `s = 1/sqrt(1 + (d/(0.30 l))²)`: 0.3 % off the square's for levers up to 0.14 l.
#[must_use]
pub(super) fn slow_share(point: Vec2, normal: Vec2, seen: &Seen) -> f64 {
    let d = lever_over_side(point, normal, seen);
    1.0 / (1.0 + d * d / (CREEP_RADIUS * CREEP_RADIUS)).sqrt()
}

/// The row of [`shared`] where the object moves too slowly for omega to be known: turning is what the lever makes it.
#[must_use]
pub(super) fn creeping(motion: &SurfaceMotion, normal: Vec2, seen: &Seen) -> Row {
    let d = lever_over_side(motion.point, normal, seen);
    let scale = 1.0 / (1.0 + 6.0 * d * d);
    let raw = motion.row.regressor;
    let s = slow_share(motion.point, normal, seen);
    Row {
        regressor: Vector3::new(raw.x * scale, raw.y * scale, s),
        force: motion.row.force,
        scale,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::{Estimator, EstimatorConfig, Measured, RecommendedConfig, ToolGives};
    use mmt_shared::fixtures::COUPLING;
    use mmt_shared::model::geometry::{Pose, Twist, rotate};
    use mmt_shared::rng::Substream;
    use mmt_shared::time::TICK_S;

    const SIDE: f64 = 0.36;
    const TRUTH: [f64; 3] = [0.7, 3.0, 2.06];
    /// A box on a ground of 16 × 16 places, pushed by a tool that moves along x.
    struct Box {
        pose: Pose,
        twist: Twist,
        penetration: f64,
    }

    impl Box {
        fn at_rest() -> Self {
            Self {
                pose: Pose::default(),
                twist: Twist::default(),
                penetration: 0.0,
            }
        }

        /// Mean direction of sliding over the places, and its moment.
        fn friction(&self) -> (Vec2, f64) {
            let place = |k: u32| ((f64::from(k) + 0.5) / 16.0 - 0.5) * SIDE;
            let (mut force, mut torque) = (Vec2::zeros(), 0.0);
            for k in 0..256 {
                let r = rotate(self.pose.angle, Vec2::new(place(k % 16), place(k / 16)));
                let v = self.twist.velocity_at(r);
                let pull = v / (v.norm().max(1e-9) * 256.0);
                force += pull;
                torque += cross(r, pull);
            }
            (force, torque)
        }

        /// One tick of semi-implicit Euler.
        fn push(&mut self, tool: Vec2) -> Measured {
            let [m, b, c] = TRUTH;
            let normal = rotate(self.pose.angle, Vec2::new(1.0, 0.0));
            let penetration = (tool - self.pose.position).dot(&normal) + SIDE / 2.0;
            let rate = (penetration - self.penetration) / TICK_S;
            self.penetration = penetration;
            let push = normal * COUPLING.force(penetration, rate);
            let lever = tool - normal * penetration - self.pose.position;
            let seen = Seen {
                centre: self.pose.position,
                turning: self.twist.angular,
                body_turning: self.twist.angular,
                side: SIDE,
            };
            let (pull, torque) = self.friction();
            let inertia = m * SIDE * SIDE / 6.0;
            let moment = cross(lever, push) - c * torque;
            // damping implicit: b v of (1) is that of the new velocity
            self.twist.linear += (push - pull * c) * (TICK_S / m);
            self.twist.angular += moment * (TICK_S / inertia);
            // b/m = (b l²/6)/I
            self.twist.linear /= 1.0 + TICK_S * b / m;
            self.twist.angular /= 1.0 + TICK_S * b / m;
            self.pose.position += self.twist.linear * TICK_S;
            self.pose.angle += self.twist.angular * TICK_S;
            Measured {
                back: Vec2::zeros(),
                force_noise_n: 0.0,
                held_back: false,
                tool,
                force: push,
                normal: Some(normal),
                seen: Some(seen),
            }
        }
    }

    /// Pushes a box at rest for 2 s, `aside` m from its centre, and hands each tick on; the fastest turning, rad/s.
    fn push_for_2_s(aside: f64, mut take: impl FnMut(Measured)) -> f64 {
        let mut pushed = Box::at_rest();
        let (mut tool, mut turned) = (Vec2::new(-SIDE / 2.0, aside), 0.0_f64);
        for k in 0..2000 {
            let t = f64::from(k) * TICK_S;
            let modulation = 1.0 + 0.3 * libm::sin(5.0 * t) + 0.12 * libm::sin(14.0 * t);
            tool.x += 0.15 * modulation * (t / 0.3).min(1.0) * TICK_S;
            take(pushed.push(tool));
            turned = turned.max(pushed.twist.angular.abs());
        }
        turned
    }

    /// Largest relative error of m, b and c after a noise-free push of 2 s, `aside` m from the centre.
    fn worst_error(aside: f64, is_seen: bool) -> f64 {
        let mut config = RecommendedConfig::new(COUPLING);
        config.position_noise_m = 0.0;
        let mut estimator = Estimator::new(
            &EstimatorConfig::Recommended(config),
            COUPLING,
            8.0,
            ToolGives::No,
        );
        let turned = push_for_2_s(aside, |mut measured| {
            measured.seen = measured.seen.filter(|_| is_seen);
            estimator.step(&measured);
        });
        assert!(estimator.estimate().excited);
        assert!(aside == 0.0 || turned > 0.15, "{turned}");
        let e = estimator.estimate();
        let ratios = [e.m / TRUTH[0], e.b / TRUTH[1], e.c / TRUTH[2]];
        ratios
            .into_iter()
            .map(|r| (r - 1.0).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn exact_data_of_a_box_that_turns_give_the_parameters() {
        let straight = worst_error(0.0, true);
        println!("through the centre: {straight:e}");
        assert!(straight < 1e-6);
        // what is left out (v_c·t) and taken in finite steps shows as the lever grows
        for (aside, most) in [(0.02, 1e-3), (-0.04, 4e-3)] {
            let (seen, unseen) = (worst_error(aside, true), worst_error(aside, false));
            println!("{aside} m aside: {seen:.5}, without turning {unseen:.5}");
            assert!(seen < most && unseen > 10.0 * seen);
        }
    }

    /// m over the true one, in the mean over forty pushes of 2 s `aside` m from the centre, with white noise of the force per axis, N.
    fn mass_with_noise(aside: f64, noise_n: f64) -> f64 {
        const PUSHES: u32 = 40;
        let masses = (0..PUSHES).map(|push| {
            let mut noise = Substream::new(1, "force noise", u64::from(push));
            let config = EstimatorConfig::Recommended(RecommendedConfig::new(COUPLING));
            let mut estimator = Estimator::new(&config, COUPLING, 8.0, ToolGives::No);
            push_for_2_s(aside, |mut measured| {
                let (x, y) = noise.normal_pair();
                measured.force += Vec2::new(x, y) * noise_n;
                measured.force_noise_n = noise_n;
                estimator.step(&measured);
            });
            estimator.estimate().m / TRUTH[0]
        });
        masses.sum::<f64>() / f64::from(PUSHES)
    }

    #[test]
    fn noise_makes_the_mass_no_heavier_beside_the_centre() {
        for aside in [0.0, 0.04, 0.08, 0.12] {
            let (noisy, quiet) = (mass_with_noise(aside, 0.1), mass_with_noise(aside, 0.0));
            println!("{aside} m aside: m {noisy:.4} with noise, {quiet:.4} without");
            assert!(
                (noisy - quiet).abs() < 0.005,
                "{aside} m aside: {noisy}, {quiet}"
            );
        }
    }

    fn motion(velocity: Vec2) -> SurfaceMotion {
        SurfaceMotion {
            point: Vec2::new(-SIDE / 2.0, 0.0),
            velocity,
            row: Row {
                regressor: Vector3::new(0.4, 0.1, 0.0),
                force: 2.5,
                scale: 1.0,
            },
        }
    }

    #[test]
    fn a_push_through_the_centre_without_turning_keeps_its_row() {
        let seen = Seen {
            centre: Vec2::zeros(),
            turning: 0.0,
            body_turning: 0.0,
            side: SIDE,
        };
        let (x, raw) = (Vec2::new(1.0, 0.0), motion(Vec2::new(0.1, 0.05)));
        for row in [shared(&raw, x, 0.1, &seen), creeping(&raw, x, &seen)] {
            assert_eq!(row, raw.row.pushed());
        }
        assert_eq!(shared(&raw, x, -0.1, &seen).regressor.z, -1.0);
    }

    #[test]
    fn a_slow_push_meets_the_friction_that_moment_and_force_balance() {
        for omega in [0.005, 0.015, 0.025] {
            // a centre that slides at 10 mm/s and turns at omega is pushed at the lever torque/force
            let (force, torque) = friction(0.010, omega, SIDE);
            let seen = Seen {
                centre: Vec2::new(0.0, torque / force),
                turning: 0.0,
                body_turning: 0.0,
                side: SIDE,
            };
            let row = creeping(&motion(Vec2::zeros()), Vec2::new(1.0, 0.0), &seen);
            let s = row.regressor.z;
            assert!((s / force - 1.0).abs() < 0.01, "{omega}: {s} {force}");
        }
    }

    #[test]
    fn an_object_seen_nowhere_is_not_used() {
        let good = Seen {
            centre: Vec2::zeros(),
            turning: 0.1,
            body_turning: 0.1,
            side: SIDE,
        };
        assert!(good.is_usable());
        let nowhere = Vec2::new(f64::NAN, 0.0);
        for bad in [
            Seen {
                centre: nowhere,
                ..good
            },
            Seen {
                turning: f64::INFINITY,
                ..good
            },
            Seen { side: 0.0, ..good },
        ] {
            assert!(!bad.is_usable());
        }
    }
}
