//! How well the slave measures, and what of it is accepted.

use mmt_shared::range::{OutOfRange, all_in_range};
use serde::{Deserialize, Serialize};

/// Most images on their way at a time: a second of latency at 60 Hz.
pub(super) const IMAGES_MAX: usize = 64;

/// Accepted position noise, m r.m.s.
pub(super) const POSITION_NOISE_M: (f64, f64) = (0.0, 0.1);

/// Accepted force noise, N r.m.s.
pub(super) const FORCE_NOISE_N: (f64, f64) = (0.0, 10.0);

/// Accepted bias of the force at the start, N.
pub(super) const FORCE_BIAS_N: (f64, f64) = (0.0, 10.0);

/// Accepted drift of that bias, N/s.
pub(super) const FORCE_DRIFT_N_PER_S: (f64, f64) = (0.0, 1.0);

/// Accepted lag of the force, ms.
pub(crate) const FORCE_LAG_MS: (f64, f64) = (0.0, 100.0);

/// Accepted measured force over true force.
pub(super) const FORCE_GAIN: (f64, f64) = (0.5, 2.0);

/// Accepted angle noise, rad r.m.s.
pub(super) const ANGLE_NOISE_RAD: (f64, f64) = (0.0, 1.0);

/// Accepted image rate, Hz; 0 is off.
pub(super) const RATE_HZ: (f64, f64) = (0.0, 1000.0);

/// Accepted latency of an image, ms.
pub(super) const LATENCY_MS: (f64, f64) = (0.0, 10_000.0);

/// How well the slave measures. The defaults are those of the model study.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensingConfig {
    /// Noise of the tool's position, m r.m.s. per axis. Default 10 µm: an arm's encoders.
    pub position_noise_m: f64,
    /// Noise of the force sensor, N r.m.s. per axis. Default 10 mN: a quarter of `F_min`.
    pub force_noise_n: f64,
    /// Bias of the force sensor at the start, N; its direction comes from the seed. Default 0.
    pub force_bias_n: f64,
    /// How fast the bias drifts, N/s, in a direction of its own that comes from the seed. Default 0.
    pub force_drift_n_per_s: f64,
    /// Time constant by which the measured force follows the true one, ms. Default 0.
    pub force_lag_ms: f64,
    /// Measured force over true force. Default 1.
    pub force_gain: f64,
    /// The camera that sees the object.
    pub vision: VisionConfig,
}

/// How the camera sees the object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VisionConfig {
    /// Images per second; 0 turns vision off. Default 30; paper mode's 0, for the paper has none.
    pub rate_hz: f64,
    /// Noise of the position, m r.m.s. per axis. Default 1 mm.
    pub position_noise_m: f64,
    /// Noise of the orientation, rad r.m.s. Default 5 mrad: 1 mm at the edge of a 0.36 m cube.
    pub angle_noise_rad: f64,
    /// Time from the image to its pose, ms. Default 30: one frame.
    pub latency_ms: f64,
    /// Images before the session show how far each face is from the centre, with this error, m r.m.s.; without the
    /// key they show the pose only. Default: without.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_noise_m: Option<f64>,
}

impl Default for SensingConfig {
    fn default() -> Self {
        Self {
            position_noise_m: 10e-6,
            force_noise_n: 10e-3,
            force_bias_n: 0.0,
            force_drift_n_per_s: 0.0,
            force_lag_ms: 0.0,
            force_gain: 1.0,
            vision: VisionConfig::default(),
        }
    }
}

impl Default for VisionConfig {
    fn default() -> Self {
        Self {
            rate_hz: 30.0,
            position_noise_m: 1e-3,
            angle_noise_rad: 5e-3,
            latency_ms: 30.0,
            size_noise_m: None,
        }
    }
}

impl VisionConfig {
    /// No images. The pose at the start is known all the same.
    #[must_use]
    pub fn off() -> Self {
        Self {
            rate_hz: 0.0,
            ..Self::default()
        }
    }
}

/// Why sensing cannot work with these numbers.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SensingError {
    /// A number lies outside its accepted range or is not a number.
    #[error("sensing: {0}")]
    OutOfRange(#[from] OutOfRange),
    /// More images would be on their way than are kept.
    #[error(
        "sensing: {rate_hz} images/s with a latency of {latency_ms} ms keep more than {max} images on their way; lower one of them"
    )]
    TooManyImages {
        /// Images per second.
        rate_hz: f64,
        /// Latency, ms.
        latency_ms: f64,
        /// Most images on their way.
        max: usize,
    },
}

impl SensingConfig {
    /// Sensors without noise and without vision: the truth.
    #[cfg(test)]
    pub(super) fn ideal() -> Self {
        Self {
            position_noise_m: 0.0,
            force_noise_n: 0.0,
            vision: VisionConfig::off(),
            ..Self::default()
        }
    }

    pub(super) fn check(&self) -> Result<(), SensingError> {
        let v = &self.vision;
        #[rustfmt::skip]
        let checks = [
            ("position noise", "m", self.position_noise_m, POSITION_NOISE_M),
            ("force noise", "N", self.force_noise_n, FORCE_NOISE_N),
            ("force bias", "N", self.force_bias_n, FORCE_BIAS_N),
            ("force drift", "N/s", self.force_drift_n_per_s, FORCE_DRIFT_N_PER_S),
            ("force lag", "ms", self.force_lag_ms, FORCE_LAG_MS),
            ("force gain", "", self.force_gain, FORCE_GAIN),
            ("vision rate", "Hz", v.rate_hz, RATE_HZ),
            ("vision position noise", "m", v.position_noise_m, POSITION_NOISE_M),
            ("vision angle noise", "rad", v.angle_noise_rad, ANGLE_NOISE_RAD),
            ("vision latency", "ms", v.latency_ms, LATENCY_MS),
            ("vision size noise", "m", v.size_noise_m.unwrap_or_default(), POSITION_NOISE_M),
        ];
        all_in_range(checks)?;
        if v.rate_hz * v.latency_ms / 1e3 + 2.0 > IMAGES_MAX as f64 {
            return Err(SensingError::TooManyImages {
                rate_hz: v.rate_hz,
                latency_ms: v.latency_ms,
                max: IMAGES_MAX - 2,
            });
        }
        Ok(())
    }
}
