//! The friction of a block, fitted to the pushes so far.
//!
//! Decoupled friction is one number, the median force. The other laws have four (c, e/c, centre), found by
//! Levenberg–Marquardt on the force vectors with a robust loss and a weak prior: the least of
//! `Σ 2 k² (sqrt(1 + |f − f_law|²/k²) − 1) + k² Σ ((q − q_start)/sd)²`, q = (ln c, ln e/c, x, y). Fitted
//! again after each push from where the last fit ended. It must never give a number that is not finite.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::stats::values::median;

use super::surface::{Friction, Law, PushMotion};

/// k: force errors well below it count by their square, well above by their size, N.
const ROBUST_N: f64 = 0.3;
/// Standard deviations of the prior: ln c, ln e/c, and the centre's x and y in m. Wide for c, which one
/// push shows; the centre is known to be near the centroid.
const PRIOR_SD: [f64; 4] = [2.0, 0.7, 0.010, 0.010];
/// Steps of the finite differences.
const STEP: [f64; 4] = [1e-5, 1e-5, 1e-7, 1e-7];
/// The most iterations of one fit.
const ITERATIONS: u32 = 30;
/// Relative fall of the cost below which the fit has ended.
const FALL: f64 = 1e-9;

type Vec4 = nalgebra::Vector4<f64>;
type Mat4 = nalgebra::Matrix4<f64>;

/// A push as the fit sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Observation {
    /// How the block moved.
    pub(super) motion: PushMotion,
    /// Steady force on the block in its own frame halfway, N.
    pub(super) force: Vec2,
}

/// The friction that explains `pushes` best under a law; `start` is the prior and `from` where to begin.
pub(super) fn fit(law: Law, start: &Friction, from: &Friction, pushes: &[Observation]) -> Friction {
    match law {
        Law::Decoupled => Friction {
            friction_n: median(pushes.iter().map(|push| push.force.norm()))
                .unwrap_or(start.friction_n),
            ..*start
        },
        Law::LimitSurfaceTwist | Law::LimitSurface | Law::ThreePoint => {
            Search { law, start, pushes }.run(from)
        }
    }
}

struct Search<'a> {
    law: Law,
    start: &'a Friction,
    pushes: &'a [Observation],
}

fn to_vector(surface: &Friction) -> Vec4 {
    Vec4::new(
        libm::log(surface.friction_n.max(1e-6)),
        libm::log(surface.arm_m.max(1e-6)),
        surface.centre_m.x,
        surface.centre_m.y,
    )
}

fn to_surface(q: &Vec4) -> Friction {
    Friction {
        friction_n: libm::exp(q.x),
        arm_m: libm::exp(q.y),
        centre_m: Vec2::new(q.z, q.w),
    }
}

impl Search<'_> {
    fn run(&self, from: &Friction) -> Friction {
        let mut q = to_vector(from);
        let mut cost = self.cost(&q);
        let mut lift = 1e-3;
        for _ in 0..ITERATIONS {
            let (hessian, gradient) = self.normal_equations(&q);
            let lifted = hessian + Mat4::from_diagonal(&hessian.diagonal()) * lift;
            let Some(step) = lifted.cholesky().map(|factor| factor.solve(&gradient)) else {
                break;
            };
            let next = q - step;
            let next_cost = self.cost(&next);
            if next_cost < cost {
                let fall = (cost - next_cost) / cost;
                (q, cost, lift) = (next, next_cost, lift * 0.2);
                if fall < FALL {
                    break;
                }
            } else {
                // A NaN lands here too.
                lift *= 8.0;
            }
        }
        to_surface(&q)
    }

    fn error(&self, q: &Vec4, push: &Observation) -> Vec2 {
        self.law.force(&to_surface(q), &push.motion) - push.force
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
    fn slope(&self, q: &Vec4, push: &Observation, row: usize, step: f64) -> Vec2 {
        let offset = Vec4::from_fn(|index, _| if index == row { step } else { 0.0 });
        (self.error(&(q + offset), push) - self.error(&(q - offset), push)) / (2.0 * step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::rng::Substream;

    const START: Friction = Friction {
        friction_n: 1.0,
        arm_m: 0.05,
        centre_m: Vec2::new(0.0, 0.0),
    };
    const TRUTH: Friction = Friction {
        friction_n: 4.2,
        arm_m: 0.062,
        centre_m: Vec2::new(0.004, -0.003),
    };

    fn pushes(law: Law, count: usize, noise_n: f64) -> Vec<Observation> {
        let mut random = Substream::new(5, "test/fit", 0);
        let mut push = || {
            let motion = PushMotion {
                displacement: Vec2::new(random.normal(), random.normal()) * 0.008,
                turn: 0.1 * random.normal(),
                touched: Vec2::new(-0.05, random.uniform_in(-0.05, 0.09)),
                halfway: 0.0,
            };
            let noise = Vec2::new(random.normal(), random.normal()) * noise_n;
            Observation {
                motion,
                force: law.force(&TRUTH, &motion) + noise,
            }
        };
        (0..count).map(|_| push()).collect()
    }

    fn distance(a: &Friction, b: &Friction) -> f64 {
        (a.friction_n / b.friction_n - 1.0).abs()
            + (a.arm_m / b.arm_m - 1.0).abs()
            + (a.centre_m - b.centre_m).norm() / 0.05
    }

    #[test]
    fn without_noise_many_pushes_give_the_true_friction() {
        for law in [Law::LimitSurfaceTwist, Law::LimitSurface, Law::ThreePoint] {
            let found = fit(law, &START, &START, &pushes(law, 400, 0.0));
            // the prior's pull falls with the number of pushes
            assert!(distance(&found, &TRUTH) < 0.02, "{law:?} {found:?}");
        }
    }

    #[test]
    fn with_noise_more_pushes_give_a_better_friction() {
        for law in [Law::LimitSurfaceTwist, Law::LimitSurface] {
            let few = fit(law, &START, &START, &pushes(law, 6, 0.3));
            let many = fit(law, &START, &START, &pushes(law, 600, 0.3));
            assert!(distance(&many, &TRUTH) < distance(&few, &TRUTH), "{law:?}");
            assert!(distance(&many, &TRUTH) < 0.05, "{law:?} {many:?}");
        }
    }

    #[test]
    fn one_push_in_ten_that_is_nonsense_moves_the_friction_little() {
        let law = Law::LimitSurface;
        let mut spoilt = pushes(law, 100, 0.05);
        let clean = fit(law, &START, &START, &spoilt);
        spoilt
            .iter_mut()
            .step_by(10)
            .for_each(|push| push.force *= 3.0);
        let found = fit(law, &START, &START, &spoilt);
        assert!(
            (found.friction_n / clean.friction_n - 1.0).abs() < 0.05,
            "{found:?}"
        );
    }

    #[test]
    fn without_a_push_the_start_stays_and_one_push_already_shows_c() {
        for law in Law::ALL {
            assert!(distance(&fit(law, &START, &START, &[]), &START) < 1e-12);
            let found = fit(law, &START, &START, &pushes(law, 1, 0.0));
            let law_force = law.force(&found, &pushes(law, 1, 0.0)[0].motion);
            let force = pushes(law, 1, 0.0)[0].force;
            assert!(
                (law_force.norm() / force.norm() - 1.0).abs() < 0.15,
                "{law:?}"
            );
        }
    }
}
