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
/// Less Coulomb friction than this, N, is none: what divides by it stays far from the ends of f64.
const FRICTION_LEAST_N: f64 = 1e-9;
/// Explicit friction that changes a velocity (m/s) or a turning rate (rad/s) by more than this in a tick does not reverse
/// it: so much would throw the body to and fro. Bodies under their own weight stay far below.
const EXPLICIT_MOST: (f64, f64) = (0.1, 1.0);
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

    /// Power (W) that the ground took by friction and damping in the step to this motion, from the velocity `before` it. An
    /// implicit step takes at least this from the energy. The explicit one takes just this, at the mean of both velocities: less than
    /// nothing where (5) and (11) drive the box, which they do where they reverse it.
    pub fn dissipation(&self, law: FrictionLaw, params: &ModelParams, before: &Twist) -> f64 {
        let Twist { linear, angular } = self.twist;
        match law {
            FrictionLaw::Sign => {
                let (friction, moment) = sign_friction(before, params);
                let shift = (friction + before.linear * params.b()).dot(&(before.linear + linear));
                0.5 * (shift + moment * (before.angular + angular))
            }
            FrictionLaw::LimitSurface => {
                let (speed2, turning) = (linear.norm_squared(), params.e() * angular);
                let friction = (params.c() * params.c() * speed2 + turning * turning).sqrt();
                friction + params.b() * speed2
            }
        }
    }
}

/// (5) and (11): explicit friction, decoupled.
fn sign_step(twist: &Twist, params: &ModelParams, force: Vec2, moment: f64) -> Twist {
    let (friction, turning) = sign_friction(twist, params);
    // (5), which is (1) solved for the acceleration
    let a = (force - twist.linear * params.b() - friction) / params.m();
    // (11), which is (7) solved likewise
    let alpha = (moment - turning) / params.inertia();
    Twist {
        linear: twist.linear + a * TICK_S,
        angular: twist.angular + alpha * TICK_S,
    }
}

/// c sign(v) (N) and e sign(omega) (N m). In the plane `sign(v)` is the direction v/|v|, which is the only reading of the
/// paper's scalar equation that does not depend on the choice of axes.
fn sign_friction(twist: &Twist, params: &ModelParams) -> (Vec2, f64) {
    let v = twist.linear;
    let speed = v.norm();
    let direction = if speed > 0.0 {
        v / speed
    } else {
        Vec2::zeros()
    };
    let c = explicit(params.c(), params.m(), speed, EXPLICIT_MOST.0);
    // signum of a float is ±1 at zero, the equation's is 0
    let sign = if twist.angular == 0.0 {
        0.0
    } else {
        twist.angular.signum()
    };
    let rate = twist.angular.abs();
    let e = explicit(params.e(), params.inertia(), rate, EXPLICIT_MOST.1);
    (direction * c, e * sign)
}

/// Friction (N or N m) on a body of this inertia (kg or kg m²) at this speed, as far as an explicit step can have it.
fn explicit(friction: f64, inertia: f64, speed: f64, most: f64) -> f64 {
    if friction * TICK_S <= most * inertia {
        friction
    } else {
        friction.min(speed * inertia / TICK_S)
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
    if c < FRICTION_LEAST_N {
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
mod tests;
