//! One body on the plane: its ground, its surface, and its part in the solution of a period.
//!
//! In each round of a period the body slides as its ground allows, given what contacts gave it in the round
//! before (`slide`); then the engine solves the contacts, given what the ground took (`take`).

use mmt_shared::model::contact::{Touch, contact_force};
use mmt_shared::model::geometry::{Pose, Twist, Vec2, cross, rotate, spin};
use mmt_shared::model::params::{ModelParams, friction_torque_of_square};
use mmt_shared::time::TICK_S;
use nalgebra::Vector3;

use super::config::{EnvironmentConfig, EnvironmentError};
use super::ground::Load;
use super::outline::{Outline, OutlineError, Shape};
use super::patch::Patch;
use super::solid::{Skin, Solid};
use super::surface::Surface;
use super::world::{Body, World, admitted};

/// A movable or fixed body.
pub(super) struct Object {
    /// Its place in the scene.
    pub(super) number: usize,
    pub(super) fixed: bool,
    pub(super) config: EnvironmentConfig,
    pub(super) outline: Outline,
    pub(super) truth: ModelParams,
    pub(super) solid: Solid,
    pub(super) body: Body,
    load: Load,
    patch: Patch,
    /// Where the patch was weighed by the ground last; none if it has to be weighed anew.
    weighed_at: Option<Pose>,
    surface: Surface,
    /// Velocity of the centre of mass before the period and without ground and contacts, body frame.
    before: Vector3<f64>,
    free: Vector3<f64>,
    /// Velocity as the ground allows, given `gained`.
    slid: Twist,
    /// What contacts gave in the last round: velocity of the centre of mass. Kept from period to period as the start
    /// of the search.
    gained: Twist,
}

impl Object {
    /// The body at rest at the configuration's pose, not colliding with anything.
    pub(super) fn try_new(
        number: usize,
        config: EnvironmentConfig,
        fixed: bool,
        world: &mut World,
    ) -> Result<Self, EnvironmentError> {
        let outline = config.outline()?;
        config.check(&outline)?;
        let truth = config.truth(&outline)?;
        let solid = Solid::try_new(&config.shape, &outline).ok_or(OutlineError::Crossing)?;
        let load = load(&config, &outline, &truth);
        let Pose { position, angle } = config.pose;
        let centre_of_mass = Pose {
            position: position + rotate(angle, config.centre_of_mass_m),
            angle,
        };
        let mass = (!fixed).then_some((load.m, load.inertia));
        Ok(Self {
            number,
            fixed,
            truth,
            load,
            patch: patch(&config, &outline),
            weighed_at: None,
            body: world.insert(mass, centre_of_mass),
            surface: surface(&config, &outline, &solid),
            before: Vector3::zeros(),
            free: Vector3::zeros(),
            slid: Twist::default(),
            gained: Twist::default(),
            solid,
            config,
            outline,
        })
    }

    /// Position of the footprint's centroid and orientation of the object: `world_from_object`.
    pub(super) fn pose(&self) -> Pose {
        let Pose { position, angle } = self.body.pose();
        Pose {
            position: position - self.centre_of_mass(),
            angle,
        }
    }

    /// Velocity of the footprint's centroid in the world, and the object's turning rate.
    pub(super) fn twist(&self) -> Twist {
        let twist = self.body.twist();
        let offset = self.centre_of_mass();
        Twist {
            linear: twist.linear - spin(twist.angular, offset),
            angular: twist.angular,
        }
    }

    /// Puts a movable body at rest at `pose`, its centroid's.
    pub(super) fn place(&mut self, world: &mut World, pose: Pose) {
        if self.fixed {
            return;
        }
        let Pose { position, angle } = pose;
        let position = position + rotate(angle, self.load.centre_of_mass);
        self.body.place(world, Pose { position, angle });
        self.gained = Twist::default();
    }

    /// Gives a movable body a velocity of its centroid, at once.
    pub(super) fn set_twist(&mut self, twist: Twist) {
        if self.fixed {
            return;
        }
        let offset = self.centre_of_mass();
        self.body.set_twist(Twist {
            linear: twist.linear + spin(twist.angular, offset),
            angular: twist.angular,
        });
    }

    /// Kinetic energy, J.
    pub(super) fn kinetic_energy(&self) -> f64 {
        let twist = self.body.twist();
        0.5 * self.load.m * twist.linear.norm_squared()
            + 0.5 * self.load.inertia * twist.angular * twist.angular
    }

    /// Takes other numbers from the next step on; the velocity stays.
    pub(super) fn reconfigure(
        &mut self,
        config: EnvironmentConfig,
        world: &mut World,
    ) -> Result<(), EnvironmentError> {
        config.check(&self.outline)?;
        self.truth = config.truth(&self.outline)?;
        self.load = load(&config, &self.outline, &self.truth);
        self.config = config;
        self.weighed_at = None;
        if !self.fixed {
            let Load { m, inertia, .. } = self.load;
            self.body.set_inertia(world, m, inertia);
        }
        Ok(())
    }

    /// Follows the tool (m, m/s): what it touches of this body, and the force on it, N.
    pub(super) fn touch(&mut self, tool: Vec2, tool_velocity: Vec2) -> Option<(Touch, Vec2)> {
        let (pose, twist) = (self.pose(), self.twist());
        let touch = self.surface.follow(&pose, tool)?;
        let coupling = self.config.real_contact();
        let force = contact_force(&coupling, &touch, tool_velocity, &twist, pose.position);
        Some((touch, force))
    }

    /// Begins a period under a force (N) at the centroid and a torque (N m), world frame: v* and omega*.
    pub(super) fn begin(&mut self, force: Vec2, torque: f64) {
        self.weigh();
        let (twist, load) = (self.body.twist(), &self.load);
        let angle = self.body.pose().angle;
        let v = rotate(-angle, twist.linear);
        self.before = Vector3::new(v.x, v.y, twist.angular);
        let force = rotate(-angle, force);
        let torque = torque - cross(load.centre_of_mass, force);
        // v* = v + T f/m, omega* = omega + T M/I
        let gain = force * (TICK_S / load.m);
        self.free = self.before + Vector3::new(gain.x, gain.y, torque * TICK_S / load.inertia);
    }

    /// The ground's half of a round: the friction step, given what contacts gave in the round before.
    pub(super) fn slide(&mut self, world: &mut World, first: bool) {
        if self.fixed {
            return;
        }
        let Twist { linear, angular } = self.gained;
        let angle = self.body.pose().angle;
        let free = if self.gained == Twist::default() {
            self.free
        } else {
            let linear = rotate(-angle, linear);
            self.free + Vector3::new(linear.x, linear.y, angular)
        };
        let u = self.patch.step(&self.load, self.before, free);
        self.slid = admitted(Twist {
            linear: rotate(angle, u.xy()),
            angular: u.z,
        });
        let without_contacts = Twist {
            linear: self.slid.linear - linear,
            angular: self.slid.angular - angular,
        };
        self.body.give(world, without_contacts, first);
    }

    /// The contacts' half of a round. Returns by how much they changed the velocity of the fastest point, m/s.
    pub(super) fn take(&mut self, world: &World) -> f64 {
        if self.fixed {
            return 0.0;
        }
        let solved = self.body.solved(world);
        let linear = solved.linear - self.slid.linear;
        let angular = solved.angular - self.slid.angular;
        self.gained.linear += linear;
        self.gained.angular += angular;
        linear.norm() + angular.abs() * self.patch.reach
    }

    /// Ends a period. A body that the ground holds stays where it is, to the bit.
    pub(super) fn end(&mut self, world: &mut World) {
        if !self.fixed {
            self.body.accept(world, self.slid == Twist::default());
        }
    }

    /// The centre of mass from the centroid, world frame, m.
    fn centre_of_mass(&self) -> Vec2 {
        let offset = self.load.centre_of_mass;
        if offset == Vec2::zeros() {
            return offset;
        }
        rotate(self.body.pose().angle, offset)
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

fn surface(config: &EnvironmentConfig, outline: &Outline, solid: &Solid) -> Surface {
    match (&config.shape, outline) {
        (Shape::Square | Shape::Brick { .. }, _) => Surface::of_box(outline.bounding_box()),
        (_, Outline::Circle(radius)) => Surface::disc(*radius),
        (Shape::Compound { .. }, Outline::Corners(corners)) => {
            Surface::Notched(Skin::new(solid, corners.as_slice()))
        }
        (_, Outline::Corners(corners)) => Surface::polygon(corners.as_slice()),
    }
}
