//! The tool at the object: it meets the environment, and the sensors measure what comes of that.
//!
//! It must never give the truth to anything but reports.

use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::time::Time;

use crate::conditioning::Conditioner;
use crate::environment::Environment;
use crate::sensing::{Sensing, VisionSample};

/// What is known of the contact in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Position of the tool as measured, m, world frame.
    pub tool: Vec2,
    /// f_s as measured, less its bias where that is tared, N, world frame, on the object.
    pub force: Vec2,
    /// The mean of the newest few of these where they are noisy, else the newest, N.
    pub steady: Vec2,
    /// Noise of `force` per axis as measured, N, where it is more than thresholds are made for; else 0.
    pub noise_n: f64,
    /// Whether the tool touches the object, by the measured force.
    pub in_contact: bool,
    /// Samples of the force that (12) is to be judged by, for their noise: 1 or more.
    pub averaged: usize,
    /// The image that has come in this tick.
    pub vision: Option<VisionSample>,
    /// Contact force as it is, N: for reports.
    pub true_force: Vec2,
    /// The object's pose when the tool met it, before it moved on: for reports, and for the first look at another body.
    pub truth: Pose,
    /// Number of the body that is touched, or was last.
    pub body: usize,
}

/// The object, its ground and the slave's sensors.
pub struct ContactStage {
    environment: Environment,
    sensing: Sensing,
    conditioner: Conditioner,
    body: usize,
}

impl ContactStage {
    /// Not in contact.
    #[must_use]
    pub fn new(environment: Environment, sensing: Sensing, conditioner: Conditioner) -> Self {
        Self {
            environment,
            sensing,
            conditioner,
            body: 0,
        }
    }

    /// The real object: the truth.
    #[must_use]
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// The real object, to be changed in mid-run: scenarios do, sessions never.
    pub fn environment_mut(&mut self) -> &mut Environment {
        &mut self.environment
    }

    /// Begins with this body as the one that was touched last, and may be still.
    pub fn begin_with(&mut self, body: usize) {
        self.body = body;
        self.conditioner.resume();
    }

    /// One tick with the tool at `tool` (m), moving at `velocity` (m/s).
    pub fn step(&mut self, now: Time, tool: Vec2, velocity: Vec2) -> Contact {
        let met = self.environment.step(tool, velocity);
        if met.body != self.body {
            self.body = met.body;
            self.sensing.drop_images();
        }
        let sensed = self.sensing.sense(now, tool, met.force, &met.pose);
        let conditioned = self.conditioner.step(sensed.force, sensed.tool);
        Contact {
            tool: sensed.tool,
            force: conditioned.force,
            steady: conditioned.steady,
            noise_n: conditioned.noise_n,
            in_contact: conditioned.in_contact,
            averaged: conditioned.averaged,
            vision: sensed.vision,
            true_force: met.force,
            truth: met.pose,
            body: met.body,
        }
    }
}
