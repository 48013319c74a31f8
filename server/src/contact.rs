//! The tool at the object: it meets a plant, and what is measured of that is made fit to be judged.
//!
//! It must never give the truth to anything but reports.

use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::time::Time;

use crate::conditioning::Conditioner;
use crate::environment::Environment;
use crate::plant::Plant;
use crate::sensing::{Sensing, VisionSample};

/// What is known of the contact in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Position of the tool as measured, m, world frame.
    pub tool: Vec2,
    /// How far it stands back by a spring of its own, m.
    pub back: Vec2,
    /// f_s as measured, less its bias where that is tared, over the sensor's gain where that is found, N, world frame, on the object.
    pub force: Vec2,
    /// The mean of the newest few of these where they are noisy, else the newest, N.
    pub steady: Vec2,
    /// Noise of `force` per axis as measured, N, where it is more than thresholds are made for; else 0.
    pub noise_n: f64,
    /// By the sensor's gain as it is known now, forces of earlier ticks are this many times what was given; 1 where the gain stays.
    pub rescaled: f64,
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

impl Contact {
    /// The same with what is measured in every tick by this `share` on its way to what it was `before`, and no image.
    #[must_use]
    pub(crate) fn towards(&self, before: &Self, share: f64) -> Self {
        Self {
            tool: self.tool.lerp(&before.tool, share),
            back: self.back.lerp(&before.back, share),
            force: self.force.lerp(&before.force, share),
            steady: self.steady.lerp(&before.steady, share),
            vision: None,
            rescaled: 1.0,
            ..*self
        }
    }
}

/// What the tool meets, and what is made of the measured force.
pub struct ContactStage {
    plant: Plant,
    conditioner: Conditioner,
    body: usize,
}

impl ContactStage {
    /// Not in contact with the simulated world.
    #[must_use]
    pub fn new(environment: Environment, sensing: Sensing, conditioner: Conditioner) -> Self {
        let plant = Plant::World {
            environment: Box::new(environment),
            sensing: Box::new(sensing),
        };
        Self::at(plant, conditioner)
    }

    /// The simulated world: the truth.
    #[must_use]
    pub fn environment(&self) -> &Environment {
        self.plant.environment()
    }

    /// Not in contact with a plant.
    #[must_use]
    pub(crate) fn at(plant: Plant, conditioner: Conditioner) -> Self {
        Self {
            plant,
            conditioner,
            body: 0,
        }
    }

    /// What the tool meets.
    #[must_use]
    pub(crate) fn plant(&self) -> &Plant {
        &self.plant
    }

    /// The same, to be changed.
    pub(crate) fn plant_mut(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// Begins with this body as the one that was touched last, and may be still.
    pub fn begin_with(&mut self, body: usize) {
        self.body = body;
        self.conditioner.resume();
    }

    /// Images show the tool clear of everything: what is felt is no contact, unless it is too much to be the sensor's.
    pub fn see_clear(&mut self) {
        self.conditioner.see_clear();
    }

    /// The force's noise per axis as measured, N, where it is more than thresholds are made for; else 0.
    #[must_use]
    pub fn noise_n(&self) -> f64 {
        self.conditioner.noise_n()
    }

    /// Measured force over true force, as contacts have shown it; none where it is not looked for, and before one has.
    #[must_use]
    pub fn sensor_gain(&self) -> Option<f64> {
        self.conditioner.sensor_gain()
    }

    /// So many ticks, after which the tool is at `tool` (m) and has moved at `velocity` (m/s); what is known of the contact then.
    pub fn step(&mut self, now: Time, ticks: u32, tool: Vec2, velocity: Vec2) -> Contact {
        let met = self.plant.meet(now, ticks, tool, velocity, self.body);
        self.body = met.body;
        let sensed = met.sensed;
        let conditioned = self.conditioner.step(sensed.force, sensed.tool);
        Contact {
            tool: sensed.tool,
            back: Vec2::zeros(),
            force: conditioned.force,
            steady: conditioned.steady,
            noise_n: conditioned.noise_n,
            rescaled: conditioned.rescaled,
            in_contact: conditioned.in_contact,
            averaged: conditioned.averaged,
            vision: sensed.vision,
            true_force: met.force,
            truth: met.pose,
            body: met.body,
        }
    }
}
