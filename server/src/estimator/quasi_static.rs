//! Friction of an object that is pushed so slowly that the push equals the ground's friction.
//!
//! At some mm/s inertia lies below the sensor's noise and damping looks like friction, so that (1) becomes f = c: m and b
//! stay what they were, and c is the mean of the force while the object slides. What the ground's ripple adds to that is no
//! friction. It must never take a force for friction before the contact has given way, and never a number that is none.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::estimate::Estimate;
use super::measured::Measured;

/// Settings of the quasi-static estimator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct QuasiStaticConfig {
    /// How long the mean of the force reaches back, s. Default 0.3: longer than the ripple of a board under a block that
    /// slides at 3 mm/s.
    pub memory_s: f64,
    /// Way along the force after which the object slides and the contact no longer gives, m. Default 0.3 mm: twice what a
    /// robot's finger gives under 4 N.
    pub way_min_m: f64,
    /// m (kg) and b (N s/m), which stay, and c (N) before any data.
    pub prior: [f64; 3],
}

impl Default for QuasiStaticConfig {
    fn default() -> Self {
        Self {
            memory_s: 0.3,
            way_min_m: 0.3e-3,
            prior: [0.4, 0.0, 1.0],
        }
    }
}

/// The quasi-static estimator.
#[derive(Clone, Copy, Debug)]
pub(super) struct QuasiStaticEstimator {
    config: QuasiStaticConfig,
    /// Where this contact began, m.
    began: Option<Vec2>,
    /// The tool a tick before, m.
    before: Option<Vec2>,
    /// Ticks of sliding in this contact.
    slid: u64,
    /// Mean of the force while it slides, N.
    mean: Vec2,
    pub(super) estimate: Estimate,
}

impl QuasiStaticEstimator {
    /// At the prior.
    #[must_use]
    pub(super) fn new(config: &QuasiStaticConfig) -> Self {
        let mut estimate = Estimate::at(Vector3::from(config.prior));
        estimate.covariance = Matrix3::zeros();
        Self {
            config: *config,
            began: None,
            before: None,
            slid: 0,
            mean: Vec2::zeros(),
            estimate,
        }
    }

    /// Takes one tick; a tick with numbers that no sensor gives ends the contact.
    pub(super) fn step(&mut self, measured: &Measured) {
        if measured.normal.is_some() && measured.is_usable() {
            self.touch(measured.tool, measured.force);
        } else {
            self.release();
        }
    }

    fn touch(&mut self, tool: Vec2, force: Vec2) {
        let before = self.before.replace(tool).unwrap_or(tool);
        let began = *self.began.get_or_insert(tool);
        let towards = force.try_normalize(1e-9).unwrap_or_else(Vec2::zeros);
        let slides = self.slid > 0 || (tool - began).dot(&towards) > self.config.way_min_m;
        let weight = TICK_S / self.config.memory_s;
        let estimate = &mut self.estimate;
        estimate.speed += ((tool - before).dot(&towards) / TICK_S - estimate.speed) * weight;
        (estimate.sticking, estimate.excited) = (!slides, slides);
        if !slides {
            return;
        }
        self.slid = self.slid.saturating_add(1);
        self.mean += (force - self.mean) * weight.max(1.0 / self.slid as f64);
        estimate.samples = estimate.samples.saturating_add(1);
        estimate.heading = Some(libm::atan2(self.mean.y, self.mean.x));
        // (1) without acceleration, and with b v in c
        estimate.c = self.mean.norm();
    }

    fn release(&mut self) {
        (self.began, self.before, self.slid) = (None, None, 0);
        self.mean = Vec2::zeros();
        self.estimate.release();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An estimator after `ticks` of a push along x at 3 mm/s under a force (N) of the tick.
    fn pushed(ticks: u32, force: impl Fn(u32) -> f64) -> QuasiStaticEstimator {
        let mut estimator = QuasiStaticEstimator::new(&QuasiStaticConfig::default());
        for k in 0..ticks {
            estimator.step(&measured(f64::from(k) * 3e-6, force(k)));
        }
        estimator
    }

    fn measured(x: f64, force: f64) -> Measured {
        Measured {
            tool: Vec2::new(x, 0.0),
            force: Vec2::new(force, 0.0),
            back: Vec2::zeros(),
            force_noise_n: 0.0,
            held_back: false,
            normal: Some(Vec2::new(1.0, 0.0)),
            seen: None,
        }
    }

    #[test]
    fn friction_is_the_mean_of_the_force_and_nothing_else_is_learned() {
        let ripple = |k: u32| 4.0 + 0.4 * libm::sin(0.1 * f64::from(k));
        let estimate = pushed(3000, ripple).estimate;
        assert!((estimate.c - 4.0).abs() < 0.03, "{}", estimate.c);
        assert_eq!((estimate.m, estimate.b), (0.4, 0.0));
        assert!(estimate.excited && (estimate.speed - 0.003).abs() < 1e-4);
    }

    #[test]
    fn before_the_contact_has_given_way_a_force_is_no_friction() {
        // 0.3 mm at 3 mm/s
        let early = pushed(95, |_| 4.0).estimate;
        assert_eq!((early.c, early.sticking), (1.0, true));
        assert_eq!(pushed(110, |_| 4.0).estimate.c, 4.0);
    }

    #[test]
    fn what_was_learned_stays_when_the_contact_ends_or_a_number_is_none() {
        let mut estimator = pushed(1000, |_| 4.0);
        for bad in [f64::NAN, f64::INFINITY] {
            estimator.step(&measured(bad, bad));
            assert_eq!(estimator.estimate.c, 4.0);
            assert!(!estimator.estimate.excited);
        }
        estimator.step(&measured(0.0, 2.0));
        assert_eq!(estimator.estimate.c, 4.0);
    }
}
