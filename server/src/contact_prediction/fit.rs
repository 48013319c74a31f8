//! The support of an object, fitted to the pushes so far.
//!
//! Its four numbers (c, e/c, centre) are found by Levenberg–Marquardt on the force vectors with a robust loss and a weak prior: the least of
//! `Σ 2 k² (sqrt(1 + |f − f_law|²/k²) − 1) + k² Σ ((q − q_start)/sd)²`, q = (ln c, ln e/c, x, y). Fitted
//! again after each push from where the last fit ended. It must never give a number that is not finite.

use mmt_shared::model::geometry::Vec2;

use super::support::Support;
use crate::levenberg_marquardt::LevenbergMarquardt;

/// k: force errors well below it count by their square, well above by their size, N.
const ROBUST_N: f64 = 0.3;
/// Standard deviations of the prior: ln c, ln e/c, and the centre's x and y in m. Wide for c, which one
/// push shows; the centre is known to be near the reference point.
const PRIOR_SD: [f64; 4] = [2.0, 0.7, 0.010, 0.010];
/// Steps of the finite differences.
const STEP: [f64; 4] = [1e-5, 1e-5, 1e-7, 1e-7];
/// The most iterations of one fit.
const ITERATIONS: u32 = 30;
/// Relative fall of the cost below which the fit has ended.
const FALL: f64 = 1e-9;

type Vec4 = nalgebra::Vector4<f64>;
type Mat4 = nalgebra::Matrix4<f64>;

/// A push as the fit sees it; `M` is what the law takes of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation<M> {
    /// How the object moved.
    pub motion: M,
    /// Steady force on the object in its own frame halfway, N.
    pub force: Vec2,
}

/// The support that explains `pushes` best under `law`, the force (N) that a support answers a motion with; `start` is the
/// prior and `from` where to begin.
pub fn fit<M>(
    law: impl Fn(&Support, &M) -> Vec2,
    start: &Support,
    from: &Support,
    pushes: &[Observation<M>],
) -> Support {
    Search { law, start, pushes }.run(from)
}

struct Search<'a, L, M> {
    law: L,
    start: &'a Support,
    pushes: &'a [Observation<M>],
}

fn to_vector(support: &Support) -> Vec4 {
    Vec4::new(
        libm::log(support.friction_n.max(1e-6)),
        libm::log(support.arm_m.max(1e-6)),
        support.centre_m.x,
        support.centre_m.y,
    )
}

fn to_support(q: &Vec4) -> Support {
    Support {
        friction_n: libm::exp(q.x),
        arm_m: libm::exp(q.y),
        centre_m: Vec2::new(q.z, q.w),
    }
}

impl<M, L: Fn(&Support, &M) -> Vec2> Search<'_, L, M> {
    fn run(&self, from: &Support) -> Support {
        let begin = to_vector(from);
        let mut search = LevenbergMarquardt::new(begin, self.cost(&begin), 1e-3);
        for _ in 0..ITERATIONS {
            let (hessian, gradient) = self.normal_equations(&search.at);
            let step = search.step(&hessian, &gradient, |q| self.cost(q));
            if step.is_last(FALL) {
                break;
            }
        }
        to_support(&search.at)
    }

    fn error(&self, q: &Vec4, push: &Observation<M>) -> Vec2 {
        (self.law)(&to_support(q), &push.motion) - push.force
    }

    fn prior(&self, q: &Vec4) -> Vec4 {
        (q - to_vector(self.start)).component_div(&Vec4::from(PRIOR_SD)) * ROBUST_N
    }

    fn cost(&self, q: &Vec4) -> f64 {
        let k2 = ROBUST_N * ROBUST_N;
        let robust = |error: Vec2| 2.0 * k2 * ((1.0 + error.norm_squared() / k2).sqrt() - 1.0);
        let misfit: f64 = self
            .pushes
            .iter()
            .map(|push| robust(self.error(q, push)))
            .sum();
        misfit + self.prior(q).norm_squared()
    }

    /// Half of the cost's Gauss–Newton Hessian and gradient.
    fn normal_equations(&self, q: &Vec4) -> (Mat4, Vec4) {
        let scale = Vec4::from(PRIOR_SD.map(|sd| ROBUST_N / sd));
        let mut hessian = Mat4::from_diagonal(&scale.component_mul(&scale));
        let mut gradient = self.prior(q).component_mul(&scale);
        for push in self.pushes {
            let error = self.error(q, push);
            let weight = 1.0 / (1.0 + error.norm_squared() / (ROBUST_N * ROBUST_N)).sqrt();
            let slopes =
                Vec4::from(STEP).map_with_location(|row, _, step| self.slope(q, push, row, step));
            let [x, y] = [slopes.map(|slope| slope.x), slopes.map(|slope| slope.y)];
            hessian += (x * x.transpose() + y * y.transpose()) * weight;
            gradient += (x * error.x + y * error.y) * weight;
        }
        (hessian, gradient)
    }

    /// Central difference of the force by parameter `row`.
    fn slope(&self, q: &Vec4, push: &Observation<M>, row: usize, step: f64) -> Vec2 {
        let offset = Vec4::from_fn(|index, _| if index == row { step } else { 0.0 });
        (self.error(&(q + offset), push) - self.error(&(q - offset), push)) / (2.0 * step)
    }
}
