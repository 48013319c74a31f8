//! Orientation of the touched face from the direction of the contact force: section III-A, case 2.
//!
//! The tool is smooth, so the force is perpendicular to the face and its angle is the angle of the inward
//! normal. An alpha–beta filter follows it through noise and through the wrap at ±π. It must never use
//! the direction of a force that is too small to have one.

use mmt_shared::model::geometry::{Vec2, wrap_angle};
use mmt_shared::time::TICK_S;
use serde::{Deserialize, Serialize};

/// A force of so many standard deviations of its noise has a direction.
const DEVIATIONS: f64 = 5.0;

/// Settings of `ForceDirection`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DirectionConfig {
    /// Time constant of the critically damped filter, s. 20 ms: a 10 mN noise on 2 N becomes 1.2 mrad.
    pub time_constant_s: f64,
    /// Least force that has a direction, N. 0.15 N: 15 times the default force noise.
    pub force_min_n: f64,
}

impl Default for DirectionConfig {
    fn default() -> Self {
        Self {
            time_constant_s: 0.020,
            force_min_n: 0.15,
        }
    }
}

/// Follows the angle of the force on the object, world frame, rad, wrapped into (−π, π].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ForceDirection {
    alpha: f64,
    beta: f64,
    force_min: f64,
    ticks_to_forget: u32,
    angle: f64,
    /// Turning rate of the force, rad/s.
    rate: f64,
    silent: u32,
    known: bool,
}

impl ForceDirection {
    /// A filter that knows no direction yet.
    #[must_use]
    pub(super) fn new(config: &DirectionConfig) -> Self {
        // critically damped (fading memory): both poles at exp(−T/tau)
        let pole = libm::exp(-TICK_S / config.time_constant_s);
        Self {
            alpha: 1.0 - pole * pole,
            beta: (1.0 - pole) * (1.0 - pole),
            force_min: config.force_min_n,
            ticks_to_forget: (config.time_constant_s / TICK_S) as u32,
            angle: 0.0,
            rate: 0.0,
            silent: 0,
            known: false,
        }
    }

    /// Takes the force of one tick and its noise per axis where that is more than the settings are made for (N), and
    /// returns the angle, if there is one.
    ///
    /// While the force is too small the angle is held for one time constant, then forgotten: the next
    /// touch may be of another face.
    pub(super) fn step(&mut self, force: Vec2, noise: f64) -> Option<f64> {
        let size = force.norm();
        if size > self.force_min.max(DEVIATIONS * noise) && size.is_finite() {
            let measured = libm::atan2(force.y, force.x);
            self.silent = 0;
            if self.known {
                self.correct(measured);
            } else {
                (self.angle, self.rate, self.known) = (measured, 0.0, true);
            }
        } else {
            self.silent = self.silent.saturating_add(1);
            self.rate = 0.0;
            self.known &= self.silent <= self.ticks_to_forget;
        }
        self.known.then_some(self.angle)
    }

    fn correct(&mut self, measured: f64) {
        let predicted = self.angle + self.rate * TICK_S;
        let residual = wrap_angle(measured - predicted);
        self.angle = wrap_angle(predicted + self.alpha * residual);
        self.rate += self.beta / TICK_S * residual;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::model::geometry::rotate;
    use mmt_shared::rng::Substream;

    fn towards(angle: f64, size: f64) -> Vec2 {
        rotate(angle, Vec2::new(size, 0.0))
    }

    #[test]
    fn a_steady_turn_is_followed_without_lag_through_the_wrap() {
        let mut direction = ForceDirection::new(&DirectionConfig::default());
        let rate = 1.5;
        for k in 0..6000 {
            let truth = 2.5 + rate * TICK_S * f64::from(k);
            let angle = direction.step(towards(truth, 2.0), 0.0).unwrap();
            if k > 400 {
                assert!(wrap_angle(angle - truth).abs() < 1e-6, "{k}");
                assert!((direction.rate - rate).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn noise_of_10_mn_on_2_n_leaves_under_2_mrad() {
        let mut direction = ForceDirection::new(&DirectionConfig::default());
        let mut noise = Substream::new(1, "direction", 0);
        let (mut sum, mut n) = (0.0, 0.0);
        for k in 0..20_000 {
            let (x, y) = noise.normal_pair();
            let force = towards(3.1, 2.0) + Vec2::new(x, y) * 0.010;
            let angle = direction.step(force, 0.0).unwrap();
            if k > 200 {
                sum += wrap_angle(angle - 3.1) * wrap_angle(angle - 3.1);
                n += 1.0;
            }
        }
        let rms = f64::sqrt(sum / n);
        assert!(rms < 0.002, "{rms}");
    }

    #[test]
    fn a_small_force_has_no_direction_and_a_long_silence_forgets() {
        let mut direction = ForceDirection::new(&DirectionConfig::default());
        assert_eq!(direction.step(towards(1.0, 0.15 - 1e-12), 0.0), None);
        assert!(direction.step(towards(1.0, 1.0), 0.0).is_some());
        for _ in 0..20 {
            let held = direction.step(towards(-2.0, 0.1), 0.0).unwrap();
            assert!((held - 1.0).abs() < 1e-12);
        }
        assert_eq!(direction.step(Vec2::zeros(), 0.0), None);
        let next = direction.step(towards(-2.0, 1.0), 0.0).unwrap();
        assert!((next + 2.0).abs() < 1e-12, "the next face starts afresh");
    }

    #[test]
    fn a_force_that_is_not_a_number_changes_nothing() {
        let mut direction = ForceDirection::new(&DirectionConfig::default());
        direction.step(towards(1.0, 1.0), 0.0);
        direction.step(Vec2::new(f64::NAN, 1.0), 0.0);
        direction.step(Vec2::new(f64::INFINITY, f64::INFINITY), 0.0);
        assert!((direction.angle - 1.0).abs() < 1e-12);
    }
}
