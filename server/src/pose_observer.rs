//! Where the object is: from touch and, where the mode uses it, from vision.
//!
//! In contact with a smooth tool the force is normal to the face, so its direction gives theta, and the
//! contact point gives the face's plane; along the face nothing pushes, so the centre keeps that
//! coordinate. Vision (slow, late, noisy) corrects what touch cannot see and teaches the distance from
//! the centre to each face. Pure; it must never use the true pose.

mod centre;
mod contact_frame;
mod face_map;
mod felt;
mod past;
mod penetration;
mod slow;
mod tangent_tracker;
mod track;
mod tracker;
mod turning;
mod vision;

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::dynamics::Motion;
use mmt_shared::model::geometry::{
    BoxFootprint, Face, Pose, Twist, Vec2, cross, rotate, wrap_angle,
};
use mmt_shared::model::params::{ModelParams, friction_torque_of_square};
use mmt_shared::model::settings::FrictionLaw;
use mmt_shared::time::{TICK_S, Time};

use face_map::FaceMap;
use past::{Past, PastPoses};
use penetration::Penetration;
use slow::Slow;
use track::Track;
use tracker::{BoxTracker, Tracker};
use turning::Push;

pub use contact_frame::ContactFrame;
pub use felt::Felt;

/// Force below which its direction is only noise, N: fifteen times the default sensor noise.
const FORCE_MIN_N: f64 = 0.15;
/// And no force below so many standard deviations of its noise has one.
const DEVIATIONS: f64 = 5.0;
/// Turning acceleration that the angle filter allows for while the box is pushed, rad/s²: all of it, and
/// what remains of it where the moment of the push is reckoned with.
const TURN_ACCELERATION: (f64, f64) = (20.0, 2.5);
/// Direction error of the force besides its noise (the face is not perfectly smooth), rad.
const DIRECTION_FLOOR_RAD: f64 = 2e-3;
/// Drift of the coordinate along the face while pushed, m per square root of a second.
const SLIDE_DRIFT_M: f64 = 5e-3;
/// Drift of a box that nobody touches, m per square root of a second.
const REST_DRIFT_M: f64 = 1e-5;
/// Error of the speed of a box that is let go, m/s, and by how much it turns while it settles, rad.
const LET_GO: (f64, f64) = (0.02, 0.02);
/// Unknown acceleration of a box that coasts, m/s² and rad/s²: how well its friction is known.
const COAST: (f64, f64) = (0.5, 2.5);
/// Spread of the normal of a new contact with a body that is no box, rad.
const ANY_NORMAL_RAD: f64 = 0.5;
/// A tool at one face can have reached the next if it is no farther from the corner between them than this share of the
/// way from the middle of the face.
const CORNER_SHARE: f64 = 0.5;
/// Images in a row that show the tool clear of the object.
const CLEAR_IMAGES: u32 = 5;
/// A tool is seen clear of the object at this distance, m, and so many standard deviations of what is known of it.
const CLEAR: (f64, f64) = (5e-3, 5.0);
/// A jump of the normal beyond this, rad, is a new contact with such a body.
const JUMP_RAD: f64 = 0.2;

/// What the observer assumes of its sensors and whether it learns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObserverConfig {
    /// Stiffness and damping between tool and object, to find the surface under the tool.
    pub coupling: Coupling,
    /// Force noise, N r.m.s. per axis.
    pub force_noise_n: f64,
    /// Vision noise, m r.m.s. per axis.
    pub vision_noise_m: f64,
    /// Vision noise of the angle, rad r.m.s.
    pub vision_noise_rad: f64,
    /// Error of the footprint that it starts from, m r.m.s. per face; none where nothing is known of the faces.
    pub size_noise_m: Option<f64>,
    /// Whether it takes images, learns the face offsets and reckons with how the box turns and slides. Otherwise vision
    /// gives the first pose only, as in the paper.
    pub learn: bool,
    /// Whether it is pushed so slowly that the push equals the ground's friction: then it is followed by the force alone.
    pub quasi_static: bool,
}

/// Follows pose, velocity and face offsets of the object.
#[derive(Clone, Debug)]
pub struct PoseObserver {
    config: ObserverConfig,
    motion: Motion,
    faces: FaceMap,
    angle: Track,
    /// How well the centre is known on each axis; in touch, along the face.
    centre: Track,
    contact: Option<ContactFrame>,
    penetration: Penetration,
    tracker: Tracker,
    past: PastPoses,
    /// Images in a row that show a tool in contact clear of the object.
    clear_images: u32,
    /// What is known beside that of a slow push.
    slow: Slow,
}

impl PoseObserver {
    /// Starts from the first pose of vision and a footprint.
    #[must_use]
    pub fn new(config: ObserverConfig, pose: Pose, footprint: BoxFootprint) -> Self {
        Self {
            config,
            motion: Motion {
                pose,
                twist: Twist::default(),
            },
            faces: FaceMap::new(footprint, config.size_noise_m),
            angle: Track::at_rest(config.vision_noise_rad.powi(2)),
            centre: Track::at_rest(config.vision_noise_m.powi(2)),
            contact: None,
            penetration: Penetration::new(config.coupling),
            tracker: Tracker::Box(BoxTracker::default()),
            past: PastPoses::default(),
            clear_images: 0,
            slow: Slow::default(),
        }
    }

    /// Pose of the object as the last HIP sample met it.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.motion.pose
    }

    /// The pose for a model that turns at `omega` (rad/s) and bleeds a turn in with the time constant `tau_s`: of a
    /// tangent, where it will be by then; of a box, the pose.
    #[must_use]
    pub fn pose_ahead(&self, omega: f64, tau_s: f64) -> Pose {
        let pose = self.put_aside(self.motion.pose);
        let (Some(contact), Tracker::Tangent(tangent)) = (self.contact, &self.tracker) else {
            return pose;
        };
        let turn = (tangent.rate - omega) * tau_s;
        Pose {
            position: contact.surface + rotate(turn, pose.position - contact.surface),
            angle: pose.angle + turn,
        }
    }

    /// Velocity of the object.
    #[must_use]
    pub fn twist(&self) -> Twist {
        self.motion.twist
    }

    /// Rate at which the object itself turns, rad/s: a tangent may turn on it.
    #[must_use]
    pub fn body_rate(&self) -> f64 {
        self.motion.twist.angular - self.tracker.slip()
    }

    /// Distances from the centre to the faces, as far as known.
    #[must_use]
    pub fn footprint(&self) -> BoxFootprint {
        self.faces.footprint
    }

    /// e/c (m) with which the local model turns as the box does; by (9) until the box has slid, and always
    /// in the paper's mode.
    #[must_use]
    pub fn friction_radius(&self) -> f64 {
        if self.config.quasi_static {
            return slow::RADIUS_M;
        }
        let ratio = match &self.tracker {
            Tracker::Box(tracker) => tracker.turning.radius_ratio(),
            // (9)
            Tracker::Tangent(_) => friction_torque_of_square(1.0, 1.0),
        };
        ratio * self.faces.footprint.mean_side()
    }

    /// Standard deviation of the place per axis, m, while nobody touches the object; in touch 0.
    #[must_use]
    pub fn deviation(&self) -> f64 {
        match self.contact {
            Some(_) => 0.0,
            None => self.centre.variance().sqrt(),
        }
    }

    /// What the tool touches; none without contact.
    #[must_use]
    pub fn contact(&self) -> Option<ContactFrame> {
        self.contact
    }

    /// Whether images show the tool clear of the object that it is taken to touch: what is felt is no contact.
    #[must_use]
    pub fn sees_clear(&self) -> bool {
        self.clear_images >= CLEAR_IMAGES
    }

    /// One tick: measured tool (m), force, whether the slave is in contact, and the parameters as
    /// estimated so far, by which a box that was let go coasts.
    pub fn step(
        &mut self,
        now: Time,
        tool: Vec2,
        felt: impl Into<Felt>,
        in_contact: bool,
        params: &ModelParams,
    ) {
        if in_contact && self.config.quasi_static {
            self.touch_slowly(tool, &felt.into());
        } else if in_contact {
            self.touch(tool, &felt.into(), params);
        } else {
            self.let_go(params);
        }
        self.penetration.remember(tool);
        self.past.push(Past {
            time: now,
            tool,
            pose: self.motion.pose,
            contact: self.contact,
        });
    }

    fn touch(&mut self, tool: Vec2, felt: &Felt, params: &ModelParams) {
        self.faces.touched();
        let force = felt.force;
        let face = match self.contact {
            Some(contact) => contact.face,
            None => self.begin_contact(tool, felt.steady),
        };
        let unknown = self.turn(force, params);
        self.follow_angle(face, felt, unknown);
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
                let offset = inward.dot(&(self.motion.pose.position - surface));
                self.faces
                    .learn(&mut self.tracker, face, offset, self.centre.variance());
            }
            self.slide_along(inward, params);
            self.follow_plane(face, inward, surface);
        }
        if let Tracker::Tangent(tangent) = &mut self.tracker {
            tangent.touch(self.motion.twist.angular);
        }
        self.centre.hold(SLIDE_DRIFT_M * SLIDE_DRIFT_M * TICK_S);
        self.contact = Some(ContactFrame {
            face,
            inward,
            surface,
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
        self.angle = Track::at_rest(ANY_NORMAL_RAD * ANY_NORMAL_RAD);
    }

    /// Turns the box by the moment of the push, where that can be reckoned, and returns the turning
    /// acceleration that remains unknown, rad/s².
    fn turn(&mut self, force: Vec2, params: &ModelParams) -> f64 {
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
            moment: cross(contact.surface - pose.position, force),
        };
        let Some(omega) = tracker.turning.step(params, &push) else {
            return all;
        };
        twist.angular = omega;
        rest
    }

    /// theta by the direction of the force.
    fn follow_angle(&mut self, face: Face, felt: &Felt, acceleration: f64) {
        self.motion.pose.angle += self.motion.twist.angular * TICK_S;
        self.angle.predict(acceleration);
        let (force, size) = (felt.force, felt.force.norm());
        if size < FORCE_MIN_N.max(DEVIATIONS * felt.noise_n) {
            return;
        }
        let direction = libm::atan2(-force.y, -force.x) - face.outward_angle();
        let innovation = wrap_angle(direction - self.motion.pose.angle);
        let tangent = matches!(self.tracker, Tracker::Tangent(_));
        if tangent && !self.tracker.is_settling() && innovation.abs() > JUMP_RAD {
            self.begin_tangent();
        }
        let spread = self.config.force_noise_n.max(felt.noise_n) / size;
        let variance = spread * spread + self.direction_floor_rad().powi(2);
        let (angle, rate) = self.angle.measure(variance);
        self.motion.pose.angle += angle * innovation;
        self.motion.twist.angular += rate * innovation;
    }

    fn let_go(&mut self, params: &ModelParams) {
        self.clear_images = 0;
        if let Some(was) = self.contact.take() {
            if let Tracker::Tangent(tangent) = &mut self.tracker {
                self.faces.guess(tangent, was.face);
            }
            self.lie_where_seen();
            self.centre.let_go(LET_GO.0 * LET_GO.0);
            self.angle.hold(LET_GO.1 * LET_GO.1);
        }
        // without images the friction alone shows where the box stops
        let coasts = self.config.learn && self.motion.twist != Twist::default();
        let (linear, angular) = if coasts { COAST } else { (0.0, 0.0) };
        self.centre.predict(linear);
        self.centre.widen(REST_DRIFT_M * REST_DRIFT_M * TICK_S);
        self.angle.predict(angular);
        let law = FrictionLaw::LimitSurface;
        self.motion = self.motion.step(law, params, Vec2::zeros(), Vec2::zeros());
    }

    /// Section III-A, case 1: the tool is inside the model and touches nothing. A face that has never
    /// been touched is not where it was thought to be and is retracted; a known face, or any in the
    /// paper's mode, means that the box is further away.
    pub fn retract_face(&mut self, tool: Vec2, face: Face) {
        if self.config.quasi_static {
            // no face of it is known
            return;
        }
        let pose = &mut self.motion.pose;
        let tool = pose.point_to_object(tool);
        if self.config.learn && !self.faces.footprint.within_ends(face, tool) {
            // slipped past the end of the face: the box is not further away, but aside
            return;
        }
        let depth = -self.faces.footprint.distance(face, tool);
        let is_box = matches!(self.tracker, Tracker::Box(_));
        let known = self.faces.is_known(face) && is_box;
        if let Some(away) = self.faces.retract(face, depth, self.config.learn && !known) {
            let inward = -rotate(pose.angle, face.outward());
            pose.position += inward * away;
            // that it is further away is a guess
            self.centre.widen(away * away);
        }
    }
}

#[cfg(test)]
mod tests;
