//! What turning takes from the push: the row of (1) for a contact off the object's centre.
//!
//! A tool that pushes beside the centre turns the object, so the contact point moves unlike the centre and
//! friction does not oppose the push alone. Mass, friction and damping that are spread evenly over a square
//! of side l act like four quarters at `±l/√12`, which have the inertia I of (8) exactly, the damping
//! `b l²/6` about the centre, and the square's friction nearly. Eliminating the turning acceleration by the
//! moment d f = I alpha + … leaves m, b and c linear, so that no measured angle is differentiated twice.
//! It must never change the row of a push through the centre of an object that does not turn.

use mmt_shared::geometry::{Vec2, cross};
use mmt_shared::params::{FACE_OFFSET_M, TURN_RATE_RAD_PER_S};
use nalgebra::Vector3;

use super::POSITION_LIMIT;
use super::filter::Row;
use super::surface::SurfaceMotion;
use crate::square::friction;

/// e/(c l) of the ellipse through the wrenches with which a slow tool pushes a square.
const CREEP_RADIUS: f64 = 0.30;

/// The object as the slave sees it: of its own observer, never the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Centre of the object, world frame, m.
    pub centre: Vec2,
    /// Turning rate omega, rad/s, counter-clockwise.
    pub turning: f64,
    /// Side l of the square that (8) and (9) are written for, m.
    pub side: f64,
}

impl Seen {
    /// Whether every number is one that an object of this system can have.
    pub(super) fn is_usable(&self) -> bool {
        // written so that NaN fails
        self.centre.norm() <= POSITION_LIMIT
            && self.turning.abs() <= TURN_RATE_RAD_PER_S
            && self.side >= 2.0 * FACE_OFFSET_M.0
    }
}

/// The row of a raw surface motion, if the object is where it is `seen` to be.
///
/// `normal` is the inward unit normal n, `speed` the smoothed v·n (m/s) that decides which way friction
/// acts. With d the lever of the force about the centre and rho = 6 d²/l², the moment about the centre
/// turns m a + b v + c s = f of the centre into `(m a + b v + c s)/(1 + rho) = f` of the contact point: it
/// feels the share 1/(1 + rho) of the mass.
#[must_use]
pub fn shared(motion: &SurfaceMotion, normal: Vec2, speed: f64, seen: &Seen) -> Row {
    let lever = motion.point - seen.centre;
    let (d, ahead) = (cross(lever, normal), -lever.dot(&normal));
    // moment arm per squared radius of gyration l²/6: turns a moment into its force on the contact point
    let arm = 6.0 * d / (seen.side * seen.side);
    let share = 1.0 / (1.0 + arm * d);
    let omega = seen.turning;
    // the contact point slides along a face that turns: centripetal and Coriolis acceleration
    let along = cross(normal, motion.velocity);
    let carried = omega * (2.0 * along + omega * ahead);
    let motion_row = motion.row.regressor;
    let (force, torque) = friction(speed - omega * d, omega, seen.side);
    Row {
        regressor: Vector3::new(motion_row.x + carried, motion_row.y, force + arm * torque) * share,
        force: motion.row.force,
    }
}

/// The same where the object moves too slowly for omega to be known: turning is what the lever makes it.
///
/// Without inertia the moment and the force on a square lie on its limit surface, so that f = c s with
/// `s = 1/sqrt(1 + (d/(0.30 l))²)`: 0.3 % off the square's for levers up to 0.14 l.
#[must_use]
pub fn creeping(motion: &SurfaceMotion, normal: Vec2, seen: &Seen) -> Row {
    let d = cross(motion.point - seen.centre, normal) / seen.side;
    let share = 1.0 / (1.0 + 6.0 * d * d);
    let raw = motion.row.regressor;
    let s = 1.0 / (1.0 + d * d / (CREEP_RADIUS * CREEP_RADIUS)).sqrt();
    Row {
        regressor: Vector3::new(raw.x * share, raw.y * share, s),
        force: motion.row.force,
    }
}
