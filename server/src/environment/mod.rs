//! The remote environment: a body on a rough plane, pushed by the slave's position-controlled tool.
//!
//! This is the truth that the estimator looks for. Each step of T = 1 ms: the contact force of the tool
//! on the real surface by (6) with damping (`surface.rs`), the velocity without the ground
//! v* = v + T f/m, omega* = omega + T M/I, ground friction and wall as one implicit step (`ground.rs`),
//! then rapier integrates the pose (`body.rs`). It must never take in a number that is not finite.
//!
//! The object's frame has its origin at the centroid of the footprint; the body moves about its centre of
//! mass, which may lie elsewhere.

mod body;
mod bounded;
mod config;
mod ground;
mod outline;
mod patch;
mod surface;
mod terrain;
mod wall;

pub use bounded::{Bounded, TooLong};
pub use config::{EnvironmentConfig, EnvironmentError};
pub use outline::{OutlineError, Shape, VERTICES_MAX};
pub use terrain::{GroundPatch, PATCHES_MAX, Ripple};
pub use wall::Wall;

use mmt_shared::model::contact::{Coupling, Touch, contact_force};
use mmt_shared::model::geometry::{BoxFootprint, Pose, Twist, Vec2, cross, rotate, spin};
use mmt_shared::model::params::{ModelParams, friction_torque_of_square};
use mmt_shared::time::TICK_S;
use nalgebra::Vector3;

use body::Body;
use ground::Load;
use outline::Outline;
use patch::Patch;
use surface::Surface;
use wall::Limits;

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

/// A body on a plane: the real object, its ground, its wall and the tool's contact with it.
pub struct Environment {
    config: EnvironmentConfig,
    outline: Outline,
    truth: ModelParams,
    load: Load,
    patch: Patch,
    /// Where the patch was weighed by the ground last; none if it has to be weighed anew.
    weighed_at: Option<Pose>,
    body: Body,
    surface: Surface,
    refused: u64,
}

impl Environment {
    /// The environment at rest at the configuration's pose.
    ///
    /// # Errors
    /// Names the first number that is not finite or outside its range.
    pub fn try_new(config: EnvironmentConfig) -> Result<Self, EnvironmentError> {
        let outline = config.outline()?;
        config.check(&outline)?;
        config.check_start(&outline)?;
        let truth = config.truth(&outline)?;
        let load = load(&config, &outline, &truth);
        let Pose { position, angle } = config.pose;
        let centre_of_mass = Pose {
            position: position + rotate(angle, config.centre_of_mass_m),
            angle,
        };
        Ok(Self {
            truth,
            load,
            patch: patch(&config, &outline),
            weighed_at: None,
            body: Body::new(load.m, load.inertia, centre_of_mass),
            surface: surface(&config, &outline),
            refused: 0,
            config,
            outline,
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

    /// Advances T = 1 ms under a force (N) at the centroid and a torque (N m), both in the world frame,
    /// without a tool. A wrench that is not finite counts as none and is counted.
    pub fn step_with_wrench(&mut self, force: Vec2, torque: f64) {
        let (force, torque) = if within(&[force.x, force.y, torque]) {
            (force, torque)
        } else {
            self.refused += 1;
            (Vec2::zeros(), 0.0)
        };
        self.weigh();
        let (pose, twist, load) = (self.pose(), self.body.twist(), &self.load);
        let (angle, centre_of_mass) = (pose.angle, load.centre_of_mass);
        let v = rotate(-angle, twist.linear);
        let before = Vector3::new(v.x, v.y, twist.angular);
        let force = rotate(-angle, force);
        let torque = torque - cross(centre_of_mass, force);
        // v* = v + T f/m, omega* = omega + T M/I
        let gain = force * (TICK_S / load.m);
        let free = before + Vector3::new(gain.x, gain.y, torque * TICK_S / load.inertia);
        let limits = self.config.wall.map_or_else(Limits::default, |wall| {
            wall.limits(&self.outline, &pose, centre_of_mass, &before)
        });
        let u = self.patch.step(load, &limits, before, free);
        self.body.advance(Twist {
            linear: rotate(angle, u.xy()),
            angular: u.z,
        });
    }

    /// Position of the footprint's centroid and orientation of the object: `world_from_object`.
    #[must_use]
    pub fn pose(&self) -> Pose {
        let Pose { position, angle } = self.body.pose();
        Pose {
            position: position - self.centre_of_mass(),
            angle,
        }
    }

    /// Velocity of the footprint's centroid in the world, and the object's turning rate.
    #[must_use]
    pub fn twist(&self) -> Twist {
        let twist = self.body.twist();
        let offset = self.centre_of_mass();
        Twist {
            linear: twist.linear - spin(twist.angular, offset),
            angular: twist.angular,
        }
    }

    /// The bounding box of the object's real footprint, about the footprint's centroid.
    #[must_use]
    pub fn footprint(&self) -> BoxFootprint {
        self.outline.bounding_box()
    }

    /// The real m, b and c = mu m g of sliding on the ground outside of ripple and patches, and I and e of
    /// the real footprint ((8) and (9) for a square): what a perfect estimator would find.
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
        let offset = self.centre_of_mass();
        self.body.set_twist(Twist {
            linear: twist.linear + spin(twist.angular, offset),
            angular: twist.angular,
        });
    }

    /// Kinetic energy of the object, J.
    #[must_use]
    pub fn kinetic_energy(&self) -> f64 {
        let twist = self.body.twist();
        0.5 * self.load.m * twist.linear.norm_squared()
            + 0.5 * self.load.inertia * twist.angular * twist.angular
    }

    /// The centre of mass from the centroid, world frame, m.
    fn centre_of_mass(&self) -> Vec2 {
        let offset = self.load.centre_of_mass;
        if offset == Vec2::zeros() {
            return offset;
        }
        rotate(self.body.pose().angle, offset)
    }

    fn reconfigure(&mut self, config: EnvironmentConfig) -> Result<(), EnvironmentError> {
        config.check(&self.outline)?;
        self.truth = config.truth(&self.outline)?;
        self.load = load(&config, &self.outline, &self.truth);
        self.config = config;
        self.weighed_at = None;
        Ok(())
    }

    /// Weighs the patch by the ground under it, if the ground differs and the body has moved.
    fn weigh(&mut self) {
        let at = self.body.pose();
        let terrain = self.config.terrain();
        if terrain.is_plain() || self.weighed_at == Some(at) {
            return;
        }
        let (sin, cos) = libm::sincos(at.angle);
        self.patch.weigh(|point| {
            let turned = Vec2::new(cos * point.x - sin * point.y, sin * point.x + cos * point.y);
            terrain.mu(at.position + turned)
        });
        self.weighed_at = Some(at);
    }

    fn touch(&mut self, tool: Vec2, tool_velocity: Vec2) -> Contact {
        if !within(&[tool.x, tool.y, tool_velocity.x, tool_velocity.y]) {
            self.refused += 1;
            return Contact::default();
        }
        let (pose, twist) = (self.pose(), self.twist());
        let touch = self.surface.follow(&pose, tool);
        let coupling: &Coupling = &self.config.coupling;
        let force = touch.map_or_else(Vec2::zeros, |touch| {
            contact_force(coupling, &touch, tool_velocity, &twist, pose.position)
        });
        Contact { force, touch }
    }
}

fn load(config: &EnvironmentConfig, outline: &Outline, truth: &ModelParams) -> Load {
    Load {
        m: truth.m(),
        inertia: truth.inertia(),
        b: truth.b(),
        b_r: config.rotational_damping(outline),
        c: if config.terrain().is_plain() {
            truth.c()
        } else {
            // each point's weight is its mu
            truth.m() * config.gravity_m_per_s2
        },
        e: truth.e(),
        static_ratio: config.static_ratio,
        centre_of_mass: config.centre_of_mass_m,
    }
}

fn patch(config: &EnvironmentConfig, outline: &Outline) -> Patch {
    let centre_of_mass = config.centre_of_mass_m;
    match (&config.shape, outline) {
        (Shape::Square, _) => {
            let (side, arm) = (config.side_m, friction_torque_of_square(1.0, config.side_m));
            Patch::rectangle(side, side, arm, centre_of_mass)
        }
        (Shape::Brick { length_m, width_m }, _) => {
            Patch::rectangle(*length_m, *width_m, outline.mean_arm(), centre_of_mass)
        }
        (_, Outline::Circle(radius)) => Patch::disc(*radius, outline.mean_arm(), centre_of_mass),
        (_, Outline::Corners(corners)) => {
            Patch::polygon(corners.as_slice(), outline.mean_arm(), centre_of_mass)
        }
    }
}

fn surface(config: &EnvironmentConfig, outline: &Outline) -> Surface {
    match (&config.shape, outline) {
        (Shape::Square | Shape::Brick { .. }, _) => Surface::of_box(outline.bounding_box()),
        (_, Outline::Circle(radius)) => Surface::disc(*radius),
        (_, Outline::Corners(corners)) => Surface::polygon(corners.as_slice()),
    }
}

/// The choke point for what comes from outside: every number finite and not absurd.
fn within(numbers: &[f64]) -> bool {
    numbers.iter().all(|number| number.abs() <= WRENCH_MAX)
}

#[cfg(test)]
mod tests;
