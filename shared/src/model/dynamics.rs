//! One step of the box on the plane, as the local model computes it.
//!
//! Holds (5), (10) and (11) as printed, and the implicit step on the ellipsoidal limit surface that the
//! recommended mode uses instead. Both are semi-implicit in the pose: velocity first, then the pose with
//! the new velocity. It must never let ground friction reverse a velocity within an implicit step.

use crate::model::geometry::{Pose, Twist, Vec2, cross};
use crate::model::params::ModelParams;
use crate::model::settings::FrictionLaw;
use crate::time::TICK_S;

/// Regularisation of the limit surface, m/s: below it friction acts like viscous drag. The stick test
/// itself is exact.
const EPS: f64 = 1e-9;
/// Newton iterations on one scalar; three are typical, the bracket makes every one safe.
const ITERATIONS: u32 = 30;

/// Pose and velocity of the box.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// `world_from_object`.
    pub pose: Pose,
    /// Velocity of the centre and turning rate.
    pub twist: Twist,
}

impl Motion {
    /// The motion one sample period T later, under a force (N, world) that acts at `lever` from the
    /// centre (m, world).
    #[must_use]
    pub fn step(&self, law: FrictionLaw, params: &ModelParams, force: Vec2, lever: Vec2) -> Self {
        // (10)
        let moment = cross(lever, force);
        let twist = match law {
            FrictionLaw::Sign => sign_step(&self.twist, params, force, moment),
            FrictionLaw::LimitSurface => limit_surface_step(&self.twist, params, force, moment),
        };
        let pose = Pose {
            position: self.pose.position + twist.linear * TICK_S,
            angle: self.pose.angle + twist.angular * TICK_S,
        };
        Self { pose, twist }
    }

    /// Power (W, never negative) that the ground takes from this motion by friction and damping.
    #[must_use]
    pub fn dissipation(&self, law: FrictionLaw, params: &ModelParams) -> f64 {
        let speed2 = self.twist.linear.norm_squared();
        let friction = match law {
            FrictionLaw::Sign => params.c() * speed2.sqrt() + params.e() * self.twist.angular.abs(),
            FrictionLaw::LimitSurface => {
                let turning = params.e() * self.twist.angular;
                (params.c() * params.c() * speed2 + turning * turning).sqrt()
            }
        };
        friction + params.b() * speed2
    }
}

/// (5) and (11): explicit friction, decoupled. In the plane `sign(v)` is the direction v/|v|, which is
/// the only reading of the paper's scalar equation that does not depend on the choice of axes.
fn sign_step(twist: &Twist, params: &ModelParams, force: Vec2, moment: f64) -> Twist {
    let v = twist.linear;
    let speed = v.norm();
    let direction = if speed > 0.0 {
        v / speed
    } else {
        Vec2::zeros()
    };
    // (5), which is (1) solved for the acceleration
    let a = (force - v * params.b() - direction * params.c()) / params.m();
    // (11), which is (7) solved likewise; signum of a float is ±1 at zero, the equation's is 0
    let sign = if twist.angular == 0.0 {
        0.0
    } else {
        twist.angular.signum()
    };
    let alpha = (moment - params.e() * sign) / params.inertia();
    Twist {
        linear: v + a * TICK_S,
        angular: twist.angular + alpha * TICK_S,
    }
}

/// The minimiser u = (v, omega) of
/// `½ m|v−v*|² + ½ I (omega−omega*)² + T c sqrt(|v|² + (e/c)² omega² + eps²) + ½ T b |v|²`,
/// the implicit step with friction on the ellipsoid f_max = c, tau_max = e (Goyal 1991).
///
/// With s the root, v = v* m/(m + T b + T c/s) and omega = omega* I/(I + T e²/(c s)), so that one
/// scalar equation in s remains.
fn limit_surface_step(twist: &Twist, params: &ModelParams, force: Vec2, moment: f64) -> Twist {
    let (m, b, c, inertia, e) = (
        params.m(),
        params.b(),
        params.c(),
        params.inertia(),
        params.e(),
    );
    let free = Twist {
        linear: twist.linear + force * (TICK_S / m),
        angular: twist.angular + moment * (TICK_S / inertia),
    };
    let damped_mass = m + TICK_S * b;
    if c <= 0.0 {
        return Twist {
            linear: free.linear * (m / damped_mass),
            angular: free.angular,
        };
    }
    // Exact stick test: the impulse that would stop the body lies within the limit surface.
    let (p, l) = (m * free.linear.norm(), inertia * free.angular);
    let (p_max, l_max) = (TICK_S * c, TICK_S * e);
    let turning_share = if l == 0.0 { 0.0 } else { l / l_max };
    if (p / p_max) * (p / p_max) + turning_share * turning_share <= 1.0 {
        return Twist::default();
    }
    let radius = e / c;
    let speed_at = |s: f64| {
        let v = p / (damped_mass + p_max / s);
        let w = l / (inertia + TICK_S * e * radius / s);
        (v, w, (v * v + radius * radius * w * w + EPS * EPS).sqrt())
    };
    let s = root(
        |s| speed_at(s).2,
        (free.linear.norm_squared() + (radius * free.angular) * (radius * free.angular)).sqrt()
            + EPS,
    );
    let linear = free.linear * (m / (damped_mass + p_max / s));
    Twist {
        linear,
        angular: speed_at(s).1,
    }
}

/// The positive fixed point of an increasing, concave `map` that lies at or below `high`: secant steps
/// kept inside a bracket, to 1e-14 relative.
fn root(map: impl Fn(f64) -> f64, high: f64) -> f64 {
    let gap = |s: f64| map(s) - s;
    let (mut low, mut high) = (EPS, high);
    let (mut gap_low, mut gap_high) = (gap(low), gap(high));
    for _ in 0..ITERATIONS {
        if high - low <= 1e-14 * high || gap_high == 0.0 {
            break;
        }
        let secant = high - gap_high * (high - low) / (gap_high - gap_low);
        // concave: the secant never overshoots the root from below, the middle halves the rest
        let middle = 0.5 * (low + high);
        for s in [secant, middle] {
            if s > low && s < high {
                let g = gap(s);
                if g > 0.0 {
                    (low, gap_low) = (s, g);
                } else {
                    (high, gap_high) = (s, g);
                }
            }
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::contact::Coupling;

    const COUPLING: Coupling = Coupling {
        stiffness_n_per_m: 1000.0,
        damping_ns_per_m: 10.0,
    };

    fn params(b: f64) -> ModelParams {
        ModelParams::of_square(0.7, b, 2.06, 0.36, &COUPLING).unwrap()
    }

    fn energy(motion: &Motion, params: &ModelParams) -> f64 {
        0.5 * params.m() * motion.twist.linear.norm_squared()
            + 0.5 * params.inertia() * motion.twist.angular * motion.twist.angular
    }

    fn run(
        law: FrictionLaw,
        params: &ModelParams,
        start: Motion,
        force: Vec2,
        ticks: u32,
    ) -> Motion {
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
    fn dissipation_is_the_energy_that_a_coasting_step_loses() {
        let p = params(3.0);
        let motion = Motion {
            twist: Twist::new(0.3, 0.0, 2.0),
            ..Motion::default()
        };
        let next = motion.step(FrictionLaw::LimitSurface, &p, Vec2::zeros(), Vec2::zeros());
        let lost = energy(&motion, &p) - energy(&next, &p);
        let power = next.dissipation(FrictionLaw::LimitSurface, &p);
        assert!(
            (lost / (power * TICK_S) - 1.0).abs() < 0.02,
            "first order in T"
        );
        assert!(
            power * TICK_S <= lost,
            "what the tank is given has been dissipated"
        );
    }
}
