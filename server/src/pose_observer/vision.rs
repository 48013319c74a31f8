//! What vision adds: it is slow, late and noisy, but sees what touch cannot.

use mmt_shared::model::geometry::{Pose, Twist, Vec2, wrap_angle};

use super::PoseObserver;
use super::past::{Past, corrected};
use super::tangent_tracker::TangentTracker;
use super::track::Track;
use super::tracker::Tracker;
use crate::sensing::VisionSample;

/// A tool is seen clear of the object at this distance, m, and so many standard deviations of what is known of it.
const CLEAR: (f64, f64) = (5e-3, 5.0);
/// An image that is off by more standard deviations shows that a box moves which was taken to rest.
const MOVES_DEVIATIONS: f64 = 5.0;

impl PoseObserver {
    /// Whether an image that this mode uses was taken before all that is remembered: it shows nothing that can be compared.
    pub(crate) fn is_too_old(&self, vision: &VisionSample) -> bool {
        self.config.images && self.past.at(vision.taken).is_none()
    }

    /// Takes in an image that was taken some time ago, if this mode uses it.
    pub fn see(&mut self, vision: &VisionSample) {
        let then = self.past.at(vision.taken);
        let Some(then) = then.filter(|_| self.config.images) else {
            return;
        };
        self.seen = Some(vision.taken);
        let error = vision.pose.position - then.pose.position;
        let turn = wrap_angle(vision.pose.angle + self.tracker.turned() - then.pose.angle);
        if self.shows_clear(vision, &then) {
            self.clear_images += 1;
            return;
        }
        self.clear_images = 0;
        if let Tracker::Slow(slow) = &mut self.tracker
            && (then.contact.is_some() || self.contact.is_some())
        {
            slow.see(vision.pose);
            return;
        }
        if self.config.learn && self.refutes(turn, &then) {
            self.become_tangent(turn, error);
            return;
        }
        match (then.contact, self.contact) {
            (None, None) => self.see_free(vision, error, turn),
            _ => self.see_touched(vision, &then, error, turn),
        }
    }

    /// An image of an object that nobody touches shows where it is and how it moves, then and since.
    fn see_free(&mut self, vision: &VisionSample, error: Vec2, turn: f64) {
        let noise_m2 = self.config.vision_noise_m.powi(2);
        let noise_rad2 = self.config.vision_noise_rad.powi(2);
        let most_m = MOVES_DEVIATIONS * (self.centre.variance() + noise_m2).sqrt();
        let most_rad = MOVES_DEVIATIONS * (self.angle.variance() + noise_rad2).sqrt();
        if self.rests() && (error.norm() > most_m || turn.abs() > most_rad) {
            self.may_move();
        }
        let (place, velocity) = self.centre.measure(noise_m2);
        let (angle, omega) = self.angle.see(noise_rad2, turn);
        let off = Pose {
            position: error * place,
            angle,
        };
        let rate = Twist {
            linear: error * velocity,
            angular: omega,
        };
        let seconds = self.past.newest().saturating_since(vision.taken);
        self.past.correct(vision.taken, off, rate);
        let motion = &mut self.motion;
        motion.pose = corrected(motion.pose, off, rate, seconds.as_secs_f64());
        motion.twist.linear += rate.linear;
        motion.twist.angular += rate.angular;
    }

    /// An image of an object that is touched, or was: touch knows the plane of the face better.
    fn see_touched(&mut self, vision: &VisionSample, then: &Past, error: Vec2, turn: f64) {
        let variance = self.config.vision_noise_m.powi(2);
        match &mut self.tracker {
            Tracker::Tangent(tangent) if then.contact.is_some() => {
                tangent.see(vision.taken, turn);
            }
            _ => {
                let (angle, omega) = self.angle.see(self.config.vision_noise_rad.powi(2), turn);
                self.motion.pose.angle += angle;
                self.motion.twist.angular += omega;
            }
        }
        let (gain, _) = self.centre.measure(variance);
        let (Some(was), Some(is)) = (then.contact, self.contact) else {
            return;
        };
        if was.face != is.face {
            return;
        }
        let along = error - is.inward * is.inward.dot(&error);
        self.motion.pose.position += along * gain;
        let known = self.faces.footprint.offset(is.face);
        let seen = was.inward.dot(&(vision.pose.position - was.surface)) + was.beyond_m;
        self.faces
            .learn(&mut self.tracker, was.face, seen, variance);
        // the face stays where it is touched: that the centre lies elsewhere is no motion
        let shift = self.faces.footprint.offset(is.face) - known;
        self.motion.pose.position += is.inward * shift;
    }

    /// Whether an image shows a tool in contact clear of a body with faces.
    fn shows_clear(&self, vision: &VisionSample, then: &Past) -> bool {
        let in_contact = then.contact.is_some() && self.contact.is_some();
        let is_tangent = matches!(self.tracker, Tracker::Tangent(_));
        let outside = self.faces.outside(vision.pose.point_to_object(then.tool));
        let Some((distance, variance)) = outside.filter(|_| in_contact && !is_tangent) else {
            return false;
        };
        let turned = self.config.vision_noise_rad * self.faces.footprint.mean_side();
        let noise = variance + self.config.vision_noise_m.powi(2) + turned * turned;
        let (least, deviations) = CLEAR;
        distance > least.max(deviations * noise.sqrt())
    }

    /// Whether an image that differs from touch by `turn` (rad) shows that the body that was taken for a box is none.
    fn refutes(&mut self, turn: f64, then: &Past) -> bool {
        let friction_angle = self.friction_angle();
        match &mut self.tracker {
            Tracker::Box(tracker) if then.contact.is_some() => tracker.is_refuted(
                turn - then.force_turned,
                self.config.vision_noise_rad,
                friction_angle,
            ),
            _ => false,
        }
    }

    /// The body is no box, and what touches it is turned against it by `turn` (rad): the centre is where vision sees it,
    /// `error` (m) away.
    fn become_tangent(&mut self, turn: f64, error: Vec2) {
        self.tracker = Tracker::Tangent(TangentTracker::new(-turn));
        self.angle.forget_error();
        self.motion.pose.position += error;
        self.centre = Track::at_rest(self.config.vision_noise_m.powi(2));
    }
}
