//! The tool at the object: it meets the environment, and the sensors measure what comes of that.
//!
//! It must never give the truth to anything but reports.

use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::time::Time;

use crate::environment::Environment;
use crate::sensing::{Sensing, VisionSample};
use crate::trigger::ContactDetector;

/// What is known of the contact in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Position of the tool as measured, m, world frame.
    pub tool: Vec2,
    /// f_s as measured, N, world frame, on the object.
    pub force: Vec2,
    /// Whether the tool touches the object, by the measured force.
    pub in_contact: bool,
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
    detector: ContactDetector,
    body: usize,
}

impl ContactStage {
    /// Not in contact.
    #[must_use]
    pub fn new(environment: Environment, sensing: Sensing, detector: ContactDetector) -> Self {
        Self {
            environment,
            sensing,
            detector,
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

    /// Begins with this body as the one that was touched last.
    pub fn begin_with(&mut self, body: usize) {
        self.body = body;
    }

    /// One tick with the tool at `tool` (m), moving at `velocity` (m/s).
    pub fn step(&mut self, now: Time, tool: Vec2, velocity: Vec2) -> Contact {
        let met = self.environment.step(tool, velocity);
        if met.body != self.body {
            self.body = met.body;
            self.sensing.drop_images();
        }
        let sensed = self.sensing.sense(now, tool, met.force, &met.pose);
        Contact {
            tool: sensed.tool,
            force: sensed.force,
            in_contact: self.detector.step(sensed.force.norm()),
            vision: sensed.vision,
            true_force: met.force,
            truth: met.pose,
            body: met.body,
        }
    }
}
