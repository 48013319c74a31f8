//! Where the object is: from touch and, where the mode uses it, from vision.
//!
//! In contact with a smooth tool the force is normal to the face, so its direction gives theta, and the
//! contact point gives the face's plane; along the face nothing pushes, so the centre keeps that
//! coordinate. Vision (slow, late, noisy) corrects what touch cannot see and teaches the distance from
//! the centre to each face. Pure; it must never use the true pose.

mod angle_track;
mod centre;
mod contact_force;
mod contact_frame;
mod face_map;
mod ground_moment;
mod past;
mod penetration;
mod slow;
mod slow_touch;
mod tangent_tracker;
mod touch;
mod track;
mod tracker;
mod vision;

use std::time::Duration;

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::dynamics::Motion;
use mmt_shared::model::geometry::{BoxFootprint, Face, Pose, Twist, Vec2, rotate, wrap_angle};
use mmt_shared::model::params::{ModelParams, friction_torque_of_square};
use mmt_shared::model::settings::FrictionLaw;
use mmt_shared::time::{TICK, TICK_S, Time};

use angle_track::AngleTrack;
use face_map::FaceMap;
use past::{Past, PastPoses};
use penetration::Penetration;
use slow::SlowTracker;
use track::Track;
use tracker::{BoxTracker, Tracker};

pub use contact_force::ContactForce;
pub use contact_frame::ContactFrame;

/// Drift of a box that nobody touches, m per square root of a second.
const REST_DRIFT_M: f64 = 1e-5;
/// Error of the speed of a box that is let go, m/s, and by how much it turns while it settles, rad.
const LET_GO: (f64, f64) = (0.02, 0.02);
/// Unknown acceleration of a box that coasts, m/s² and rad/s²: how well its friction is known.
const COAST: (f64, f64) = (0.5, 2.5);
/// So long after it is let go a box may still move, whatever its friction is taken for: it settles.
const SETTLES: Duration = Duration::from_millis(200);
/// Images in a row that show the tool clear of the object.
const CLEAR_IMAGES: u32 = 5;

/// The newest image counts for so long; then there are none.
const SEEN: Duration = Duration::from_millis(500);

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
    /// Largest coefficient of friction that the tool may have on the object; 0 of a smooth tool, whose force is normal to the
    /// face.
    pub tool_friction: f64,
    /// Whether it takes images: they show the pose, and the faces that are touched. Otherwise vision gives the first pose only,
    /// as in the paper.
    pub images: bool,
    /// Whether touch teaches it the face offsets too, and it reckons with how the box turns and slides: recommended mode.
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
    angle: AngleTrack,
    /// How well the centre is known on each axis; in touch, along the face.
    centre: Track,
    contact: Option<ContactFrame>,
    penetration: Penetration,
    tracker: Tracker,
    past: PastPoses,
    /// For how long the object may have come to rest: since it was let go, or an image showed that it moves after all.
    untouched: Duration,
    /// Images in a row that show a tool in contact clear of the object.
    clear_images: u32,
    /// When the newest image was taken.
    seen: Option<Time>,
}

impl PoseObserver {
    /// Starts from the first pose of vision and a footprint.
    #[must_use]
    pub fn new(config: ObserverConfig, pose: Pose, footprint: BoxFootprint) -> Self {
        let tracker = if config.quasi_static {
            Tracker::Slow(SlowTracker::default())
        } else {
            Tracker::Box(BoxTracker::default())
        };
        Self {
            config,
            motion: Motion {
                pose,
                twist: Twist::default(),
            },
            faces: FaceMap::new(footprint, config.size_noise_m),
            angle: AngleTrack::at_rest(config.vision_noise_rad.powi(2)),
            centre: Track::at_rest(config.vision_noise_m.powi(2)),
            contact: None,
            penetration: Penetration::new(config.coupling),
            tracker,
            past: PastPoses::default(),
            untouched: Duration::MAX,
            clear_images: 0,
            seen: None,
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
        if let Some(expected) = self.expected() {
            return expected;
        }
        let inward = self.contact.map_or(Vec2::zeros(), |contact| contact.inward);
        let pose = Pose {
            position: self.motion.pose.position + inward * self.tracker.aside_m(),
            ..self.motion.pose
        };
        let (Some(contact), Tracker::Tangent(tangent)) = (self.contact, &self.tracker) else {
            return pose;
        };
        let turn = (tangent.rate - omega) * tau_s;
        Pose {
            position: contact.surface + rotate(turn, pose.position - contact.surface),
            angle: pose.angle + turn,
        }
    }

    /// The box that the next contact is expected to be with, while nothing is touched; none where none is expected.
    fn expected(&self) -> Option<Pose> {
        match (&self.tracker, self.contact) {
            (Tracker::Slow(slow), None) => slow.expected,
            _ => None,
        }
    }

    /// By how much a model at `pose` is off, m, and turned, rad. Of an object that is pushed slowly nothing is known where no
    /// contact is expected.
    #[must_use]
    pub fn off(&self, pose: &Pose) -> (Vec2, f64) {
        let is_unknown = matches!((&self.tracker, self.contact), (Tracker::Slow(_), None));
        let known = if is_unknown { *pose } else { self.motion.pose };
        let wanted = self.expected().unwrap_or(known);
        let turn = wrap_angle(wanted.angle - pose.angle);
        (wanted.position - pose.position, turn)
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
        let ratio = match &self.tracker {
            Tracker::Box(tracker) => tracker.turning.radius_ratio(),
            // (9)
            Tracker::Tangent(_) => friction_torque_of_square(1.0, 1.0),
            Tracker::Slow(_) => return slow::RADIUS_M,
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

    /// Standard deviation of the angle, rad.
    #[must_use]
    pub fn angle_deviation(&self) -> f64 {
        self.angle.variance().sqrt()
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
        force: impl Into<ContactForce>,
        in_contact: bool,
        params: &ModelParams,
    ) {
        match self.tracker {
            _ if !in_contact => self.let_go(params),
            Tracker::Slow(_) => self.touch_slowly(tool, &force.into()),
            _ => self.touch(tool, &force.into(), params),
        }
        self.penetration.remember(tool);
        self.past.push(Past {
            time: now,
            tool,
            pose: self.motion.pose,
            contact: self.contact,
            force_turned: self.angle.error(),
        });
    }

    /// By how much the friction of the tool may turn the force from the normal of the face, rad. 0 while there are no images,
    /// because touch alone cannot tell this from a box that is turned, and where theta is the direction of the force by definition.
    fn friction_angle(&self) -> f64 {
        let is_seen = self
            .seen
            .is_some_and(|seen| self.past.newest().saturating_since(seen) <= SEEN);
        match self.tracker {
            Tracker::Box(_) if is_seen => libm::atan(self.config.tool_friction),
            _ => 0.0,
        }
    }

    fn let_go(&mut self, params: &ModelParams) {
        self.clear_images = 0;
        if let Some(was) = self.contact.take() {
            match &mut self.tracker {
                Tracker::Box(tracker) => tracker.let_go(),
                Tracker::Tangent(tangent) => self.faces.guess(tangent, was.face),
                Tracker::Slow(slow) => {
                    if let Some(pose) = slow.take_seen() {
                        let twist = Twist::default();
                        self.motion = Motion { pose, twist };
                    }
                }
            }
            self.may_move();
        }
        self.untouched = self.untouched.saturating_add(TICK);
        if self.rests() {
            self.centre.stop();
            self.angle.stop();
        }
        // without images the friction alone shows where the box stops
        let coasts = self.config.images && self.motion.twist != Twist::default();
        let (linear, angular) = if coasts { COAST } else { (0.0, 0.0) };
        self.centre.predict(linear);
        self.centre.widen(REST_DRIFT_M * REST_DRIFT_M * TICK_S);
        self.angle.predict(angular, 0.0);
        let law = FrictionLaw::LimitSurface;
        self.motion = self.motion.step(law, params, Vec2::zeros(), Vec2::zeros());
    }

    /// From now on the box may move, as one that was just let go.
    fn may_move(&mut self) {
        self.centre.let_go(LET_GO.0 * LET_GO.0);
        self.angle.let_go(LET_GO.1 * LET_GO.1);
        self.untouched = Duration::ZERO;
    }

    /// Whether friction holds a box that nobody touches, once it has settled: no image shows how fast it is.
    fn rests(&self) -> bool {
        self.untouched > SETTLES && self.motion.twist == Twist::default()
    }

    /// Section III-A, case 1: the tool is inside the model and touches nothing. A face that has never
    /// been touched is not where it was thought to be and is retracted; a known face, or any in the
    /// paper's mode, means that the box is further away.
    pub fn retract_face(&mut self, tool: Vec2, face: Face) {
        if matches!(self.tracker, Tracker::Slow(_)) {
            // no face of it is known
            return;
        }
        let pose = &mut self.motion.pose;
        let tool = pose.point_to_object(tool);
        let (nearest, gap) = self.faces.footprint.nearest(tool);
        if nearest != face && gap > 0.0 {
            // in front of another face: the box is not in the way of the tool
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
