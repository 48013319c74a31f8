//! The support of a block under each law, fitted to the pushes so far.
//!
//! Decoupled friction is one number, the median force. The other laws have four, which
//! [`mmt_server::contact_prediction::fit`] finds.

use mmt_server::contact_prediction::{Observation, Support};
use mmt_shared::stats::values::median;

use super::surface::{Law, PushMotion};

/// The support that explains `pushes` best under a law; `start` is the prior and `from` where to begin.
pub(super) fn fit(
    law: Law,
    start: &Support,
    from: &Support,
    pushes: &[Observation<PushMotion>],
) -> Support {
    match law {
        Law::Decoupled => Support {
            friction_n: median(pushes.iter().map(|push| push.force.norm()))
                .unwrap_or(start.friction_n),
            ..*start
        },
        Law::LimitSurfaceTwist | Law::LimitSurface | Law::ThreePoint => {
            let force = |support: &Support, motion: &PushMotion| law.force(support, motion);
            mmt_server::contact_prediction::fit(force, start, from, pushes)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::model::geometry::Vec2;
    use mmt_shared::rng::Substream;

    const START: Support = Support {
        friction_n: 1.0,
        arm_m: 0.05,
        centre_m: Vec2::new(0.0, 0.0),
    };
    const TRUTH: Support = Support {
        friction_n: 4.2,
        arm_m: 0.062,
        centre_m: Vec2::new(0.004, -0.003),
    };

    fn pushes(law: Law, count: usize, noise_n: f64) -> Vec<Observation<PushMotion>> {
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

    fn distance(a: &Support, b: &Support) -> f64 {
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
