//! Paper mode: Kalman-filtered tool motion, raw force, block least squares (3) for m, b, c.
//!
//! Section II-A as printed: the tool's motion is taken for the object's, and force and motion are not
//! filtered alike. It must stay wrong in the way the paper is wrong; nothing here is clamped or gated.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::kalman::{KalmanConfig, MotionFilter};
use super::windowed::{Rows, WindowedLeastSquares};
use super::{Estimate, Measured, STICK_SPEED};

/// Settings of `PaperEstimator`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PaperConfig {
    /// The filter of the tool's motion.
    pub kalman: KalmanConfig,
    /// Length of the window of (3), s; 2 ms to 60 s. The paper gives none. Default 0.2: a third of the shortest push.
    pub window_s: f64,
    /// How a tick becomes rows of (3).
    pub rows: Rows,
    /// Values of m (kg), b (N s/m), c (N) before the first full window.
    pub prior: [f64; 3],
}

impl Default for PaperConfig {
    fn default() -> Self {
        Self {
            kalman: KalmanConfig::default(),
            window_s: 0.200,
            rows: Rows::default(),
            prior: [0.4, 0.0, 1.0],
        }
    }
}

/// The paper's estimator.
#[derive(Clone, Debug)]
pub(super) struct PaperEstimator {
    motion: MotionFilter,
    window: WindowedLeastSquares,
    pub(super) estimate: Estimate,
}

impl PaperEstimator {
    /// At the prior. Allocates the window here and never again.
    #[must_use]
    pub(super) fn new(config: &PaperConfig) -> Self {
        let ticks = (config.window_s / TICK_S).round().clamp(2.0, 60_000.0) as usize;
        Self {
            motion: MotionFilter::new(&config.kalman),
            window: WindowedLeastSquares::new(ticks, config.rows),
            estimate: Estimate::at(Vector3::from(config.prior)),
        }
    }

    /// Takes one tick; a tick with numbers that no sensor gives is passed over.
    pub(super) fn step(&mut self, measured: &Measured) {
        if !measured.is_usable() {
            self.estimate.excited = false;
            return;
        }
        let (v, a) = self.motion.step(measured.tool);
        if measured.normal.is_some() {
            self.touch(a, v, measured.force);
        } else {
            self.window.clear();
            self.estimate.release();
        }
    }

    fn touch(&mut self, a: Vec2, v: Vec2, force: Vec2) {
        self.window.push(a, v, force);
        let (condition, solution) = self.window.solve();
        let estimate = &mut self.estimate;
        estimate.samples = estimate.samples.saturating_add(1);
        estimate.condition = condition;
        estimate.excited = solution.is_some();
        if let Some(solution) = solution {
            estimate.set(solution.estimate, solution.covariance);
        }
        let size = force.norm();
        if size > 0.0 {
            let normal = force / size;
            estimate.heading = Some(libm::atan2(force.y, force.x));
            (estimate.speed, estimate.acceleration) = (v.dot(&normal), a.dot(&normal));
        }
        estimate.sticking = estimate.speed.abs() < STICK_SPEED;
    }
}
