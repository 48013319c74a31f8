//! The lag of the force sensor: a low-pass of the first order.
//!
//! The simulated sensor has it. Where it is known, what is measured beside the force goes through the same: (1) holds between
//! force and motion after any linear filter, if that is the same one for both.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;

/// Follows a signal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SensorLag {
    /// Weight of a new sample; none without lag.
    weight: Option<f64>,
    followed: Option<Vec2>,
}

impl SensorLag {
    /// With this time constant, ms; 0: without lag. It begins at `begin`, or at the first sample.
    pub(crate) fn new(lag_ms: f64, begin: Option<Vec2>) -> Self {
        let lag_s = lag_ms * 1e-3;
        Self {
            weight: (lag_s > 0.0).then(|| 1.0 - libm::exp(-TICK_S / lag_s)),
            followed: begin,
        }
    }

    /// Takes the sample of a tick and returns the lagging one.
    pub(crate) fn step(&mut self, sample: Vec2) -> Vec2 {
        let Some(weight) = self.weight else {
            return sample;
        };
        let before = self.followed.unwrap_or(sample);
        let now = before + (sample - before) * weight;
        self.followed = Some(now);
        now
    }
}
