//! One tick in contact with the face of a box, or with the tangent of another body.

use mmt_shared::model::dynamics::Motion;
use mmt_shared::model::geometry::{Face, Vec2, cross, rotate, wrap_angle};
use mmt_shared::model::params::ModelParams;
use mmt_shared::time::TICK_S;

use super::PoseObserver;
use super::angle_track::AngleTrack;
use super::contact_force::ContactForce;
use super::contact_frame::ContactFrame;
use super::ground_moment::Push;
use super::tracker::Tracker;

/// Force below which its direction is only noise, N: fifteen times the default sensor noise.
const FORCE_MIN_N: f64 = 0.15;
/// And no force below so many standard deviations of its noise has one.
const DEVIATIONS: f64 = 5.0;
/// Turning acceleration that the angle filter allows for while the box is pushed, rad/s²: all of it, and
/// what remains of it where the moment of the push is reckoned with.
const TURN_ACCELERATION: (f64, f64) = (20.0, 2.5);
/// A tool at one face can have reached the next if it is no farther from the corner between them than this share of the
/// way from the middle of the face.
const CORNER_SHARE: f64 = 0.5;
/// A jump of the normal beyond this, rad, is a new contact with such a body.
const JUMP_RAD: f64 = 0.2;
/// A force below this, N, shows no jump: where the body is let go, what is left of the sensor's bias turns it.
const JUMP_N: f64 = 0.5;

impl PoseObserver {
    /// One tick of touch.
    pub(super) fn touch(&mut self, tool: Vec2, contact: &ContactForce, params: &ModelParams) {
        self.faces.touched();
        let force = contact.force;
        let face = match self.contact {
            Some(contact) => contact.face,
            None => self.begin_contact(tool, contact.steady),
        };
        let unknown = self.turn(contact, params);
        self.follow_angle(face, contact, unknown);
        let inward = -rotate(self.motion.pose.angle, face.outward());
        self.penetration.follow(force.dot(&inward));
        let surface = tool - inward * self.penetration.depth;
        if self.tracker.is_settling() {
            self.motion.pose.position += self.motion.twist.linear * TICK_S;
            let offset = inward.dot(&(self.motion.pose.position - surface));
            self.faces.set_accepted(face, offset);
        } else {
            if self.contact.is_none() && self.config.learn {
                // a body that stood still stands where it was last seen, so its face is where it is felt
                let offset = inward.dot(&(self.motion.pose.position - surface)) + contact.beyond_m;
                self.faces
                    .learn(&mut self.tracker, face, offset, self.centre.variance());
            }
            self.slide_along(inward, params);
            self.follow_plane(face, inward, surface);
            self.reach_along(face, surface);
        }
        if let Tracker::Tangent(tangent) = &mut self.tracker {
            tangent.touch(self.motion.twist.angular);
        }
        self.hold_centre();
        self.contact = Some(ContactFrame {
            face,
            inward,
            surface,
            beyond_m: contact.beyond_m,
        });
    }

    /// The first tick of a contact. Returns the face that is touched: of a box the one that the force is normal to, of those
    /// that the tool can have reached; of a tangent the one that is nearest to the tool, because the master pushes that one.
    fn begin_contact(&mut self, tool: Vec2, force: Vec2) -> Face {
        self.penetration.begin(tool, force);
        if let Tracker::Tangent(_) = self.tracker {
            self.begin_tangent();
            let tool_in_object = self.motion.pose.point_to_object(tool);
            return self.faces.footprint.nearest(tool_in_object).0;
        }
        self.angle.begin_contact(self.friction_angle().powi(2));
        let in_object = rotate(-self.motion.pose.angle, force);
        let tool_in_object = self.motion.pose.point_to_object(tool);
        let footprint = &self.faces.footprint;
        let (nearest, distance) = footprint.nearest(tool_in_object);
        let within_reach = distance - CORNER_SHARE * footprint.offset(nearest);
        let mut best = (nearest, f64::NEG_INFINITY);
        for face in Face::ALL {
            let along = -face.outward().dot(&in_object);
            // the noise of a light force may point at any face
            let reached = footprint.distance(face, tool_in_object) >= within_reach;
            if reached && along > best.1 {
                best = (face, along);
            }
        }
        best.0
    }

    /// The normal of a new contact with a body that is no box may be any.
    fn begin_tangent(&mut self) {
        if let Tracker::Tangent(tangent) = &mut self.tracker {
            tangent.begin();
        }
        self.motion.twist.angular = 0.0;
        self.angle = AngleTrack::of_any_normal();
    }

    /// Turns the box by the moment of the push, where that can be reckoned, and returns the turning
    /// acceleration that remains unknown, rad/s².
    fn turn(&mut self, force: &ContactForce, params: &ModelParams) -> f64 {
        let (all, rest) = TURN_ACCELERATION;
        let (Some(contact), Tracker::Box(tracker)) = (self.contact, &mut self.tracker) else {
            return all;
        };
        if !self.config.learn {
            return all;
        }
        let Motion { pose, twist } = &mut self.motion;
        let push = Push {
            side: self.faces.footprint.mean_side(),
            speed: twist.linear.dot(&contact.inward),
            omega: twist.angular,
            moment: cross(contact.surface - pose.position, force.force),
        };
        let Some(omega) = tracker.turned(params, &push, force.obstacle) else {
            return all;
        };
        twist.angular = omega;
        rest
    }

    /// theta by the direction of the force.
    pub(super) fn follow_angle(&mut self, face: Face, contact: &ContactForce, acceleration: f64) {
        self.motion.pose.angle += self.motion.twist.angular * TICK_S;
        let friction_angle = self.friction_angle();
        self.angle.predict(acceleration, friction_angle.powi(2));
        let (force, size) = (contact.force, contact.force.norm());
        if size < FORCE_MIN_N.max(DEVIATIONS * contact.noise_n) {
            return;
        }
        let direction = libm::atan2(-force.y, -force.x) - face.outward_angle();
        let innovation = wrap_angle(direction - self.motion.pose.angle - self.angle.error());
        let tangent = matches!(self.tracker, Tracker::Tangent(_));
        let jumps = size > JUMP_N && innovation.abs() > JUMP_RAD;
        if tangent && !self.tracker.is_settling() && jumps {
            self.begin_tangent();
        }
        let spread = self.config.force_noise_n.max(contact.noise_n) / size;
        let variance = spread * spread + self.tracker.direction_floor_rad().powi(2);
        let (angle, rate) = self.angle.touch(variance, innovation);
        self.motion.pose.angle += angle;
        self.motion.twist.angular += rate;
    }
}
