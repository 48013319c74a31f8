//! Constant-velocity Kalman filter of theta and omega, measured by the direction of the force and by vision.

use mmt_shared::model::dynamics::Motion;
use mmt_shared::time::TICK_S;

/// How well theta and omega are known.
#[derive(Clone, Copy, Debug)]
pub(super) struct AngleFilter {
    /// Covariance of (theta, omega): [theta², theta·omega, omega²], in rad and s.
    covariance: [f64; 3],
}

impl AngleFilter {
    /// theta is known with this variance (rad²), and omega is 0.
    pub(super) fn new(variance: f64) -> Self {
        Self {
            covariance: [variance, 0.0, 0.0],
        }
    }

    /// The box was let go: theta is less certain by this variance (rad²), and friction will stop it.
    pub(super) fn let_go(&mut self, variance: f64) {
        let [theta, ..] = self.covariance;
        *self = Self::new(theta + variance);
    }

    /// One tick under a turning acceleration that is unknown but of this size, rad/s².
    pub(super) fn predict(&mut self, motion: &mut Motion, acceleration: f64) {
        motion.pose.angle += motion.twist.angular * TICK_S;
        let [p, pc, q] = self.covariance;
        let noise = acceleration * acceleration * TICK_S;
        self.covariance = [
            p + 2.0 * pc * TICK_S + q * TICK_S * TICK_S,
            pc + q * TICK_S,
            q + noise * TICK_S,
        ];
    }

    /// Takes a measured theta that differs by `innovation` (rad), with its variance (rad²).
    pub(super) fn measure(&mut self, motion: &mut Motion, innovation: f64, variance: f64) {
        let [p, pc, q] = self.covariance;
        let total = p + variance;
        if total <= 0.0 {
            return;
        }
        let (gain_angle, gain_rate) = (p / total, pc / total);
        motion.pose.angle += gain_angle * innovation;
        motion.twist.angular += gain_rate * innovation;
        self.covariance = [
            p * (1.0 - gain_angle),
            pc * (1.0 - gain_angle),
            q - gain_rate * pc,
        ];
    }
}
