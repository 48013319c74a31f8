//! Paper mode: Kalman-filtered motion, raw force, block least squares (3) for m, b, c.
//!
//! Section II-A as printed: after a stable contact the end-effector's motion is the object's, and force and motion are
//! not filtered alike. It must stay wrong in the way the paper is wrong; nothing here is clamped.

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::estimate::{Estimate, STICK_SPEED};
use super::kalman::{KalmanConfig, MotionFilter};
use super::measured::Measured;
use super::surface::Surface;
use super::windowed::{Rows, WindowedLeastSquares};

/// Which motion is taken for the object's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ObjectMotion {
    /// That of the surface under the tool: the paper's end-effector does not move relative to the surface (II-A), as
    /// CHAI3D's proxy does not (IV-A). Here a spring lies between the two, so (6) is inverted.
    #[default]
    Surface,
    /// That of the tool, behind the spring.
    Tool,
}

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
    /// Which motion is taken for the object's.
    pub motion: ObjectMotion,
    /// How long contact must have lasted before a tick counts, s; 0 to 60 s. The paper estimates "after a stable contact"
    /// (II-A) and gives no time. Default 0.02: twice as long as contact of one side alone must last to count.
    pub stable_after_s: f64,
    /// Whether ticks in which the object stands still are left out. (1) does not hold there, but the paper does not
    /// leave them out. Default no.
    pub leave_out_standstill: bool,
    /// Values of m (kg), b (N s/m), c (N) before the first full window.
    pub prior: [f64; 3],
}

impl Default for PaperConfig {
    fn default() -> Self {
        Self {
            kalman: KalmanConfig::default(),
            window_s: 0.200,
            rows: Rows::default(),
            motion: ObjectMotion::default(),
            stable_after_s: 0.02,
            leave_out_standstill: false,
            prior: [0.4, 0.0, 1.0],
        }
    }
}

/// The paper's estimator.
#[derive(Clone, Debug)]
pub(super) struct PaperEstimator {
    /// Finds the surface under the tool; none if the tool's motion is taken.
    surface: Option<Surface>,
    motion: MotionFilter,
    stable_ticks: u64,
    /// Ticks since contact began.
    touched: u64,
    leave_out_standstill: bool,
    window: WindowedLeastSquares,
    pub(super) estimate: Estimate,
}

impl PaperEstimator {
    /// At the prior, of an object touched through `coupling`. Allocates the window here and never again.
    #[must_use]
    pub(super) fn new(config: &PaperConfig, coupling: Coupling) -> Self {
        let ticks = (config.window_s / TICK_S).round().clamp(2.0, 60_000.0) as usize;
        let from_surface = config.motion == ObjectMotion::Surface;
        Self {
            surface: from_surface.then(|| Surface::new(coupling)),
            stable_ticks: (config.stable_after_s / TICK_S).round() as u64,
            touched: 0,
            leave_out_standstill: config.leave_out_standstill,
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
        let Some(normal) = measured.normal else {
            self.release(measured.tool);
            return;
        };
        let force = measured.force;
        let size = force.norm();
        let normal = if size > 0.0 { force / size } else { normal };
        let point = self.surface.as_mut().map_or(measured.tool, |surface| {
            surface.locate(measured.tool, force, normal)
        });
        let (v, a) = self.motion.step(point);
        if size > 0.0 {
            let estimate = &mut self.estimate;
            estimate.heading = Some(libm::atan2(force.y, force.x));
            (estimate.speed, estimate.acceleration) = (v.dot(&normal), a.dot(&normal));
        }
        self.estimate.sticking = self.estimate.speed.abs() < STICK_SPEED;
        self.touched += 1;
        self.estimate.excited = false;
        let stands_still = self.leave_out_standstill && self.estimate.sticking;
        if self.touched > self.stable_ticks && !stands_still {
            self.regress(a, v, force);
        }
    }

    /// Contact was lost: the next one starts the window anew.
    fn release(&mut self, tool: Vec2) {
        self.motion.step(tool);
        if let Some(surface) = &mut self.surface {
            surface.reset();
        }
        self.touched = 0;
        self.window.clear();
        self.estimate.release();
    }

    fn regress(&mut self, a: Vec2, v: Vec2, force: Vec2) {
        self.window.push(a, v, force);
        let (condition, solution) = self.window.solve();
        let estimate = &mut self.estimate;
        estimate.samples = estimate.samples.saturating_add(1);
        estimate.condition = condition;
        estimate.excited = solution.is_some();
        if let Some(solution) = solution {
            estimate.set(solution.estimate, solution.covariance);
        }
    }
}
