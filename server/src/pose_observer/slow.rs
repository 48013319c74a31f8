//! An object that is pushed so slowly that the push equals the ground's friction.
//!
//! Nothing is known of its outline, and the tool's own friction tilts the force against the surface. What the hand can feel
//! of it is the line of the force and how hard it is: the model is a small box right behind the tool, whose face is normal
//! to the force and so far back that the model renders the force that was measured. Where nobody touches the object, it is
//! where vision sees it. It must never use an image of a push for more than where the object lies afterwards.

use mmt_shared::model::dynamics::Motion;
use mmt_shared::model::geometry::{Face, Pose, Twist, Vec2, rotate};
use mmt_shared::time::TICK_S;

use super::track::Track;
use super::{ANY_NORMAL_RAD, ContactFrame, DIRECTION_FLOOR_RAD, Felt, PoseObserver, SLIDE_DRIFT_M};

/// Turning acceleration of the force that the angle filter allows for, rad/s²: a sixtieth of that of a fast push, as the
/// speed is.
const TURN_RAD_PER_S2: f64 = 0.33;
/// By how much the ripple of the ground turns the force, rad: 0.1 N of 4 N.
const DIRECTION_RAD: f64 = 0.025;
/// e/c of a model that does not turn, m: the force of a tool with friction turns with neither the object nor the tool.
pub(super) const RADIUS_M: f64 = 1.0;
/// Ticks of a new contact in which the force may turn as it likes: the contact gives before the object slides.
const SETTLING_TICKS: u32 = 150;
/// Time constant of the velocity, s: as long as the parameters' smoothing.
const VELOCITY_S: f64 = 0.020;
/// A box that has to come round the tool keeps this far from it, m: twice what the master keeps free.
const ASIDE_M: f64 = 1e-3;

/// What is known of a slow push.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Slow {
    /// Ticks until its force has a direction.
    settling: u32,
    /// Updates that brought the box to a master that had not met it.
    approaches: u32,
    /// How far the next one leaves it from the tool, m.
    aside_m: f64,
    /// The newest image: where the object lies when it is let go.
    pub(super) seen: Option<Pose>,
}

impl PoseObserver {
    /// The master has not met the box that is pushed. Every other time it is sent one that the tool does not touch: on
    /// its way the box may have come to stand beside the tool.
    pub(crate) fn approach(&mut self) {
        if self.config.quasi_static {
            let aside = self.slow.approaches % 2 == 1;
            let depth = self.penetration.depth;
            self.slow.aside_m = if aside { depth + ASIDE_M } else { 0.0 };
            self.slow.approaches += 1;
        }
    }

    /// A pose as the next update has it.
    pub(super) fn put_aside(&self, pose: Pose) -> Pose {
        let inward = self.contact.map_or(Vec2::zeros(), |contact| contact.inward);
        Pose {
            position: pose.position + inward * self.slow.aside_m,
            ..pose
        }
    }

    /// Error of the force's direction besides its noise, rad.
    pub(super) fn direction_floor_rad(&self) -> f64 {
        if self.config.quasi_static {
            DIRECTION_RAD
        } else {
            DIRECTION_FLOOR_RAD
        }
    }

    /// A slow object that is let go rests.
    pub(super) fn lie_where_seen(&mut self) {
        if let Some(pose) = self.slow.seen.take() {
            let twist = Twist::default();
            self.motion = Motion { pose, twist };
        }
    }

    /// One tick of touch.
    pub(super) fn touch_slowly(&mut self, tool: Vec2, felt: &Felt) {
        self.faces.touched();
        self.slow.aside_m = 0.0;
        let face = match self.contact {
            Some(contact) => contact.face,
            None => self.begin_slowly(tool, felt.steady),
        };
        self.follow_force(face, felt);
        let inward = -rotate(self.motion.pose.angle, face.outward());
        self.penetration.follow(felt.force.dot(&inward));
        let surface = tool - inward * self.penetration.depth;
        let before = self.motion.pose.position;
        self.motion.pose.position = surface + inward * self.faces.footprint.offset(face);
        if self.contact.is_some() {
            let velocity = (self.motion.pose.position - before) / TICK_S;
            let change = (velocity - self.motion.twist.linear) * (TICK_S / VELOCITY_S);
            self.motion.twist.linear += inward * inward.dot(&change);
        }
        self.centre.hold(SLIDE_DRIFT_M * SLIDE_DRIFT_M * TICK_S);
        self.contact = Some(ContactFrame {
            face,
            inward,
            surface,
        });
    }

    fn follow_force(&mut self, face: Face, felt: &Felt) {
        if self.slow.settling > 0 {
            self.slow.settling -= 1;
            self.motion.twist.angular = 0.0;
            self.angle = Track::at_rest(ANY_NORMAL_RAD * ANY_NORMAL_RAD);
        }
        self.follow_angle(face, felt, TURN_RAD_PER_S2);
    }

    /// The first tick of a contact under this force (N): the face that has to turn least.
    fn begin_slowly(&mut self, tool: Vec2, force: Vec2) -> Face {
        self.penetration.begin(tool, force);
        self.slow = Slow {
            settling: SETTLING_TICKS,
            ..Slow::default()
        };
        self.motion.twist = Twist::default();
        let in_object = rotate(-self.motion.pose.angle, force);
        let along = |face: &Face| -face.outward().dot(&in_object);
        let best = Face::ALL
            .into_iter()
            .max_by(|a, b| along(a).total_cmp(&along(b)));
        best.unwrap_or(Face::West)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose_observer::ObserverConfig;
    use crate::sensing::VisionSample;
    use mmt_shared::fixtures::COUPLING;
    use mmt_shared::model::geometry::BoxFootprint;
    use mmt_shared::model::params::ModelParams;
    use mmt_shared::time::{TICK, Time};

    fn observer(quasi_static: bool) -> PoseObserver {
        let config = ObserverConfig {
            coupling: COUPLING,
            force_noise_n: 0.01,
            vision_noise_m: 3e-4,
            vision_noise_rad: 3e-3,
            size_noise_m: None,
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
