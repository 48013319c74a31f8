//! The body in rapier: the only file that names rapier or its vectors.
//!
//! rapier is asked to integrate and nothing else: no gravity, no user force, no collider, no sleep, one
//! solver iteration, so that p_n = p_{n−1} + T v_n to the bit and theta_n = theta_{n−1} +
//! atan(T omega_n), which is T omega_n to (T omega)³/3. It must never be given a number that is not finite.

use mmt_shared::model::geometry::{Pose, Twist, Vec2};
use mmt_shared::model::params::{SPEED_M_PER_S, TURN_RATE_RAD_PER_S};
use mmt_shared::time::TICK_S;
use rapier2d_f64::prelude::{
    MassProperties, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle, Vector,
};

/// One free body on the plane.
pub(super) struct Body {
    world: PhysicsWorld,
    handle: RigidBodyHandle,
    pose: Pose,
    twist: Twist,
}

impl Body {
    /// A body of mass m (kg) and inertia I (kg m²) about its centre of mass, at rest with its centre of
    /// mass at `pose`.
    pub(super) fn new(m: f64, inertia: f64, pose: Pose) -> Self {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        world.integration_parameters.dt = TICK_S;
        world.integration_parameters.num_solver_iterations = 1;
        world.integration_parameters.max_ccd_substeps = 0;
        world.integration_parameters.contact_recycling = false;
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::new(pose.position.x, pose.position.y))
            .rotation(pose.angle)
            .additional_mass_properties(MassProperties::new(Vector::ZERO, m, inertia))
            .can_sleep(false);
        let handle = world.insert_body(body);
        Self {
            world,
            handle,
            pose,
            twist: Twist::default(),
        }
    }

    /// Pose of the centre of mass in the world, its angle not wrapped.
    pub(super) fn pose(&self) -> Pose {
        self.pose
    }

    /// Velocity of the centre of mass in the world, and turning rate.
    pub(super) fn twist(&self) -> Twist {
        self.twist
    }

    /// Changes mass (kg) and inertia (kg m²); pose and velocity stay.
    pub(super) fn set_inertia(&mut self, m: f64, inertia: f64) {
        if let Some(body) = self.world.bodies.get_mut(self.handle) {
            let properties = MassProperties::new(Vector::ZERO, m, inertia);
            body.set_additional_mass_properties(properties, true);
        }
    }

    /// Gives the body a velocity without moving it.
    pub(super) fn set_twist(&mut self, twist: Twist) {
        self.twist = admitted(twist);
    }

    /// Moves the body for one period T at `twist`.
    pub(super) fn advance(&mut self, twist: Twist) {
        let twist = admitted(twist);
        let Some(body) = self.world.bodies.get_mut(self.handle) else {
            return;
        };
        body.set_linvel(Vector::new(twist.linear.x, twist.linear.y), true);
        body.set_angvel(twist.angular, true);
        self.world.step();
        self.read();
    }

    fn read(&mut self) {
        let Some(body) = self.world.bodies.get(self.handle) else {
            return;
        };
        let (linear, angular) = (body.linvel(), body.angvel());
        self.twist = Twist::new(linear.x, linear.y, angular);
        // rapier renormalises its rotation in every step: at rest only our copy keeps its last bit
        if self.twist == Twist::default() {
            return;
        }
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

/// The choke point: what rapier is told is finite and within the speeds that the model accepts.
fn admitted(twist: Twist) -> Twist {
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
