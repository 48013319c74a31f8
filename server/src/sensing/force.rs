//! The force sensor: what it makes of the true force.
//!
//! Lag and gain act on the force; bias, its drift and noise are added. Size and time are configured, the directions of
//! bias and drift come from the seed, each from its own substream. Without errors it passes the force on bit by bit.
//! A fault is what no configuration has: a sensor that breaks in mid-run.

use mmt_shared::model::geometry::{Vec2, rotate};
use mmt_shared::rng::Substream;
use mmt_shared::time::TICK_S;

use super::config::SensingConfig;
use super::lag::SensorLag;

/// How a force sensor is broken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ForceFault {
    /// It gives the force of the moment in which it broke.
    Frozen,
    /// It is off by this, world frame, N.
    Off(Vec2),
}

/// The sensor between tool and object.
#[derive(Clone, Debug)]
pub(super) struct ForceSensor {
    noise_n: f64,
    noise: Substream,
    /// Bias now, N, and by how much it grows in a tick, N.
    bias: Vec2,
    drift: Vec2,
    gain: f64,
    lag: SensorLag,
    /// What it gave last, N.
    given: Vec2,
    pub(super) fault: Option<ForceFault>,
}

impl ForceSensor {
    pub(super) fn new(config: &SensingConfig, seed: u64) -> Self {
        Self {
            noise_n: config.force_noise_n,
            noise: Substream::new(seed, "slave/force-noise", 0),
            bias: direction(seed, "slave/force-bias") * config.force_bias_n,
            drift: direction(seed, "slave/force-drift") * (config.force_drift_n_per_s * TICK_S),
            gain: config.force_gain,
            lag: SensorLag::new(config.force_lag_ms, Some(Vec2::zeros())),
            given: Vec2::zeros(),
            fault: None,
        }
    }

    /// Measures the true force of one tick, N.
    pub(super) fn measure(&mut self, force: Vec2) -> Vec2 {
        let measured =
            self.lag.step(force) * self.gain + self.bias + pair(&mut self.noise) * self.noise_n;
        self.bias += self.drift;
        self.given = match self.fault {
            None => measured,
            Some(ForceFault::Off(by)) => measured + by,
            Some(ForceFault::Frozen) => self.given,
        };
        self.given
    }
}

/// A unit vector of a substream's own.
fn direction(seed: u64, name: &str) -> Vec2 {
    let angle = std::f64::consts::TAU * Substream::new(seed, name, 0).uniform();
    rotate(angle, Vec2::new(1.0, 0.0))
}

pub(super) fn pair(stream: &mut Substream) -> Vec2 {
    let (x, y) = stream.normal_pair();
    Vec2::new(x, y)
}
