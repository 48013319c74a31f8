//! The remote environment: a body on a rough plane, pushed by the slave's position-controlled tool.
//!
//! This is the truth that the estimator looks for. Each step of T = 1 ms: the contact force of the tool
//! on the real surface by (6) with damping, the velocity without the ground
//! v* = v + T f/m, omega* = omega + T M/I, ground friction as one implicit step (`ground.rs`), then rapier
//! integrates the pose (`body.rs`). It must never take in a number that is not finite.

mod body;
mod config;
mod ground;

pub use config::{EnvironmentConfig, EnvironmentError};

use mmt_shared::contact::{Coupling, GodObject, Touch, contact_force};
use mmt_shared::geometry::{BoxFootprint, Pose, Twist, Vec2, cross, rotate};
use mmt_shared::params::ModelParams;
use mmt_shared::time::TICK_S;
use nalgebra::Vector3;

use body::Body;
use ground::{Load, Patch};

/// Greatest force (N) and torque (N m) taken in; beyond, a wrench counts as not finite.
const WRENCH_MAX: f64 = 1e6;

/// What the tool met in one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contact {
    /// Contact force f on the object, world frame, N; positive when the tool pushes.
    pub force: Vec2,
    /// Where the tool touches; none in free space. The force acts at its proxy.
    pub touch: Option<Touch>,
}

/// A cube on a plane: the real object, its ground and the tool's contact with it.
pub struct Environment {
    config: EnvironmentConfig,
    truth: ModelParams,
    load: Load,
    footprint: BoxFootprint,
    patch: Patch,
    body: Body,
    tool: GodObject,
    refused: u64,
}

impl Environment {
    /// The environment at rest at the configuration's pose.
    ///
    /// # Errors
    /// Names the first number that is not finite or outside its range.
    pub fn try_new(config: EnvironmentConfig) -> Result<Self, EnvironmentError> {
        config.check()?;
        let truth = config.truth()?;
        let load = load(&config, &truth);
        Ok(Self {
            truth,
            load,
            footprint: BoxFootprint::square(config.side_m),
            patch: Patch::square(config.side_m),
            body: Body::square(config.side_m, load.m, load.inertia, config.pose),
            tool: GodObject::default(),
            refused: 0,
            config,
        })
    }

    /// Advances T = 1 ms with the tool at `tool` (m) moving at `tool_velocity` (m/s), both world frame.
    ///
    /// Returns the contact at the beginning of the step: the object's pose of before, the tool of now.
    /// A tool that is not finite touches nothing and is counted.
    pub fn step(&mut self, tool: Vec2, tool_velocity: Vec2) -> Contact {
        let contact = self.touch(tool, tool_velocity);
        let lever = contact
            .touch
            .map_or_else(Vec2::zeros, |touch| touch.proxy - self.pose().position);
        self.step_with_wrench(contact.force, cross(lever, contact.force));
        contact
    }

    /// Advances T = 1 ms under a force (N) at the centre and a torque (N m), both in the world frame,
    /// without a tool. A wrench that is not finite counts as none and is counted.
    pub fn step_with_wrench(&mut self, force: Vec2, torque: f64) {
        let (force, torque) = if within(&[force.x, force.y, torque]) {
            (force, torque)
        } else {
            self.refused += 1;
            (Vec2::zeros(), 0.0)
        };
        let (angle, twist, load) = (self.pose().angle, self.twist(), &self.load);
        let v = rotate(-angle, twist.linear);
        let before = Vector3::new(v.x, v.y, twist.angular);
        // v* = v + T f/m, omega* = omega + T M/I
        let gain = rotate(-angle, force) * (TICK_S / load.m);
        let gained = Vector3::new(gain.x, gain.y, torque * TICK_S / load.inertia);
        let u = self.patch.step(load, before, before + gained);
        self.body.advance(Twist {
            linear: rotate(angle, u.xy()),
            angular: u.z,
        });
    }

    /// Position and orientation of the object: `world_from_object`.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.body.pose()
    }

    /// Velocity of the object's centre in the world, and its turning rate.
    #[must_use]
    pub fn twist(&self) -> Twist {
        self.body.twist()
    }

    /// The object's real footprint.
    #[must_use]
    pub fn footprint(&self) -> BoxFootprint {
        self.footprint
    }

    /// The real m, b, c = mu m g, I by (8) and e by (9): what a perfect estimator would find.
    #[must_use]
    pub fn truth(&self) -> ModelParams {
        self.truth
    }

    /// The configuration, with the changes made since the start except for pose.
    #[must_use]
    pub fn config(&self) -> &EnvironmentConfig {
        &self.config
    }

    /// How many tools and wrenches were refused because they were not finite.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Changes the friction coefficient mu from the next step on.
    ///
    /// # Errors
    /// As [`Environment::try_new`]; nothing is changed then.
    pub fn set_friction(&mut self, mu: f64) -> Result<(), EnvironmentError> {
        self.reconfigure(EnvironmentConfig {
            friction_coefficient: mu,
            ..self.config
        })
    }

    /// Changes the mass m (kg), and with it c, I and e, from the next step on. The velocity stays.
    ///
    /// # Errors
    /// As [`Environment::try_new`]; nothing is changed then.
    pub fn set_mass(&mut self, m: f64) -> Result<(), EnvironmentError> {
        self.reconfigure(EnvironmentConfig {
            mass_kg: m,
            ..self.config
        })?;
        self.body.set_inertia(self.load.m, self.load.inertia);
        Ok(())
    }

    /// Gives the object a velocity, at once: initial conditions of tests and studies.
    pub fn set_twist(&mut self, twist: Twist) {
        self.body.set_twist(twist);
    }

    /// Kinetic energy of the object, J.
    #[must_use]
    pub fn kinetic_energy(&self) -> f64 {
        let twist = self.twist();
        0.5 * self.load.m * twist.linear.norm_squared()
            + 0.5 * self.load.inertia * twist.angular * twist.angular
    }

    fn reconfigure(&mut self, config: EnvironmentConfig) -> Result<(), EnvironmentError> {
        config.check()?;
        self.truth = config.truth()?;
        self.load = load(&config, &self.truth);
        self.config = config;
        Ok(())
    }

    fn touch(&mut self, tool: Vec2, tool_velocity: Vec2) -> Contact {
        if !within(&[tool.x, tool.y, tool_velocity.x, tool_velocity.y]) {
            self.refused += 1;
            return Contact::default();
        }
        let (pose, twist) = (self.pose(), self.twist());
        let touch = self.tool.follow(&self.footprint, &pose, tool);
        let coupling: &Coupling = &self.config.coupling;
        let force = touch.map_or_else(Vec2::zeros, |touch| {
            contact_force(coupling, &touch, tool_velocity, &twist, pose.position)
        });
        Contact { force, touch }
    }
}

fn load(config: &EnvironmentConfig, truth: &ModelParams) -> Load {
    Load {
        m: truth.m(),
        inertia: truth.inertia(),
        b: truth.b(),
        b_r: config.rotational_damping(),
        c: truth.c(),
        e: truth.e(),
    }
}

/// The choke point for what comes from outside: every number finite and not absurd.
fn within(numbers: &[f64]) -> bool {
    numbers.iter().all(|number| number.abs() <= WRENCH_MAX)
}

#[cfg(test)]
mod tests;
