//! The remote environment: bodies on a rough plane, one of them pushed by the slave's position-controlled tool.
//!
//! This is the truth that the estimator looks for. Each step of T = 1 ms: the contact force of the tool on the real
//! surface by (6) with damping (`surface.rs`), the velocity without ground and contacts v* = v + T f/m,
//! omega* = omega + T M/I, then ground friction (`ground.rs`) and contacts (`world.rs`) in turn until they
//! agree; rapier moves the bodies. It must never take in a number that is not finite.
//!
//! A body's frame has its origin at the centroid of the footprint; the body moves about its centre of
//! mass, which may lie elsewhere.

mod bounded;
mod config;
mod ground;
mod object;
mod outline;
mod patch;
mod scene;
mod solid;
mod surface;
mod terrain;
mod wall;
mod world;

pub use bounded::{Bounded, TooLong};
pub(crate) use config::SIDE_M;
pub use config::{EnvironmentConfig, EnvironmentError};
pub use outline::{OutlineError, Shape, VERTICES_MAX};
pub use scene::{BodyConfig, SceneConfig};
pub use terrain::{GroundPatch, PATCHES_MAX, Ripple};
pub use wall::Wall;

use mmt_shared::model::contact::Touch;
use mmt_shared::model::geometry::{BoxFootprint, Pose, Twist, Vec2, cross};
use mmt_shared::model::params::ModelParams;

use object::Object;
use world::World;

/// Greatest force (N) and torque (N m) taken in; beyond, a wrench counts as not finite.
const WRENCH_MAX: f64 = 1e6;
/// Ground and contacts agree when no point of a body differs by more than this, m/s: 10 s of it are 10 nm.
const AGREED_M_PER_S: f64 = 1e-9;
/// Most rounds of ground and contacts in a period. One is usual, twenty where bodies strike; what is left after
/// these goes on in the next period.
const ROUNDS_MAX: usize = 60;

/// A tool that is put before a surface is this far from it, m.
const CLEAR_M: f64 = 1e-3;
/// Most surfaces that a place is looked for in front of: bodies that touch each other leave few.
const PLACES_MAX: usize = 16;

/// What the tool met in one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contact {
    /// Contact force f on the object, world frame, N; positive when the tool pushes.
    pub force: Vec2,
    /// Where the tool touches; none in free space. The force acts at its proxy.
    pub touch: Option<Touch>,
    /// Number of the body that is touched, or was last.
    pub body: usize,
    /// Pose of that body at the beginning of the step.
    pub pose: Pose,
}

/// Bodies on a plane: the real objects, their ground, walls, and the tool's contact with one of them.
///
/// The body that the tool touches, or touched last, is what `pose`, `twist`, `footprint`, `truth` and the methods
/// that change something are about. At the start it is the first of the scene.
pub struct Environment {
    touched: Object,
    others: Vec<Object>,
    world: World,
    refused: u64,
}

impl Environment {
    /// One body at rest at the configuration's pose.
    ///
    /// # Errors
    /// Names the first number that is not finite or outside its range.
    pub fn try_new(config: EnvironmentConfig) -> Result<Self, EnvironmentError> {
        Self::of_scene(config, &SceneConfig::default())
    }

    /// The bodies of a scene at rest, on the ground of `config`; of a scene without bodies the body of `config`.
    ///
    /// # Errors
    /// As [`Environment::try_new`], and when two bodies, or a body and a wall, are in each other at the start.
    pub fn of_scene(
        config: EnvironmentConfig,
        scene: &SceneConfig,
    ) -> Result<Self, EnvironmentError> {
        let mut world = World::new();
        let (touched, others) = scene.objects(&config, &mut world)?;
        Ok(Self {
            touched,
            others,
            world,
            refused: 0,
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
            .map_or_else(Vec2::zeros, |touch| touch.proxy - contact.pose.position);
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
        self.touched.begin(force, torque);
        for other in &mut self.others {
            other.begin(Vec2::zeros(), 0.0);
        }
        let Self {
            touched,
            others,
            world,
            ..
        } = self;
        for round in 0..ROUNDS_MAX {
            all(touched, others).for_each(|object| object.slide(world, round == 0));
            world.step();
            let changes = all(touched, others).map(|object| object.take(world));
            if changes.fold(0.0, f64::max) <= AGREED_M_PER_S {
                break;
            }
        }
        let deep = world.is_deep();
        all(touched, others).for_each(|object| object.end(world));
        if deep {
            all(touched, others).for_each(|object| object.body.give(world, Twist::default(), true));
            world.part();
            all(touched, others).for_each(|object| object.body.accept_parted(world));
        }
    }

    /// Position of the footprint's centroid and orientation of the object: `world_from_object`.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.touched.pose()
    }

    /// Velocity of the footprint's centroid in the world, and the object's turning rate.
    #[must_use]
    pub fn twist(&self) -> Twist {
        self.touched.twist()
    }

    /// Pose of a body by its number in the scene, from 0; none if there is no such body.
    #[must_use]
    pub fn pose_of(&self, number: usize) -> Option<Pose> {
        let mut objects = std::iter::once(&self.touched).chain(&self.others);
        objects
            .find(|object| object.number == number)
            .map(Object::pose)
    }

    /// Poses of all bodies, in the order of their numbers.
    #[must_use]
    pub fn poses(&self) -> Vec<Pose> {
        (0..=self.others.len())
            .filter_map(|number| self.pose_of(number))
            .collect()
    }

    /// Puts movable bodies at rest at these poses, in the order of their numbers.
    pub fn place(&mut self, poses: &[Pose]) {
        let Self {
            touched,
            others,
            world,
            ..
        } = self;
        for object in all(touched, others) {
            if let Some(pose) = poses.get(object.number) {
                object.place(world, *pose);
            }
        }
    }

    /// The place nearest to `tool` (m) where a tool touches no body: in front of the surface that it is behind.
    #[must_use]
    pub fn free_place(&mut self, tool: Vec2) -> Vec2 {
        let mut place = tool;
        for _ in 0..PLACES_MAX {
            let Some(touch) = self.touch(place, Vec2::zeros()).touch else {
                break;
            };
            place = touch.proxy - touch.inward * CLEAR_M;
        }
        place
    }

    /// The force of a tool that stands at this place (m) on what it touches there, N.
    pub fn force_at(&mut self, tool: Vec2) -> Vec2 {
        self.touch(tool, Vec2::zeros()).force
    }

    /// Takes another body for the one that is touched: initial conditions of tests and studies.
    ///
    /// Without such a body nothing changes.
    pub fn select(&mut self, number: usize) {
        let mut others = self.others.iter_mut();
        if let Some(other) = others.find(|other| other.number == number) {
            std::mem::swap(&mut self.touched, other);
        }
    }

    /// The bounding box of the object's real footprint, about the footprint's centroid.
    #[must_use]
    pub fn footprint(&self) -> BoxFootprint {
        self.touched.outline.bounding_box()
    }

    /// The bounding boxes of all bodies, in the order of their numbers.
    #[must_use]
    pub fn footprints(&self) -> Vec<BoxFootprint> {
        let mut objects: Vec<&Object> =
            std::iter::once(&self.touched).chain(&self.others).collect();
        objects.sort_by_key(|object| object.number);
        let boxes = objects.iter().map(|object| object.outline.bounding_box());
        boxes.collect()
    }

    /// The real m, b and c = mu m g of sliding on the ground outside of ripple and patches, and I and e of
    /// the real footprint ((8) and (9) for a square): what a perfect estimator would find. Of a fixed body: were it
    /// free.
    #[must_use]
    pub fn truth(&self) -> ModelParams {
        self.touched.truth
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
        let config = EnvironmentConfig {
            friction_coefficient: mu,
            ..self.touched.config
        };
        self.touched.reconfigure(config, &mut self.world)
    }

    /// Changes the mass m (kg), and with it c, I and e, from the next step on. The velocity stays.
    ///
    /// # Errors
    /// As [`Environment::try_new`]; nothing is changed then.
    pub fn set_mass(&mut self, m: f64) -> Result<(), EnvironmentError> {
        let config = EnvironmentConfig {
            mass_kg: m,
            ..self.touched.config
        };
        self.touched.reconfigure(config, &mut self.world)
    }

    /// Gives the object a velocity, at once: initial conditions of tests and studies.
    pub fn set_twist(&mut self, twist: Twist) {
        self.touched.set_twist(twist);
    }

    /// Kinetic energy of all bodies, J.
    #[must_use]
    pub fn kinetic_energy(&self) -> f64 {
        let others = self.others.iter().map(Object::kinetic_energy);
        others.fold(self.touched.kinetic_energy(), |sum, energy| sum + energy)
    }

    /// The contact of the tool. While it touches a body, it is that one that it touches.
    fn touch(&mut self, tool: Vec2, tool_velocity: Vec2) -> Contact {
        let mut met = None;
        if within(&[tool.x, tool.y, tool_velocity.x, tool_velocity.y]) {
            met = self.touched.touch(tool, tool_velocity);
            let mut entered = None;
            for other in &mut self.others {
                // each surface follows the tool, to know where it was entered
                let touch = other.touch(tool, tool_velocity);
                if met.is_none() && touch.is_some() {
                    met = touch;
                    entered = Some(other.number);
                }
            }
            if let Some(number) = entered {
                self.select(number);
            }
        } else {
            self.refused += 1;
        }
        Contact {
            force: met.map_or_else(Vec2::zeros, |(_, force)| force),
            touch: met.map(|(touch, _)| touch),
            body: self.touched.number,
            pose: self.touched.pose(),
        }
    }
}

fn all<'a>(
    touched: &'a mut Object,
    others: &'a mut [Object],
) -> impl Iterator<Item = &'a mut Object> {
    std::iter::once(touched).chain(others)
}

/// The choke point for what comes from outside: every number finite and not absurd.
fn within(numbers: &[f64]) -> bool {
    numbers.iter().all(|number| number.abs() <= WRENCH_MAX)
}

#[cfg(test)]
mod tests;
