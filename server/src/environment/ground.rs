//! Ground friction under a square footprint: Coulomb friction spread over an 8×8 patch, one implicit step.
//!
//! Solves, for the velocity u = (v, omega) in the body frame with M = diag(m, m, I),
//! `min ½ |u − u*|²_M + T [ ½ b |v|² + ½ b_r omega² + Σ_i (c/64) sqrt(|v + omega × r_i|² + eps²) ]`,
//! and decides first whether the patch holds the body. It is the minimiser of a convex function whose
//! least dissipation is at rest, so it never adds energy and never reverses a velocity within a step.
//! It must never let a held body creep: eps smooths sliding only, the stick test has eps = 0.

use mmt_shared::params::friction_torque_of_square;
use mmt_shared::time::TICK_S;
use nalgebra::{Matrix3, SVector, Vector3};

/// Patch points along one side.
const POINTS_PER_SIDE: usize = 8;
/// Patch points in all.
const POINTS: usize = POINTS_PER_SIDE * POINTS_PER_SIDE;
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
/// Patch points that are summed side by side, so that the machine may use its vector registers.
const LANES: usize = 4;
/// Terms summed over the points: potential, gradient, upper half of the curvature.
const TERMS: usize = 10;
/// One number of each of [`LANES`] points.
type Lanes = SVector<f64, LANES>;
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
    /// x and y of the points, m, in rows of [`LANES`].
    points: [Row; POINTS / LANES],
    /// Half the diagonal of the patch, m: turns a turning rate into the fastest point's speed.
    reach: f64,
}

/// Some patch points side by side.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    x: Lanes,
    y: Lanes,
    /// x² + y², m².
    arm_squared: Lanes,
}

/// Sums over the patch at one velocity, each point weighing 1/64.
struct Sums {
    /// Mean of `q_i` = sqrt(|`s_i`|² + eps²).
    potential: f64,
    /// Its gradient in u: mean friction direction and its moment.
    gradient: Vector3<f64>,
    /// Its second derivative in u.
    curvature: Matrix3<f64>,
}

impl Patch {
    /// The patch under a square of side l (m).
    ///
    /// The midpoints of an 8×8 grid make (9) 0.6 % too small; they are spread by as much, so that pure
    /// spin feels exactly (9).
    pub(super) fn square(side: f64) -> Self {
        let pitch = side / POINTS_PER_SIDE as f64;
        let place = |k: usize| (k as f64 + 0.5) * pitch - side / 2.0;
        let grid = (0..POINTS).map(|k| (place(k % POINTS_PER_SIDE), place(k / POINTS_PER_SIDE)));
        let length = |(x, y): (f64, f64)| (x * x + y * y).sqrt();
        let mean_arm = grid.clone().map(length).sum::<f64>() / POINTS as f64;
        let spread = friction_torque_of_square(1.0, side) / mean_arm;
        let mut points = [Row::default(); POINTS / LANES];
        let slots = points.iter_mut().flat_map(|row| {
            let places = row.x.iter_mut().zip(row.y.iter_mut());
            places.zip(row.arm_squared.iter_mut())
        });
        for (((x, y), arm_squared), point) in slots.zip(grid.clone()) {
            (*x, *y) = (point.0 * spread, point.1 * spread);
            *arm_squared = *x * *x + *y * *y;
        }
        Self {
            points,
            reach: grid.map(length).fold(0.0, f64::max) * spread,
        }
    }

    /// The velocity (m/s, m/s, rad/s; body frame) after one period T under ground friction, from the
    /// velocity `free` that the body would have without it. `before` is the velocity that it had: where
    /// the search starts, since a sliding body changes little in 1 ms. All numbers must be finite.
    pub(super) fn step(
        &self,
        load: &Load,
        before: Vector3<f64>,
        free: Vector3<f64>,
    ) -> Vector3<f64> {
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
        let slid = before.xy().norm_squared() > 100.0 * eps * eps;
        let mut u = if slid { before } else { free };
        for _ in 0..EPS_LEVELS {
            let at_most;
            (u, at_most) = self.minimise(load, free, u, eps);
            // Slides, exactly: the wrench does more work along u than friction can take.
            if wrench.dot(&u) > load.c * at_most {
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

    /// Safeguarded Newton from `start`: the minimiser, and a bound on the mean of `q_i` there.
    fn minimise(
        &self,
        load: &Load,
        free: Vector3<f64>,
        start: Vector3<f64>,
        eps: f64,
    ) -> (Vector3<f64>, f64) {
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
        for _ in 0..NEWTON_STEPS_MAX {
            let gradient = (u - free).component_mul(&masses)
                + u.component_mul(&dampings)
                + sums.gradient * friction;
            let hessian = Matrix3::from_diagonal(&(masses + dampings)) + sums.curvature * friction;
            let Some(factor) = hessian.cholesky() else {
                break;
            };
            let newton = -factor.solve(&gradient);
            let stretch = newton.xy().norm() + newton.z.abs() * self.reach;
            if stretch < LAST_STEP * eps {
                // q_i changes by no more than its point's velocity
                return (u + newton, sums.potential + stretch);
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
        (u, sums.potential)
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
        rest.xy().norm() / load.c + rest.z.abs() / load.e <= slack
    }

    fn sums(&self, u: &Vector3<f64>, eps: f64) -> Sums {
        let eps_squared = eps * eps;
        let mut sums = [Lanes::zeros(); TERMS];
        for row in &self.points {
            for (sum, term) in sums.iter_mut().zip(row.terms(u, eps_squared)) {
                *sum += term;
            }
        }
        let [q, gx, gy, gz, hxx, hxy, hyy, hxz, hyz, hzz] =
            sums.map(|lanes| lanes.sum() / POINTS as f64);
        Sums {
            potential: q,
            gradient: Vector3::new(gx, gy, gz),
            curvature: Matrix3::new(hxx, hxy, hxz, hxy, hyy, hyz, hxz, hyz, hzz),
        }
    }
}

impl Row {
    /// Each point's potential, its gradient in u and the upper half of its second derivative.
    #[inline]
    fn terms(&self, u: &Vector3<f64>, eps_squared: f64) -> [Lanes; TERMS] {
        let (x, y) = (&self.x, &self.y);
        // s = v + omega × r
        let sx = (y * -u.z).add_scalar(u.x);
        let sy = (x * u.z).add_scalar(u.y);
        let squared = sx.component_mul(&sx) + sy.component_mul(&sy);
        let q = squared.add_scalar(eps_squared).map(f64::sqrt);
        let a = q.map(|q| 1.0 / q);
        // d = s/q, seen from u by the columns (1, 0), (0, 1), (−y, x)
        let (dx, dy) = (sx.component_mul(&a), sy.component_mul(&a));
        let dz = x.component_mul(&dy) - y.component_mul(&dx);
        // (1 − d dᵀ)/q, seen likewise
        let (ax, ay) = (a.component_mul(&dx), a.component_mul(&dy));
        let az = a.component_mul(&dz);
        [
            q,
            dx,
            dy,
            dz,
            a - ax.component_mul(&dx),
            -ax.component_mul(&dy),
            a - ay.component_mul(&dy),
            -a.component_mul(y) - ax.component_mul(&dz),
            a.component_mul(x) - ay.component_mul(&dz),
            a.component_mul(&self.arm_squared) - az.component_mul(&dz),
        ]
    }
}

/// The quick half of the stick test: inside an ellipse that the patch can surely hold.
fn surely_held(load: &Load, wrench: &Vector3<f64>) -> bool {
    let force = wrench.xy().norm() / load.c;
    let moment = wrench.z / load.e;
    force * force + moment * moment <= HELD * HELD
}

#[cfg(test)]
mod tests;
