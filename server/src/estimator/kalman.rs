//! Constant-acceleration Kalman filter of the tool's motion: section II-A's "Kalman filter".
//!
//! Each axis has the state (position, velocity, acceleration) driven by white jerk. Both axes have the
//! same noise, so they share one covariance and one gain. Part of paper mode: it filters the motion only,
//! and that is why the paper's m is off.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;
use nalgebra::{Matrix3, Matrix3x2, Vector3};
use serde::{Deserialize, Serialize};

/// Settings of `MotionFilter`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct KalmanConfig {
    /// Standard deviation of the measured position, m. 10 µm: the default sensor noise.
    pub position_noise_m: f64,
    /// Density of the driving white jerk, m²/s⁵. 0.3: a bandwidth of (0.3 / 10⁻¹³)^(1/6) ≈ 120 rad/s,
    /// near the best for m in the default scenario.
    pub jerk_density: f64,
}

impl Default for KalmanConfig {
    fn default() -> Self {
        Self {
            position_noise_m: 10e-6,
            jerk_density: 0.3,
        }
    }
}

/// The filter of both axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct MotionFilter {
    transition: Matrix3<f64>,
    process_noise: Matrix3<f64>,
    measurement_noise: f64,
    covariance: Matrix3<f64>,
    /// Rows: position, velocity, acceleration; columns: x, y.
    state: Option<Matrix3x2<f64>>,
}

impl MotionFilter {
    /// A filter that has seen nothing.
    #[must_use]
    pub(super) fn new(config: &KalmanConfig) -> Self {
        let (t, q) = (TICK_S, config.jerk_density);
        let (t2, t3) = (t * t, t * t * t);
        // white jerk of density q over one tick
        #[rustfmt::skip]
        let process_noise = Matrix3::new(
            t3 * t2 / 20.0, t2 * t2 / 8.0, t3 / 6.0,
            t2 * t2 / 8.0,  t3 / 3.0,      t2 / 2.0,
            t3 / 6.0,       t2 / 2.0,      t,
        ) * q;
        // a position variance of zero would make the gain 0/0 once the state is known
        let measurement_noise = (config.position_noise_m * config.position_noise_m).max(1e-18);
        Self {
            transition: Matrix3::new(1.0, t, t2 / 2.0, 0.0, 1.0, t, 0.0, 0.0, 1.0),
            process_noise,
            measurement_noise,
            // at first the tool rests within 0.3 m/s and 3 m/s²
            covariance: Matrix3::from_diagonal(&Vector3::new(measurement_noise, 0.1, 10.0)),
            state: None,
        }
    }

    /// Takes a measured position (m); returns velocity (m/s) and acceleration (m/s²).
    pub(super) fn step(&mut self, position: Vec2) -> (Vec2, Vec2) {
        let measured = position.transpose();
        let Some(state) = self.state else {
            let state = Matrix3x2::from_rows(&[measured, measured * 0.0, measured * 0.0]);
            self.state = Some(state);
            return (Vec2::zeros(), Vec2::zeros());
        };
        let predicted = self.transition * state;
        let spread =
            self.transition * self.covariance * self.transition.transpose() + self.process_noise;
        let gain = spread.column(0) / (spread.m11 + self.measurement_noise);
        let corrected = predicted + gain * (measured - predicted.row(0));
        let covariance = spread - gain * spread.row(0);
        // rounding must not make it lopsided
        self.covariance = (covariance + covariance.transpose()) * 0.5;
        self.state = Some(corrected);
        (corrected.row(1).transpose(), corrected.row(2).transpose())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::rng::Substream;

    #[test]
    fn a_constant_acceleration_is_followed_without_bias() {
        let mut filter = MotionFilter::new(&KalmanConfig::default());
        let (v0, a) = (Vec2::new(0.1, -0.2), Vec2::new(0.3, 0.1));
        let mut last = (Vec2::zeros(), Vec2::zeros());
        for k in 0..1000 {
            let t = f64::from(k) * TICK_S;
            last = filter.step(v0 * t + a * (t * t / 2.0));
        }
        assert!((last.0 - (v0 + a * 0.999)).norm() < 1e-6);
        assert!((last.1 - a).norm() < 1e-4);
    }

    #[test]
    fn noise_of_10_um_is_smoothed_to_under_a_millimetre_per_second() {
        let mut filter = MotionFilter::new(&KalmanConfig::default());
        let mut noise = Substream::new(5, "kalman", 0);
        let (mut filtered, mut raw, mut before, mut n) = (0.0, 0.0, 0.0, 0.0);
        for k in 0..20_000 {
            let x = 10e-6 * noise.normal();
            let (v, _) = filter.step(Vec2::new(x, 0.0));
            if k > 500 {
                filtered += v.x * v.x;
                raw += (x - before) * (x - before) / (TICK_S * TICK_S);
                n += 1.0;
            }
            before = x;
        }
        assert!(f64::sqrt(raw / n) > 0.010, "the effect: differences alone");
        assert!(
            f64::sqrt(filtered / n) < 0.001,
            "{}",
            f64::sqrt(filtered / n)
        );
    }
}
