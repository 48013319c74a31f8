//! What vision adds: it is slow, late and noisy, but sees what touch cannot.

use mmt_shared::model::geometry::{Vec2, wrap_angle};

use super::PoseObserver;
use super::past::Past;
use super::tangent_tracker::TangentTracker;
use super::tracker::Tracker;
use crate::sensing::VisionSample;

impl PoseObserver {
    /// Takes in an image that was taken some time ago, if this mode uses it.
    pub fn see(&mut self, vision: &VisionSample) {
        let then = self.past.at(vision.taken);
        let Some(then) = then.filter(|_| self.config.learn) else {
            return;
        };
        let error = vision.pose.position - then.pose.position;
        if !self.see_angle(vision, &then) {
            self.become_tangent(error);
            return;
        }
        let variance = self.config.vision_noise_m.powi(2);
        let gain = if variance > 0.0 {
            self.slide_var / (self.slide_var + variance)
        } else {
            1.0
        };
        self.slide_var *= 1.0 - gain;
        match (then.contact, self.contact) {
            (Some(was), Some(is)) if was.face == is.face => {
                let along = error - is.inward * is.inward.dot(&error);
                self.motion.pose.position += along * gain;
                let known = self.faces.footprint.offset(is.face);
                let seen = was.inward.dot(&(vision.pose.position - was.surface));
                self.faces
                    .learn(&mut self.tracker, was.face, seen, variance);
                // the face stays where it is touched: that the centre lies elsewhere is no motion
                let shift = self.faces.footprint.offset(is.face) - known;
                self.motion.pose.position += is.inward * shift;
            }
            (None, None) => self.motion.pose.position += error * gain,
            _ => {}
        }
    }

    /// Takes the angle of an image. False if the image shows that the body that was taken for a box is none.
    fn see_angle(&mut self, vision: &VisionSample, then: &Past) -> bool {
        let seen = vision.pose.angle + self.tracker.turned();
        let turn = wrap_angle(seen - then.pose.angle);
        let noise = self.config.vision_noise_rad;
        let touched = then.contact.is_some();
        match &mut self.tracker {
            Tracker::Tangent(tangent) if touched => {
                tangent.see(vision.taken, turn);
                return true;
            }
            Tracker::Box(tracker) => {
                let refuted = touched && tracker.is_refuted(turn, noise);
                if refuted {
                    self.tracker = Tracker::Tangent(TangentTracker::new(-turn));
                    return false;
                }
            }
            Tracker::Tangent(_) => {}
        }
        self.angle.measure(&mut self.motion, turn, noise * noise);
        true
    }

    /// The body is no box: the centre is where vision sees it, `error` m away.
    fn become_tangent(&mut self, error: Vec2) {
        self.motion.pose.position += error;
        self.slide_var = self.config.vision_noise_m.powi(2);
    }
}
