//! The world in rapier: bodies, their colliders and walls.
//!
//! rapier finds contacts and solves them, and moves the bodies; gravity, the ground and the tool are ours. A contact is
//! rigid: what has a gap approaches by no more than the gap in a period, what touches does not approach, and only places
//! are corrected, not velocities. So rest is always possible and contacts never add energy. Without contact
//! p_n = p_{n−1} + T v_n to the bit and theta_n = theta_{n−1} + atan(T omega_n), which is T omega_n to
//! (T omega)³/3. It must never be given a number that is not finite.

use mmt_shared::model::geometry::{Pose, Twist, Vec2};
use mmt_shared::model::params::{SPEED_M_PER_S, TURN_RATE_RAD_PER_S};
use mmt_shared::time::TICK_S;
use rapier2d_f64::prelude::{
    CoefficientCombineRule, ColliderBuilder, MassProperties, PhysicsWorld, Pose as RapierPose,
    RigidBody, RigidBodyBuilder, RigidBodyHandle, SharedShape, SpringCoefficients, Vector,
};

use super::solid::{Solid, vector};
use super::wall::Wall;

/// Sweeps over the contacts in one solution: two points of a face converge by 25 in each.
const SWEEPS: usize = 10;
/// Bodies that are deeper in each other than this, m, are moved apart, no faster than this, m/s. They come into each other
/// by what the paths of their points curve within a period.
const APART: (f64, f64) = (1e-6, 0.1);
/// Contacts are looked for within this gap, m: two bodies at the greatest speed meet within it in a period.
const REACH_M: f64 = 2.5 * SPEED_M_PER_S * TICK_S;
/// Natural frequency of a contact, Hz: so high that a contact is rigid to the last bit.
const RIGID_HZ: f64 = 1e9;

/// All bodies, as rapier has them.
pub(super) struct World(PhysicsWorld);

/// One body in the world: the place of its centre of mass and its velocity.
pub(super) struct Body {
    handle: RigidBodyHandle,
    pose: Pose,
    twist: Twist,
    /// Where rapier had it at the beginning of the period.
    start: RapierPose,
}

impl World {
    pub(super) fn new() -> Self {
        let mut world = PhysicsWorld::new();
        let rigid = SpringCoefficients::new(RIGID_HZ, 1.0);
        world.gravity = Vector::ZERO;
        let parameters = &mut world.integration_parameters;
        parameters.dt = TICK_S;
        parameters.num_solver_iterations = 1;
        parameters.num_internal_pgs_iterations = SWEEPS;
        // rapier's second pass solves for another moment than the one that the bodies are moved by
        parameters.num_internal_stabilization_iterations = 0;
        parameters.max_ccd_substeps = 0;
        parameters.contact_recycling = false;
        parameters.contact_softness = rigid;
        parameters.static_contact_softness = rigid;
        parameters.normalized_max_corrective_velocity = 0.0;
        parameters.normalized_prediction_distance = REACH_M;
        Self(world)
    }

    /// A body of mass m (kg) and inertia I (kg m²) about its centre of mass, at rest with its centre of mass at
    /// `pose`; without mass it is fixed.
    pub(super) fn insert(&mut self, mass: Option<(f64, f64)>, pose: Pose) -> Body {
        let builder = match mass {
            Some((m, inertia)) => RigidBodyBuilder::dynamic()
                .additional_mass_properties(MassProperties::new(Vector::ZERO, m, inertia)),
            None => RigidBodyBuilder::fixed(),
        };
        let body = builder
            .translation(vector(pose.position))
            .rotation(pose.angle)
            .can_sleep(false)
            .build();
        Body {
            start: *body.position(),
            handle: self.0.insert_body(body),
            pose,
            twist: Twist::default(),
        }
    }

    /// From now on the body meets walls and other bodies; its centre of mass lies at `centre_of_mass` in the shape's
    /// frame, and contacts rub with this coefficient.
    pub(super) fn collide(
        &mut self,
        body: &Body,
        solid: &Solid,
        centre_of_mass: Vec2,
        friction: f64,
    ) {
        let collider = ColliderBuilder::new(solid.shape())
            .translation(vector(-centre_of_mass))
            .density(0.0);
        let collider = rubbing(collider, friction);
        self.0.insert_collider(collider, Some(body.handle));
    }

    pub(super) fn insert_wall(&mut self, wall: &Wall, friction: f64) {
        let outward = -wall.normal();
        let collider = ColliderBuilder::new(SharedShape::halfspace(vector(outward)))
            .translation(vector(outward * -wall.distance_m));
        self.0.insert_collider(rubbing(collider, friction), None);
    }

    /// Solves the contacts and moves all bodies for one period.
    pub(super) fn step(&mut self) {
        self.0.step();
    }

    /// Whether bodies were too deep in each other at the beginning of the period.
    pub(super) fn is_deep(&self) -> bool {
        let manifolds = self.0.contact_pairs().flat_map(|pair| pair.manifolds());
        let mut points = manifolds.flat_map(|manifold| &manifold.points);
        points.any(|point| point.dist < -APART.0)
    }

    /// Moves bodies apart that are in each other and have no velocity.
    pub(super) fn part(&mut self) {
        let usual = self.0.integration_parameters;
        let parameters = &mut self.0.integration_parameters;
        parameters.normalized_max_corrective_velocity = APART.1;
        parameters.warmstart_coefficient = 0.0;
        self.0.step();
        self.0.integration_parameters = usual;
    }
}

fn rubbing(collider: ColliderBuilder, friction: f64) -> ColliderBuilder {
    collider
        .friction(friction)
        .friction_combine_rule(CoefficientCombineRule::Min)
}

impl Body {
    /// Pose of the centre of mass in the world, its angle not wrapped.
    pub(super) fn pose(&self) -> Pose {
        self.pose
    }

    /// Velocity of the centre of mass in the world, and turning rate.
    pub(super) fn twist(&self) -> Twist {
        self.twist
    }

    /// Changes mass (kg) and inertia (kg m²); pose and velocity stay.
    pub(super) fn set_inertia(&self, world: &mut World, m: f64, inertia: f64) {
        if let Some(body) = world.0.bodies.get_mut(self.handle) {
            let properties = MassProperties::new(Vector::ZERO, m, inertia);
            body.set_additional_mass_properties(properties, true);
        }
    }

    /// Puts the body at rest with its centre of mass at `pose`.
    pub(super) fn place(&mut self, world: &mut World, pose: Pose) {
        let Some(body) = world.0.bodies.get_mut(self.handle) else {
            return;
        };
        let at = RigidBodyBuilder::fixed()
            .translation(vector(pose.position))
            .rotation(pose.angle)
            .build();
        self.start = *at.position();
        body.set_position(self.start, true);
        (self.pose, self.twist) = (pose, Twist::default());
    }

    /// Gives the body a velocity without moving it.
    pub(super) fn set_twist(&mut self, twist: Twist) {
        self.twist = admitted(twist);
    }

    /// Gives rapier the velocity that the body has without contacts. In the `first` round of a period the body stands
    /// where it begins; in the next ones it goes back there.
    pub(super) fn give(&mut self, world: &mut World, twist: Twist, first: bool) {
        let Some(body) = world.0.bodies.get_mut(self.handle) else {
            return;
        };
        if first {
            self.start = *body.position();
        } else {
            body.set_position(self.start, true);
        }
        body.set_linvel(vector(twist.linear), true);
        body.set_angvel(twist.angular, true);
    }

    /// The velocity after contacts.
    pub(super) fn solved(&self, world: &World) -> Twist {
        let body = world.0.bodies.get(self.handle);
        body.map_or_else(Twist::default, velocity)
    }

    /// Ends a period: takes the body's place and velocity from rapier. A body that is `held` stays where it was, to the
    /// bit.
    pub(super) fn accept(&mut self, world: &mut World, held: bool) {
        let Some(body) = world.0.bodies.get_mut(self.handle) else {
            return;
        };
        self.twist = velocity(body);
        if held {
            if self.twist != Twist::default() {
                body.set_position(self.start, true);
            }
            self.twist = Twist::default();
        }
        if self.twist != Twist::default() {
            self.read_pose(world);
        }
    }

    /// Ends the parting of bodies: the velocity is still that of before.
    pub(super) fn accept_parted(&mut self, world: &World) {
        if self.solved(world) != Twist::default() {
            self.read_pose(world);
        }
    }

    /// Takes the place of a body that moved: rapier renormalises its rotation in every step, so that at rest only our
    /// copy keeps its last bit.
    fn read_pose(&mut self, world: &World) {
        let Some(body) = world.0.bodies.get(self.handle) else {
            return;
        };
        let translation = body.translation();
        let angle = body.rotation().angle();
        // rapier's angle lies in (−π, π], ours counts whole turns
        let turns = libm::round((self.pose.angle - angle) / std::f64::consts::TAU);
        self.pose = Pose {
            position: Vec2::new(translation.x, translation.y),
            angle: angle + turns * std::f64::consts::TAU,
        };
    }
}

fn velocity(body: &RigidBody) -> Twist {
    let (linear, angular) = (body.linvel(), body.angvel());
    Twist::new(linear.x, linear.y, angular)
}

/// The choke point: what rapier receives is finite and within the speeds that the model accepts.
pub(super) fn admitted(twist: Twist) -> Twist {
    if !twist.is_finite() {
        return Twist::default();
    }
    let speed = twist.linear.norm();
    let scale = if speed > SPEED_M_PER_S {
        SPEED_M_PER_S / speed
    } else {
        1.0
    };
    Twist {
        linear: twist.linear * scale,
        angular: twist
            .angular
            .clamp(-TURN_RATE_RAD_PER_S, TURN_RATE_RAD_PER_S),
    }
}
