//! How the centre moves while the tool touches: with the plane of the face, and along it.

use mmt_shared::model::dynamics::Motion;
use mmt_shared::model::geometry::{Face, Vec2, rotate};
use mmt_shared::model::params::ModelParams;
use mmt_shared::time::TICK_S;

use super::PoseObserver;

/// Drift of the coordinate along the face while pushed, m per square root of a second.
const SLIDE_DRIFT_M: f64 = 5e-3;

impl PoseObserver {
    /// Moves the centre so that the face lies where the tool touches it.
    pub(super) fn follow_plane(&mut self, face: Face, inward: Vec2, surface: Vec2) {
        let Motion { pose, twist } = &mut self.motion;
        let before = pose.position;
        let gap = inward.dot(&(surface - before)) + self.faces.footprint.offset(face);
        pose.position += inward * gap;
        if self.contact.is_some() {
            let velocity = (pose.position - before) / TICK_S;
            // 20 ms, as long as the parameters' smoothing
            let change = (velocity - twist.linear) * (TICK_S / 0.020);
            twist.linear += if self.config.learn {
                inward * inward.dot(&change)
            } else {
                change
            };
        }
    }

    /// Moves the centre along the face until `surface`, where the tool touches it, lies between the face's ends: the model is
    /// to be where the tool has contact (III-A, case 2). Images do so where there are any.
    pub(super) fn reach_along(&mut self, face: Face, surface: Vec2) {
        if self.config.images {
            return;
        }
        let pose = &mut self.motion.pose;
        let touched = pose.point_to_object(surface);
        for beside in Face::ALL {
            let beyond = self.faces.footprint.distance(beside, touched);
            if beside.outward().dot(&face.outward()) == 0.0 && beyond > 0.0 {
                pose.position += rotate(pose.angle, beside.outward()) * beyond;
            }
        }
    }

    /// The part of the velocity along the face: nothing pushes there, so friction and damping brake it. A box that turns
    /// has one, because its face turns away from where the centre is going.
    pub(super) fn slide_along(&mut self, inward: Vec2, params: &ModelParams) {
        if !self.config.learn || self.contact.is_none() {
            return;
        }
        let turning = self.friction_radius() * self.motion.twist.angular;
        let Motion { pose, twist } = &mut self.motion;
        let velocity = twist.linear;
        let speed = libm::hypot(velocity.norm(), turning);
        let along = velocity - inward * inward.dot(&velocity);
        let braked = if speed > 0.0 {
            let drag = params.b() + params.c() / speed;
            along * (params.m() / (params.m() + TICK_S * drag))
        } else {
            along
        };
        twist.linear += braked - along;
        pose.position += braked * TICK_S;
    }

    /// One tick in which the centre drifts along the face.
    pub(super) fn hold_centre(&mut self) {
        self.centre.hold(SLIDE_DRIFT_M * SLIDE_DRIFT_M * TICK_S);
    }
}
