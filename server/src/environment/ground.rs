//! Ground friction under a footprint: Coulomb friction spread over a patch, one implicit step.
//!
//! Solves, for the velocity u = (v, omega) of the centre of mass in the body frame with M = diag(m, m, I),
//! `min ½ |u − u*|²_M + T [ ½ uᵀ D u + Σ_i (w_i c/64) sqrt(|v + omega × r_i|² + eps²) ]`
//! and decides first whether the ground holds the body. It is the minimiser of a convex function whose least
//! dissipation is at rest, so it never adds energy and never reverses a velocity within a step. A body at rest needs `static_ratio`
//! times the friction of a sliding one to break away; the fall to sliding friction takes place at once.
//! It must never let a held body creep: eps smooths sliding only, the stick test has eps = 0.

use mmt_shared::model::geometry::{Vec2, cross};
use mmt_shared::time::TICK_S;
use nalgebra::{Matrix3, Vector3};

use super::patch::{HELD, Patch, Sums};

/// Smoothing speed eps of sliding friction, m/s: a model study's choice, a thousandth of the slowest push.
const EPS_M_PER_S: f64 = 1e-4;
/// How often eps is divided by ten while neither sliding nor sticking is proven: at the last level the
/// two proofs leave a gap of 1e-4 of the friction limit.
const EPS_LEVELS: usize = 6;
/// The Newton iteration ends with a step that moves no patch point by more than this share of eps. It
/// converges quadratically: what is left then is below 1e-5 eps, 1 nm/s at the usual eps.
const LAST_STEP: f64 = 3e-3;
/// Bound of the Newton iteration; one or two steps are usual.
const NEWTON_STEPS_MAX: usize = 40;

/// What resists and what is moved: the numbers of the friction step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Load {
    /// Mass m, kg.
    pub(super) m: f64,
    /// Inertia I about the centre of mass, kg m².
    pub(super) inertia: f64,
    /// Viscous damping b, N s/m, of the centroid.
    pub(super) b: f64,
    /// Rotational damping `b_r`, N m s.
    pub(super) b_r: f64,
    /// Coulomb friction force c of a patch whose mean weight is 1, N.
    pub(super) c: f64,
    /// Friction torque e about the centroid, N m, of a patch of equal weights.
    pub(super) e: f64,
    /// What breaks a resting body away, by c: 1 or more.
    pub(super) static_ratio: f64,
    /// The centre of mass from the centroid, body frame, m.
    pub(super) centre_of_mass: Vec2,
}

impl Load {
    fn masses(&self) -> Vector3<f64> {
        Vector3::new(self.m, self.m, self.inertia)
    }

    /// D: the film that damps lies under the footprint, so that b resists the centroid's velocity.
    fn dampings(&self) -> Matrix3<f64> {
        let (x, y) = (self.centre_of_mass.x, self.centre_of_mass.y);
        let b = self.b;
        let turning = self.b_r + b * (x * x + y * y);
        Matrix3::new(b, 0.0, b * y, 0.0, b, -b * x, b * y, -b * x, turning)
    }

    /// With the friction that a body at rest feels.
    fn at_rest(&self) -> Self {
        Self {
            c: self.c * self.static_ratio,
            e: self.e * self.static_ratio,
            ..*self
        }
    }
}

/// A minimiser with what the proofs need of it.
struct Minimum {
    u: Vector3<f64>,
    /// A bound on the weighted mean of `q_i` at u.
    at_most: f64,
}

impl Patch {
    /// The velocity (m/s, m/s, rad/s; body frame) after one period T under ground friction, from the
    /// velocity `free` that the body would have without it. `before` is the velocity that it had: where the search
    /// starts, since a sliding body changes little in 1 ms. All numbers must be finite.
    pub(super) fn step(
        &self,
        load: &Load,
        before: Vector3<f64>,
        free: Vector3<f64>,
    ) -> Vector3<f64> {
        let resting = load.static_ratio > 1.0 && before == Vector3::zeros();
        if resting && self.slide(&load.at_rest(), before, free) == Vector3::zeros() {
            return Vector3::zeros();
        }
        self.slide(load, before, free)
    }

    fn slide(&self, load: &Load, before: Vector3<f64>, free: Vector3<f64>) -> Vector3<f64> {
        let masses = load.masses();
        if load.c * self.hold.force <= 0.0 {
            return without_friction(load, free);
        }
        let wrench = free.component_mul(&masses) / TICK_S;
        if self.surely_held(load, &wrench) {
            return Vector3::zeros();
        }
        let mut eps = EPS_M_PER_S;
        let slid = before.xy().norm_squared() > 100.0 * eps * eps;
        let mut u = if slid { before } else { free };
        for _ in 0..EPS_LEVELS {
            let minimum = self.minimise(load, free, u, eps);
            u = minimum.u;
            // Slides, exactly: the wrench does more work along u than friction can take.
            if wrench.dot(&u) > load.c * minimum.at_most {
                return u;
            }
            if self.held_by_slack(load, &wrench, &u, eps) {
                return Vector3::zeros();
            }
            eps /= 10.0;
            u /= 10.0;
        }
        Vector3::zeros()
    }

    /// Safeguarded Newton from `start`.
    fn minimise(&self, load: &Load, free: Vector3<f64>, start: Vector3<f64>, eps: f64) -> Minimum {
        let (masses, dampings) = (load.masses(), load.dampings() * TICK_S);
        let friction = load.c * TICK_S;
        let inert = Matrix3::from_diagonal(&masses) + dampings;
        let cost = |u: &Vector3<f64>, sums: &Sums| {
            let off = u - free;
            0.5 * off.component_mul(&masses).dot(&off)
                + 0.5 * (dampings * u).dot(u)
                + friction * sums.potential
        };
        let mut u = start;
        let mut sums = self.sums(&u, eps);
        for _ in 0..NEWTON_STEPS_MAX {
            let gradient =
                (u - free).component_mul(&masses) + dampings * u + sums.gradient * friction;
            let hessian = inert + sums.curvature * friction;
            let Some(factor) = hessian.cholesky() else {
                break;
            };
            let newton = -factor.solve(&gradient);
            let stretch = newton.xy().norm() + newton.z.abs() * self.reach;
            if stretch < LAST_STEP * eps {
                // q_i changes by no more than its point's velocity
                return Minimum {
                    u: u + newton,
                    at_most: sums.potential + stretch * self.hold.force,
                };
            }
            let (value, slope) = (cost(&u, &sums), gradient.dot(&newton));
            let mut length = 1.0;
            loop {
                let next = u + newton * length;
                let next_sums = self.sums(&next, eps);
                // Armijo's rule, with room for rounding
                let bound = value * (1.0 + 1e-14) + 1e-4 * length * slope;
                if cost(&next, &next_sums) <= bound || length < 1e-6 {
                    (u, sums) = (next, next_sums);
                    break;
                }
                length *= 0.5;
            }
        }
        Minimum {
            u,
            at_most: sums.potential,
        }
    }

    /// The exact half of the stick test: the forces at u leave each point room; if that room, spread as
    /// a pure push and a pure turn, holds the rest of the wrench, the patch holds all of it.
    fn held_by_slack(
        &self,
        load: &Load,
        wrench: &Vector3<f64>,
        u: &Vector3<f64>,
        eps: f64,
    ) -> bool {
        let rest = wrench - self.sums(u, eps).gradient * load.c;
        let fastest = u.xy().norm() + u.z.abs() * self.reach;
        let slack = 1.0 - fastest / (fastest * fastest + eps * eps).sqrt();
        let (push, turn) = self.shares(load, &rest);
        push + turn <= slack
    }

    /// The quick half of the stick test: inside a set that the patch can surely hold.
    fn surely_held(&self, load: &Load, wrench: &Vector3<f64>) -> bool {
        let (push, turn) = self.shares(load, wrench);
        if self.round && self.even {
            push * push + turn * turn <= HELD * HELD
        } else {
            push + turn <= 1.0
        }
    }

    /// A wrench as a pure push and a pure turn about the centre of friction: the share that each takes
    /// of what every point can give.
    fn shares(&self, load: &Load, wrench: &Vector3<f64>) -> (f64, f64) {
        let hold = &self.hold;
        let force = wrench.xy();
        let moment = wrench.z - cross(hold.centre, force);
        if self.even {
            return (force.norm() / load.c, moment.abs() / load.e);
        }
        let turn = moment / (load.c * hold.arm);
        let push = force - hold.drift * (turn * load.c);
        (push.norm() / (load.c * hold.force), turn.abs())
    }
}

/// The same step where nothing but damping resists.
fn without_friction(load: &Load, free: Vector3<f64>) -> Vector3<f64> {
    let masses = load.masses();
    let inert = Matrix3::from_diagonal(&masses) + load.dampings() * TICK_S;
    let momentum = free.component_mul(&masses);
    inert
        .cholesky()
        .map_or_else(Vector3::zeros, |factor| factor.solve(&momentum))
}

#[cfg(test)]
mod tests;
