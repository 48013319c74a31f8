//! Sensing: the tool's position, the contact force and the object's pose as the slave measures them.
//!
//! Adds seeded Gaussian noise to position and force at 1 kHz and the force sensor's other errors, and sees the object
//! through "vision": a slow, noisy, delayed camera. Every tick takes the same number of draws whatever the settings,
//! and vision's image k has noise of its own number, so that changing one setting leaves every other noise alone. It
//! must never use anything but its arguments.

mod force;

use std::collections::VecDeque;

use mmt_shared::model::geometry::{BoxFootprint, Face, Pose, Vec2};
use mmt_shared::model::params::FACE_OFFSET_M;
use mmt_shared::range::{OutOfRange, all_in_range};
use mmt_shared::rng::Substream;
use mmt_shared::time::Time;
use serde::{Deserialize, Serialize};

use force::ForceSensor;

/// Most images on their way at a time: a second of latency at 60 Hz.
const IMAGES_MAX: usize = 64;
/// Accepted position noise, m r.m.s.
const POSITION_NOISE_M: (f64, f64) = (0.0, 0.1);
/// Accepted force noise, N r.m.s.
const FORCE_NOISE_N: (f64, f64) = (0.0, 10.0);
/// Accepted bias of the force at the start, N.
const FORCE_BIAS_N: (f64, f64) = (0.0, 10.0);
/// Accepted drift of that bias, N/s.
const FORCE_DRIFT_N_PER_S: (f64, f64) = (0.0, 1.0);
/// Accepted lag of the force, ms.
const FORCE_LAG_MS: (f64, f64) = (0.0, 100.0);
/// Accepted measured force over true force.
const FORCE_GAIN: (f64, f64) = (0.5, 2.0);
/// Accepted angle noise, rad r.m.s.
const ANGLE_NOISE_RAD: (f64, f64) = (0.0, 1.0);
/// Accepted image rate, Hz; 0 is off.
const RATE_HZ: (f64, f64) = (0.0, 1000.0);
/// Accepted latency of an image, ms.
const LATENCY_MS: (f64, f64) = (0.0, 10_000.0);

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

/// What vision saw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisionSample {
    /// When the image was taken, by the slave's clock; it is delivered later.
    pub taken: Time,
    /// The object's pose as seen then.
    pub pose: Pose,
}

/// What the slave measures in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensed {
    /// Position of the tool, world frame, m.
    pub tool: Vec2,
    /// Contact force `f_s` on the object, world frame, N: the sensor's sample.
    pub force: Vec2,
    /// The newest image whose latency has passed, once.
    pub vision: Option<VisionSample>,
}

/// The slave's sensors.
#[derive(Clone, Debug)]
pub struct Sensing {
    config: SensingConfig,
    seed: u64,
    position_noise: Substream,
    force: ForceSensor,
    period_ns: u64,
    latency_ns: i64,
    /// When the next image is taken; none before the first tick.
    next_image: Option<Time>,
    images_taken: u64,
    on_their_way: VecDeque<VisionSample>,
    /// The last tick.
    last: Option<Time>,
    dropped: u64,
}

impl Sensing {
    /// The sensors of a configuration, their noise drawn from `seed`.
    ///
    /// # Errors
    /// Names the first number that is outside its range.
    pub fn try_new(config: SensingConfig, seed: u64) -> Result<Self, SensingError> {
        config.check()?;
        let vision = config.vision;
        let period_ns = if vision.rate_hz > 0.0 {
            (1e9 / vision.rate_hz) as u64
        } else {
            0
        };
        Ok(Self {
            config,
            seed,
            position_noise: Substream::new(seed, "slave/position-noise", 0),
            force: ForceSensor::new(&config, seed),
            period_ns,
            latency_ns: (vision.latency_ms * 1e6) as i64,
            next_image: None,
            images_taken: 0,
            on_their_way: VecDeque::with_capacity(IMAGES_MAX),
            last: None,
            dropped: 0,
        })
    }

    /// Measures once, at 1 kHz: the true tool (m) and contact force (N) in the world, the true pose.
    pub fn sense(&mut self, now: Time, tool: Vec2, force: Vec2, object: &Pose) -> Sensed {
        let tool = tool + pair(&mut self.position_noise) * self.config.position_noise_m;
        Sensed {
            tool,
            force: self.force.measure(force),
            vision: self.image_due(now, object),
        }
    }

    /// How many images were lost because a newer one was due with them or too many were on their way.
    #[must_use]
    pub fn images_dropped(&self) -> u64 {
        self.dropped
    }

    /// Drops the images that are on their way: they show another body than the one that is touched now.
    pub fn drop_images(&mut self) {
        self.dropped += self.on_their_way.len() as u64;
        self.on_their_way.clear();
    }

    fn image_due(&mut self, now: Time, object: &Pose) -> Option<VisionSample> {
        if self.last.replace(now).is_some_and(|last| last > now) {
            // the clock was set back: when these were taken means nothing any more
            self.drop_images();
            self.next_image = Some(now);
        }
        if self.period_ns > 0 && now >= *self.next_image.get_or_insert(now) {
            self.take_image(now, object);
        }
        let mut newest = None;
        while let Some(image) = self.on_their_way.front().copied() {
            if image.taken.offset_by(self.latency_ns) > now {
                break;
            }
            self.on_their_way.pop_front();
            self.dropped += u64::from(newest.replace(image).is_some());
        }
        newest
    }

    fn take_image(&mut self, now: Time, object: &Pose) {
        let vision = self.config.vision;
        let period = i64::try_from(self.period_ns).unwrap_or(i64::MAX);
        // the schedule keeps its phase, unless ticks were missed for longer than a period
        let planned = self.next_image.unwrap_or(now).offset_by(period);
        self.next_image = Some(planned.max(now.offset_by(1)));
        let mut noise = Substream::new(self.seed, "slave/vision-noise", self.images_taken);
        self.images_taken += 1;
        let shift = pair(&mut noise) * vision.position_noise_m;
        if self.on_their_way.len() >= IMAGES_MAX {
            self.on_their_way.pop_front();
            self.dropped += 1;
        }
        self.on_their_way.push_back(VisionSample {
            taken: now,
            pose: Pose {
                position: object.position + shift,
                angle: object.angle + noise.normal() * vision.angle_noise_rad,
            },
        });
    }
}

/// Footprints as images before the session show them, in the order of the bodies; none where they show no size.
pub(crate) fn sizes_seen(
    vision: &VisionConfig,
    seed: u64,
    truth: Vec<BoxFootprint>,
) -> Vec<BoxFootprint> {
    let Some(error) = vision.size_noise_m.filter(|_| vision.rate_hz > 0.0) else {
        return Vec::new();
    };
    let mut seen = truth;
    for (number, footprint) in (0..).zip(&mut seen) {
        let mut noise = Substream::new(seed, "slave/size-noise", number);
        for face in Face::ALL {
            let offset = footprint.offset(face) + error * noise.normal();
            footprint.set_offset(face, offset.clamp(FACE_OFFSET_M.0, FACE_OFFSET_M.1));
        }
    }
    seen
}

fn pair(stream: &mut Substream) -> Vec2 {
    let (x, y) = stream.normal_pair();
    Vec2::new(x, y)
}

impl SensingConfig {
    /// Sensors without noise and without vision: the truth, for tests and reference runs.
    #[must_use]
    pub fn ideal() -> Self {
        Self {
            position_noise_m: 0.0,
            force_noise_n: 0.0,
            vision: VisionConfig::off(),
            ..Self::default()
        }
    }

    fn check(&self) -> Result<(), SensingError> {
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

#[cfg(test)]
mod tests;
