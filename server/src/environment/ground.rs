//! Ground friction under a square footprint: Coulomb friction spread over an 8×8 patch, one implicit step.
//!
//! Solves, for the velocity u = (v, omega) in the body frame with M = diag(m, m, I),
//! `min ½ |u − u*|²_M + T [ ½ b |v|² + ½ b_r omega² + Σ_i (c/64) sqrt(|v + omega × r_i|² + eps²) ]`,
//! and decides first whether the patch holds the body. It is the minimiser of a convex function whose
//! least dissipation is at rest, so it never adds energy and never reverses a velocity within a step.
//! It must never let a held body creep: eps smooths sliding only, the stick test has eps = 0.

use mmt_shared::params::friction_torque_of_square;
use mmt_shared::time::TICK_S;
use nalgebra::{Matrix3, Vector3};

/// Patch points along one side.
const POINTS_PER_SIDE: usize = 8;
/// Patch points in all.
const POINTS: usize = POINTS_PER_SIDE * POINTS_PER_SIDE;
/// Smoothing speed eps of sliding friction, m/s: a model study's choice, 1 % of the slowest push.
const EPS_M_PER_S: f64 = 1e-4;
/// How often eps is divided by ten while neither sliding nor sticking is proven: at the last level the
/// two proofs leave a gap of 1e-4 of the friction limit.
const EPS_LEVELS: usize = 6;
/// The Newton iteration ends when it moves every patch point by less than this, m/s.
const TOLERANCE_M_PER_S: f64 = 1e-9;
/// Bound of the Newton iteration; 1–3 steps are usual, the tests see at most a quarter of it.
const NEWTON_STEPS_MAX: usize = 40;
/// The ellipse `(|F|/c)² + (M/e)² ≤ HELD²` lies inside the set of wrenches that the patch can hold. A
/// test scans the patch's support function; its least ratio to the ellipsoid's is just above this.
const HELD: f64 = 0.93;

/// What resists and what is moved: the numbers of the friction step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Load {
    /// Mass m, kg.
    pub(super) m: f64,
    /// Inertia I about z, kg m².
    pub(super) inertia: f64,
    /// Viscous damping b, N s/m.
    pub(super) b: f64,
    /// Rotational damping `b_r`, N m s.
    pub(super) b_r: f64,
    /// Coulomb friction force c, N.
    pub(super) c: f64,
    /// Friction torque e about z, N m.
    pub(super) e: f64,
}

impl Load {
    fn masses(&self) -> Vector3<f64> {
        Vector3::new(self.m, self.m, self.inertia)
    }

    fn dampings(&self) -> Vector3<f64> {
        Vector3::new(self.b, self.b, self.b_r)
    }
}

/// The patch: where the ground touches the footprint, in the body frame.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    points: [(f64, f64); POINTS],
    /// Half the diagonal of the patch, m: turns a turning rate into the fastest point's speed.
    reach: f64,
}

/// Sums over the patch at one velocity, each point weighing 1/64.
struct Sums {
    /// Mean of `q_i` = sqrt(|`s_i`|² + eps²).
    potential: f64,
    /// Its gradient in u: mean friction direction and its moment.
    gradient: Vector3<f64>,
    /// Its second derivative in u.
    curvature: Matrix3<f64>,
    /// Greatest |`s_i`|², (m/s)².
    fastest_squared: f64,
}

impl Patch {
    /// The patch under a square of side l (m).
    ///
    /// The midpoints of an 8×8 grid make (9) 0.6 % too small; they are spread by as much, so that pure
    /// spin feels exactly (9).
    pub(super) fn square(side: f64) -> Self {
        let pitch = side / POINTS_PER_SIDE as f64;
        let place = |k: usize| (k as f64 + 0.5) * pitch - side / 2.0;
        let mut points = [(0.0, 0.0); POINTS];
        for (index, point) in points.iter_mut().enumerate() {
            *point = (
                place(index % POINTS_PER_SIDE),
                place(index / POINTS_PER_SIDE),
            );
        }
        let length = |&(x, y): &(f64, f64)| (x * x + y * y).sqrt();
        let mean_arm = points.iter().map(length).sum::<f64>() / POINTS as f64;
        let spread = friction_torque_of_square(1.0, side) / mean_arm;
        for point in &mut points {
            *point = (point.0 * spread, point.1 * spread);
        }
        Self {
            points,
            reach: points.iter().map(length).fold(0.0, f64::max),
        }
    }

    /// The velocity (m/s, m/s, rad/s; body frame) after one period T under ground friction, from the
    /// velocity `free` that the body would have without it. All numbers must be finite.
    pub(super) fn step(&self, load: &Load, free: Vector3<f64>) -> Vector3<f64> {
        let masses = load.masses();
        if load.c <= 0.0 {
            let resisted = masses + load.dampings() * TICK_S;
            return free.component_mul(&masses).component_div(&resisted);
        }
        let wrench = free.component_mul(&masses) / TICK_S;
        if surely_held(load, &wrench) {
            return Vector3::zeros();
        }
        let mut eps = EPS_M_PER_S;
        let mut u = free;
        for _ in 0..EPS_LEVELS {
            let sums;
            (u, sums) = self.minimise(load, free, u, eps);
            // Slides, exactly: the wrench does more work along u than friction can take.
            if wrench.dot(&u) > load.c * sums.potential {
                return u;
            }
            if held_by_slack(load, &(wrench - sums.gradient * load.c), &sums, eps) {
                return Vector3::zeros();
            }
            eps /= 10.0;
            u /= 10.0;
        }
        Vector3::zeros()
    }

    /// Safeguarded Newton from `start`; returns the minimiser and the sums there.
    fn minimise(
        &self,
        load: &Load,
        free: Vector3<f64>,
        start: Vector3<f64>,
        eps: f64,
    ) -> (Vector3<f64>, Sums) {
        let (masses, dampings) = (load.masses(), load.dampings() * TICK_S);
        let friction = load.c * TICK_S;
        let cost = |u: &Vector3<f64>, sums: &Sums| {
            let off = u - free;
            0.5 * off.component_mul(&masses).dot(&off)
                + 0.5 * u.component_mul(&dampings).dot(u)
                + friction * sums.potential
        };
        let mut u = start;
        let mut sums = self.sums(&u, eps);
        let mut value = cost(&u, &sums);
        for _ in 0..NEWTON_STEPS_MAX {
            let gradient = (u - free).component_mul(&masses)
                + u.component_mul(&dampings)
                + sums.gradient * friction;
            let hessian = Matrix3::from_diagonal(&(masses + dampings)) + sums.curvature * friction;
            let Some(factor) = hessian.cholesky() else {
                break;
            };
            let newton = -factor.solve(&gradient);
            let slope = gradient.dot(&newton);
            let last = newton.xy().norm() + newton.z.abs() * self.reach < TOLERANCE_M_PER_S;
            let mut length = 1.0;
            loop {
                let next = u + newton * length;
                let next_sums = self.sums(&next, eps);
                let next_value = cost(&next, &next_sums);
                // Armijo's rule, with room for rounding
                if next_value <= value + 1e-4 * length * slope + 1e-14 * value || length < 1e-9 {
                    (u, sums, value) = (next, next_sums, next_value);
                    break;
                }
                length *= 0.5;
            }
            if last {
                break;
            }
        }
        (u, sums)
    }

    fn sums(&self, u: &Vector3<f64>, eps: f64) -> Sums {
        let (vx, vy, omega) = (u.x, u.y, u.z);
        let eps_squared = eps * eps;
        let (mut potential, mut fastest_squared) = (0.0, 0.0_f64);
        let (mut gx, mut gy, mut gz) = (0.0, 0.0, 0.0);
        let (mut hxx, mut hxy, mut hyy, mut hxz, mut hyz, mut hzz) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for &(x, y) in &self.points {
            // s_i = v + omega × r_i
            let (sx, sy) = (vx - omega * y, vy + omega * x);
            let squared = sx * sx + sy * sy;
            let q = (squared + eps_squared).sqrt();
            let inverse = 1.0 / q;
            let (dx, dy) = (sx * inverse, sy * inverse);
            potential += q;
            fastest_squared = fastest_squared.max(squared);
            gx += dx;
            gy += dy;
            gz += x * dy - y * dx;
            // (1 − d dᵀ)/q, seen from u by the columns (1, 0), (0, 1), (−y, x)
            let (pxx, pxy, pyy) = (
                inverse * (1.0 - dx * dx),
                -inverse * dx * dy,
                inverse * (1.0 - dy * dy),
            );
            let (pxz, pyz) = (pxy * x - pxx * y, pyy * x - pxy * y);
            hxx += pxx;
            hxy += pxy;
            hyy += pyy;
            hxz += pxz;
            hyz += pyz;
            hzz += pyz * x - pxz * y;
        }
        let weight = 1.0 / POINTS as f64;
        Sums {
            potential: potential * weight,
            gradient: Vector3::new(gx, gy, gz) * weight,
            curvature: Matrix3::new(hxx, hxy, hxz, hxy, hyy, hyz, hxz, hyz, hzz) * weight,
            fastest_squared,
        }
    }
}

/// The quick half of the stick test: inside an ellipse that the patch can surely hold.
fn surely_held(load: &Load, wrench: &Vector3<f64>) -> bool {
    let force = wrench.xy().norm() / load.c;
    let moment = wrench.z / load.e;
    force * force + moment * moment <= HELD * HELD
}

/// The exact half: forces that leave each point room hold all of the wrench but `rest`; that room,
/// spread as a pure push and a pure turn, holds the rest.
fn held_by_slack(load: &Load, rest: &Vector3<f64>, sums: &Sums, eps: f64) -> bool {
    let fastest = sums.fastest_squared;
    let slack = 1.0 - (fastest / (fastest + eps * eps)).sqrt();
    rest.xy().norm() / load.c + rest.z.abs() / load.e <= slack
}

#[cfg(test)]
mod tests;
