//! One tick in contact with an object that is pushed so slowly that it is followed by the force alone.

use mmt_shared::model::geometry::{Face, Pose, Twist, Vec2, rotate, wrap_angle};
use mmt_shared::time::TICK_S;

use super::PoseObserver;
use super::angle_track::AngleTrack;
use super::contact_force::ContactForce;
use super::contact_frame::ContactFrame;
use super::tracker::Tracker;
use crate::contact_prediction::Expected;

/// Turning acceleration of the force that the angle filter allows for, rad/s²: a sixtieth of that of a fast push, as the
/// speed is.
const TURN_RAD_PER_S2: f64 = 0.33;
/// Time constant of the velocity, s: as long as the parameters' smoothing.
const VELOCITY_S: f64 = 0.020;

/// The force of a device's spring rises over a way on which that of a stiff contact is there at once. This share of the way
/// lies before the point of contact: as much is felt too early as too late.
const BEFORE: f64 = 0.5;

impl PoseObserver {
    /// The master has not met the box that is pushed.
    pub(crate) fn approach(&mut self) {
        if let Tracker::Slow(slow) = &mut self.tracker {
            slow.approach(self.penetration.depth);
        }
    }

    /// Nothing is touched now; contact is expected at a point under a force. The model is then what it would be in that
    /// contact: a small box, whose face is normal to the force.
    pub(crate) fn expect(&mut self, expected: Option<Expected>) {
        let Tracker::Slow(slow) = &mut self.tracker else {
            return;
        };
        slow.expected = expected.map(|Expected { point, force }| {
            let face = face_pushed_by(self.motion.pose.angle, force);
            let heading = libm::atan2(-force.y, -force.x);
            let before = BEFORE * force.norm() / self.config.coupling.stiffness_n_per_m;
            let deep = self.faces.footprint.offset(face) - before;
            Pose {
                position: point + force.normalize() * deep,
                angle: self.motion.pose.angle
                    + wrap_angle(heading - face.outward_angle() - self.motion.pose.angle),
            }
        });
    }

    /// One tick of touch.
    pub(super) fn touch_slowly(&mut self, tool: Vec2, contact: &ContactForce) {
        self.faces.touched();
        let face = match self.contact {
            Some(contact) => contact.face,
            None => self.begin_slowly(tool, contact.steady),
        };
        self.follow_force(face, contact);
        let inward = -rotate(self.motion.pose.angle, face.outward());
        self.penetration.follow(contact.force.dot(&inward));
        let surface = tool - inward * self.penetration.depth;
        let before = self.motion.pose.position;
        self.motion.pose.position = surface + inward * self.faces.footprint.offset(face);
        if self.contact.is_some() {
            let velocity = (self.motion.pose.position - before) / TICK_S;
            let change = (velocity - self.motion.twist.linear) * (TICK_S / VELOCITY_S);
            self.motion.twist.linear += inward * inward.dot(&change);
        }
        self.hold_centre();
        self.contact = Some(ContactFrame {
            face,
            inward,
            surface,
            beyond_m: contact.beyond_m,
        });
    }

    fn follow_force(&mut self, face: Face, contact: &ContactForce) {
        if let Tracker::Slow(slow) = &mut self.tracker
            && slow.touch()
        {
            self.motion.twist.angular = 0.0;
            self.angle = AngleTrack::of_any_normal();
        }
        self.follow_angle(face, contact, TURN_RAD_PER_S2);
    }

    /// The first tick of a contact under this force (N): the face that has to turn least.
    fn begin_slowly(&mut self, tool: Vec2, force: Vec2) -> Face {
        self.penetration.begin(tool, force);
        if let Tracker::Slow(slow) = &mut self.tracker {
            if let Some(expected) = slow.expected {
                self.motion.pose = expected;
            }
            slow.begin();
        }
        self.motion.twist = Twist::default();
        face_pushed_by(self.motion.pose.angle, force)
    }
}

/// Of a box that is turned by `angle` (rad) the face that has to turn least to be normal to a force.
fn face_pushed_by(angle: f64, force: Vec2) -> Face {
    let in_object = rotate(-angle, force);
    let along = |face: &Face| -face.outward().dot(&in_object);
    let best = Face::ALL
        .into_iter()
        .max_by(|a, b| along(a).total_cmp(&along(b)));
    best.unwrap_or(Face::West)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose_observer::ObserverConfig;
    use crate::sensing::VisionSample;
    use mmt_shared::fixtures::COUPLING;
    use mmt_shared::model::geometry::{BoxFootprint, Pose};
    use mmt_shared::model::params::ModelParams;
    use mmt_shared::time::{TICK, Time};

    fn observer(quasi_static: bool) -> PoseObserver {
        let config = ObserverConfig {
            coupling: COUPLING,
            force_noise_n: 0.01,
            vision_noise_m: 3e-4,
            vision_noise_rad: 3e-3,
            size_noise_m: None,
            tool_friction: 0.0,
            images: true,
            learn: true,
            quasi_static,
        };
        PoseObserver::new(config, Pose::new(0.1, 0.0, 0.4), BoxFootprint::square(0.04))
    }

    /// Pushes with 4 N in the direction `angle` (rad) at 3 mm/s along x for a second.
    fn push(observer: &mut PoseObserver, angle: f64) -> (Time, Vec2) {
        let params = ModelParams::of_square(0.4, 0.0, 4.0, 0.04, &COUPLING).unwrap();
        let force = rotate(angle, Vec2::new(4.0, 0.0));
        let (mut now, mut tool) = (Time::ZERO, Vec2::new(0.05, 0.01));
        for _ in 0..1000 {
            now += TICK;
            tool.x += 3e-6;
            observer.step(now, tool, force, true, &params);
        }
        (now, tool)
    }

    #[test]
    fn the_model_renders_the_measured_force_wherever_the_surface_is() {
        for angle in [0.0, 0.3, -0.7, 2.0] {
            let mut slow = observer(true);
            let (_, tool) = push(&mut slow, angle);
            let contact = slow.contact().unwrap();
            let force =
                contact.inward * (COUPLING.stiffness_n_per_m * (tool - contact.surface).norm());
            let wanted = rotate(angle, Vec2::new(4.0, 0.0));
            assert!((force - wanted).norm() < 0.05, "{angle}: {force}");
            // and the tool is in the middle of the face
            let at = slow.pose().point_to_object(tool);
            assert!(at.x.abs().min(at.y.abs()) < 1e-9, "{at}");
        }
    }

    #[test]
    fn an_object_that_is_let_go_lies_where_the_image_of_the_push_shows_it() {
        let mut slow = observer(true);
        let (now, tool) = push(&mut slow, 0.3);
        let pose = Pose::new(0.11, 0.003, 0.5);
        assert!((slow.pose().position - pose.position).norm() > 0.02);
        slow.see(&VisionSample { taken: now, pose });
        let params = ModelParams::of_square(0.4, 0.0, 4.0, 0.04, &COUPLING).unwrap();
        slow.step(now + TICK, tool, Vec2::zeros(), false, &params);
        assert_eq!((slow.pose(), slow.twist()), (pose, Twist::default()));
    }

    #[test]
    fn an_expected_contact_is_a_box_in_front_of_the_tool_and_the_contact_begins_with_it() {
        let mut slow = observer(true);
        let own = slow.pose();
        let (point, force) = (Vec2::new(0.06, 0.01), rotate(0.9, Vec2::new(4.0, 0.0)));
        slow.expect(Some(Expected { point, force }));
        let expected = slow.pose_ahead(0.0, 0.1);
        assert_eq!(slow.pose(), own, "nobody has touched it yet");
        assert_eq!(slow.off(&expected), (Vec2::zeros(), 0.0));
        // half of the force is rendered at the point
        let depth = 2.0 / COUPLING.stiffness_n_per_m;
        let face = slow.footprint().nearest(expected.point_to_object(point));
        assert!((face.1 + depth).abs() < 1e-9, "{face:?}");
        let outward = rotate(expected.angle, face.0.outward());
        assert!((outward + force.normalize()).norm() < 1e-9, "{outward}");
        assert!((expected.angle - own.angle).abs() <= std::f64::consts::FRAC_PI_4 + 1e-9);
        let params = ModelParams::of_square(0.4, 0.0, 4.0, 0.04, &COUPLING).unwrap();
        slow.step(Time::ZERO + TICK, point, force, true, &params);
        assert_eq!(slow.contact().unwrap().face, face.0);
        assert!((slow.pose().angle - expected.angle).abs() < 1e-3);
        // where no contact is expected nothing of the model is wrong
        let mut unknown = observer(true);
        unknown.expect(None);
        let elsewhere = Pose::new(0.5, 0.5, 1.0);
        assert_eq!(unknown.off(&elsewhere), (Vec2::zeros(), 0.0));
        assert!(observer(false).off(&elsewhere).0.norm() > 0.5);
    }

    #[test]
    fn every_other_approach_leaves_the_tool_free_and_only_of_a_slow_box() {
        let depths = |quasi_static: bool| -> Vec<f64> {
            let mut observer = observer(quasi_static);
            let (_, tool) = push(&mut observer, 0.0);
            let inward = observer.contact().unwrap().inward;
            let mut depth = || {
                observer.approach();
                let middle = observer.pose_ahead(0.0, 0.1).position;
                0.02 - inward.dot(&(middle - tool))
            };
            (0..3).map(|_| depth()).collect()
        };
        let slow = depths(true);
        assert!(
            slow[0] > 0.0 && slow[1] < 0.0 && slow[2] == slow[0],
            "{slow:?}"
        );
        let fast = depths(false);
        assert_eq!(fast[0], fast[1]);
    }
}
