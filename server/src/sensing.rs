//! Sensing: the tool's position, the contact force and the object's pose as the slave measures them.
//!
//! Adds seeded Gaussian noise to position and force at 1 kHz and the force sensor's other errors, and sees the object
//! through "vision": a slow, noisy, delayed camera. Every tick takes the same number of draws whatever the settings,
//! and vision's image k has noise of its own number, so that changing one setting leaves every other noise alone. It
//! must never use anything but its arguments.

mod config;
mod force;
mod lag;

use std::collections::VecDeque;

use mmt_shared::model::geometry::{BoxFootprint, Face, Pose, Vec2};
use mmt_shared::model::params::FACE_OFFSET_M;
use mmt_shared::rng::Substream;
use mmt_shared::time::Time;

pub(crate) use config::FORCE_LAG_MS;
use config::IMAGES_MAX;
pub use config::{SensingConfig, SensingError, VisionConfig};
pub use force::ForceFault;
use force::{ForceSensor, pair};
pub(crate) use lag::SensorLag;

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

/// What of the slave's sensors is broken; by default nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorFaults {
    /// How the force sensor is.
    pub force: Option<ForceFault>,
    /// The camera takes no images.
    pub no_images: bool,
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
    no_images: bool,
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
            no_images: false,
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

    /// From now on this is broken.
    pub fn set_faults(&mut self, faults: SensorFaults) {
        self.force.fault = faults.force;
        self.no_images = faults.no_images;
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
        let is_due = self.period_ns > 0 && now >= *self.next_image.get_or_insert(now);
        if is_due && !self.no_images {
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

#[cfg(test)]
mod tests;
