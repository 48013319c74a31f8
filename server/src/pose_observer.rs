//! Where the object is: from touch and, where the mode uses it, from vision.
//!
//! In contact with a smooth tool the force is normal to the face, so its direction gives theta, and the
//! contact point gives the face's plane; along the face nothing pushes, so the centre keeps that
//! coordinate. Vision (slow, late, noisy) corrects what touch cannot see and teaches the distance from
//! the centre to each face. Pure; it must never use the true pose.

mod stand_in;
mod turning;

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::dynamics::Motion;
use mmt_shared::model::geometry::{
    BoxFootprint, Face, Pose, Twist, Vec2, cross, rotate, wrap_angle,
};
use mmt_shared::model::params::{FACE_OFFSET_M, ModelParams};
use mmt_shared::model::settings::FrictionLaw;
use mmt_shared::time::{TICK_S, Time};

use crate::sensing::VisionSample;
use stand_in::StandIn;
use turning::{Push, Turning};

/// Force below which its direction says nothing, N: fifteen times the default sensor noise.
const FORCE_MIN_N: f64 = 0.15;
/// Turning acceleration that the angle filter allows for while the box is pushed, rad/s²: all of it, and
/// what remains of it where the moment of the push is reckoned with.
const TURN_ACCELERATION: (f64, f64) = (20.0, 2.5);
/// Direction error of the force besides its noise (the face is not perfectly smooth), rad.
const DIRECTION_FLOOR_RAD: f64 = 2e-3;
/// Drift of the coordinate along the face while pushed, m per square root of a second.
const SLIDE_DRIFT_M: f64 = 5e-3;
/// Drift of a box that nobody touches, m per square root of a second.
const REST_DRIFT_M: f64 = 1e-5;
/// How far a box that was let go may coast, m, and turn, rad.
const COAST: (f64, f64) = (3e-3, 0.02);
/// A carved face lies this far behind the tool that did not touch it, m; twice as far each time that the
/// tool still touches nothing, up to the most: the real face is found in a few steps, not in a hundred.
const CARVE_MARGIN_M: (f64, f64) = (1e-3, 8e-3);
/// Spread of the normal of a new contact with a body that is no box, rad, and the jump of it that begins one.
const ANY_NORMAL_RAD: f64 = 0.5;
const JUMP_RAD: f64 = 0.2;
/// The next contact with a body that is no box is looked for this much nearer than any so far, m.
const GUESS_MARGIN_M: f64 = 0.01;
/// Past that is kept for late vision, ticks: 256 ms.
const PAST: usize = 256;

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
    /// Recommended mode: vision is used all the time and face offsets are learned. Otherwise vision
    /// gives the first pose only, as in the paper.
    pub learn: bool,
}

/// Touch as the observer takes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touching {
    /// Face that is touched.
    pub face: Face,
    /// Inward unit normal, world.
    pub inward: Vec2,
    /// Point of the object's surface under the tool, world, m.
    pub surface: Vec2,
}

#[derive(Clone, Copy, Debug, Default)]
struct Past {
    time: Time,
    pose: Pose,
    touching: Option<Touching>,
}

/// Follows pose, velocity and face offsets of the object.
#[derive(Clone, Debug)]
pub struct PoseObserver {
    config: ObserverConfig,
    pose: Pose,
    twist: Twist,
    footprint: BoxFootprint,
    /// Vision samples that each face has been learned from, in the order of [`Face::ALL`].
    learned: [u32; 4],
    touching: Option<Touching>,
    penetration: f64,
    turning: Turning,
    stand_in: StandIn,
    /// How far behind the tool the next carved face will lie, m.
    carve_margin: f64,
    /// Covariance of (theta, omega): [theta², theta·omega, omega²].
    angle_cov: [f64; 3],
    /// Variance of the centre along the face (or, without touch, of both coordinates), m².
    slide_var: f64,
    past: [Past; PAST],
    next: usize,
}

impl PoseObserver {
    /// Starts from what vision said of pose and footprint.
    #[must_use]
    pub fn new(config: ObserverConfig, pose: Pose, footprint: BoxFootprint) -> Self {
        let (shift_var, angle_var) = (
            config.vision_noise_m.powi(2),
            config.vision_noise_rad.powi(2),
        );
        Self {
            config,
            pose,
            twist: Twist::default(),
            footprint,
            learned: [0; 4],
            touching: None,
            penetration: 0.0,
            turning: Turning::new(),
            stand_in: StandIn::default(),
            carve_margin: CARVE_MARGIN_M.0,
            angle_cov: [angle_var, 0.0, 0.0],
            slide_var: shift_var,
            past: [Past::default(); PAST],
            next: 0,
        }
    }

    /// Pose of the object as the last HIP sample met it.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// The pose to be told to a model that turns at `omega` (rad/s) and bleeds a turn in with the time
    /// constant `tau_s`: of a stand-in, where its tangent will be by then; else the pose.
    #[must_use]
    pub fn pose_ahead(&self, omega: f64, tau_s: f64) -> Pose {
        let Some(touching) = self.touching.filter(|_| self.stand_in.is_active()) else {
            return self.pose;
        };
        let turn = (self.stand_in.rate() - omega) * tau_s;
        Pose {
            position: touching.surface + rotate(turn, self.pose.position - touching.surface),
            angle: self.pose.angle + turn,
        }
    }

    /// Velocity of the object.
    #[must_use]
    pub fn twist(&self) -> Twist {
        self.twist
    }

    /// Rate at which the object itself turns, rad/s: unlike a stand-in's, whose tangent may turn on it.
    #[must_use]
    pub fn body_rate(&self) -> f64 {
        self.stand_in.body_rate(self.twist.angular)
    }

    /// Distances from the centre to the faces, as far as known.
    #[must_use]
    pub fn footprint(&self) -> BoxFootprint {
        self.footprint
    }

    /// e/c (m) with which the local model turns as the box does; by (9) until the box has slid, and always
    /// in the paper's mode.
    #[must_use]
    pub fn friction_radius(&self) -> f64 {
        self.turning.arm() * self.footprint.mean_side()
    }

    /// What is touched.
    #[must_use]
    pub fn touching(&self) -> Option<Touching> {
        self.touching
    }

    /// One tick: measured tool (m), force (N), whether the slave is in contact, and the parameters as
    /// estimated so far, by which a box that was let go coasts.
    pub fn step(
        &mut self,
        now: Time,
        tool: Vec2,
        force: Vec2,
        in_contact: bool,
        params: &ModelParams,
    ) {
        if in_contact {
            self.touch(tool, force, params);
        } else {
            self.let_go(params);
        }
        let past = Past {
            time: now,
            pose: self.pose,
            touching: self.touching,
        };
        if let Some(slot) = self.past.get_mut(self.next) {
            *slot = past;
        }
        self.next = (self.next + 1) % PAST;
    }

    fn touch(&mut self, tool: Vec2, force: Vec2, params: &ModelParams) {
        self.carve_margin = CARVE_MARGIN_M.0;
        let size = force.norm();
        if self.touching.is_none() {
            self.penetration = size / self.config.coupling.stiffness_n_per_m;
        }
        if self.touching.is_none() && self.stand_in.is_active() {
            self.begin_tangent();
        }
        let face = self
            .touching
            .map_or_else(|| self.face_of(tool, force), |touching| touching.face);
        let unknown = self.turn(force, params);
        self.follow_angle(face, force, size, unknown);
        let inward = -rotate(self.pose.angle, face.outward());
        self.follow_penetration(force.dot(&inward));
        let surface = tool - inward * self.penetration;
        if self.stand_in.is_fresh() {
            self.pose.position += self.twist.linear * TICK_S;
            let offset = inward.dot(&(self.pose.position - surface));
            self.footprint.set_offset(face, offset.max(FACE_OFFSET_M.0));
        } else {
            self.follow_plane(face, inward, surface);
        }
        self.stand_in.touch(self.twist.angular);
        self.slide_var += SLIDE_DRIFT_M * SLIDE_DRIFT_M * TICK_S;
        self.touching = Some(Touching {
            face,
            inward,
            surface,
        });
    }

    /// Moves the centre so that the face lies where the tool touches it.
    fn follow_plane(&mut self, face: Face, inward: Vec2, surface: Vec2) {
        let before = self.pose.position;
        let gap = inward.dot(&(surface - before)) + self.footprint.offset(face);
        self.pose.position += inward * gap;
        if self.touching.is_some() {
            let velocity = (self.pose.position - before) / TICK_S;
            // 20 ms, as long as the parameters' smoothing
            self.twist.linear += (velocity - self.twist.linear) * (TICK_S / 0.020);
        }
    }

    /// The normal of a new contact with a body that is no box may be any.
    fn begin_tangent(&mut self) {
        self.stand_in.begin();
        self.twist.angular = 0.0;
        self.angle_cov = [ANY_NORMAL_RAD * ANY_NORMAL_RAD, 0.0, 0.0];
    }

    /// Turns the box by the moment of the push, where that can be reckoned, and returns the turning
    /// acceleration that remains unknown, rad/s².
    fn turn(&mut self, force: Vec2, params: &ModelParams) -> f64 {
        let (all, rest) = TURN_ACCELERATION;
        let reckoned = self.config.learn && !self.stand_in.is_active();
        let Some(touching) = self.touching.filter(|_| reckoned) else {
            return all;
        };
        let push = Push {
            side: self.footprint.mean_side(),
            speed: self.twist.linear.dot(&touching.inward),
            omega: self.twist.angular,
            moment: cross(touching.surface - self.pose.position, force),
        };
        let Some(omega) = self.turning.step(params, &push) else {
            return all;
        };
        self.twist.angular = omega;
        rest
    }

    /// The face that a new touch is at: of a box the one that the force is normal to, of a stand-in the
    /// one that the tool is at, which is the one that the master pushes.
    fn face_of(&self, tool: Vec2, force: Vec2) -> Face {
        if self.stand_in.is_active() {
            return self.footprint.nearest(self.pose.point_to_object(tool)).0;
        }
        let in_object = rotate(-self.pose.angle, force);
        let mut best = (Face::East, f64::NEG_INFINITY);
        for face in Face::ALL {
            let along = -face.outward().dot(&in_object);
            if along > best.1 {
                best = (face, along);
            }
        }
        best.0
    }

    /// Inverts the force law: k_d d(pen)/dt + k_p pen = f, implicit.
    fn follow_penetration(&mut self, force: f64) {
        let Coupling {
            stiffness_n_per_m: k_p,
            damping_ns_per_m: k_d,
        } = self.config.coupling;
        self.penetration = (k_d * self.penetration + force * TICK_S) / (k_d + k_p * TICK_S);
    }

    /// Constant-velocity Kalman filter of theta on the direction of the force.
    fn follow_angle(&mut self, face: Face, force: Vec2, size: f64, acceleration: f64) {
        self.pose.angle += self.twist.angular * TICK_S;
        let [p, pc, q] = self.angle_cov;
        let noise = acceleration * acceleration * TICK_S;
        self.angle_cov = [
            p + 2.0 * pc * TICK_S + q * TICK_S * TICK_S,
            pc + q * TICK_S,
            q + noise * TICK_S,
        ];
        if size < FORCE_MIN_N {
            return;
        }
        let direction = libm::atan2(-force.y, -force.x) - face.outward_angle();
        let innovation = wrap_angle(direction - self.pose.angle);
        if self.stand_in.is_active() && !self.stand_in.is_fresh() && innovation.abs() > JUMP_RAD {
            self.begin_tangent();
        }
        let spread = self.config.force_noise_n / size;
        self.measure_angle(innovation, spread * spread + DIRECTION_FLOOR_RAD.powi(2));
    }

    fn measure_angle(&mut self, innovation: f64, variance: f64) {
        let [p, pc, q] = self.angle_cov;
        let total = p + variance;
        if total <= 0.0 {
            return;
        }
        let (gain_angle, gain_rate) = (p / total, pc / total);
        self.pose.angle += gain_angle * innovation;
        self.twist.angular += gain_rate * innovation;
        self.angle_cov = [
            p * (1.0 - gain_angle),
            pc * (1.0 - gain_angle),
            q - gain_rate * pc,
        ];
    }

    fn let_go(&mut self, params: &ModelParams) {
        if let Some(was) = self.touching.take() {
            self.guess_faces(was.face);
            self.slide_var += COAST.0 * COAST.0;
            self.angle_cov = [self.angle_cov[0] + COAST.1 * COAST.1, 0.0, 0.0];
        }
        self.slide_var += REST_DRIFT_M * REST_DRIFT_M * TICK_S;
        let motion = Motion {
            pose: self.pose,
            twist: self.twist,
        };
        let law = FrictionLaw::LimitSurface;
        let next = motion.step(law, params, Vec2::zeros(), Vec2::zeros());
        self.pose = next.pose;
        self.twist = next.twist;
    }

    /// Of a body that is no box the next contact will be another: its face is guessed to be nearer than any
    /// so far. A face that the tool meets too early is brought up to it at once; one that is met too late
    /// may recede from the hand only slowly.
    fn guess_faces(&mut self, touched: Face) {
        if !self.stand_in.is_active() {
            return;
        }
        let guess = self.stand_in.least_offset(self.footprint.offset(touched)) - GUESS_MARGIN_M;
        for face in Face::ALL {
            self.footprint.set_offset(face, guess.max(FACE_OFFSET_M.0));
        }
    }

    /// Takes in what vision saw some time ago, if this mode uses it.
    pub fn see(&mut self, vision: &VisionSample) {
        if !self.config.learn {
            return;
        }
        let Some(then) = self.at(vision.taken) else {
            return;
        };
        let gone_by = vision.pose.position - then.pose.position;
        let seen = vision.pose.angle + self.stand_in.turned();
        let turn = wrap_angle(seen - then.pose.angle);
        let noise = self.config.vision_noise_rad;
        if then.touching.is_some() && self.stand_in.see(vision.taken, turn, noise) {
            self.become_stand_in(gone_by);
            return;
        }
        if then.touching.is_none() || !self.stand_in.is_active() {
            self.measure_angle(turn, noise * noise);
        }
        let variance = self.config.vision_noise_m.powi(2);
        let gain = if variance > 0.0 {
            self.slide_var / (self.slide_var + variance)
        } else {
            1.0
        };
        self.slide_var *= 1.0 - gain;
        match (then.touching, self.touching) {
            (Some(was), Some(is)) if was.face == is.face => {
                let along = gone_by - is.inward * is.inward.dot(&gone_by);
                self.pose.position += along * gain;
                let known = self.footprint.offset(is.face);
                self.learn_offset(
                    was.face,
                    was.inward.dot(&(vision.pose.position - was.surface)),
                );
                // the face stays where it is touched: that the centre lies elsewhere is no motion
                self.pose.position += is.inward * (self.footprint.offset(is.face) - known);
            }
            (None, None) => self.pose.position += gone_by * gain,
            _ => {}
        }
    }

    /// The body is no box: the centre is where vision sees it, and what was learned of turning is void.
    fn become_stand_in(&mut self, gone_by: Vec2) {
        self.pose.position += gone_by;
        self.slide_var = self.config.vision_noise_m.powi(2);
        self.turning = Turning::new();
    }

    /// Running mean of a face's offset. Until a face has been learned itself, the first face's offset is
    /// the best guess for it (a square is assumed).
    fn learn_offset(&mut self, face: Face, offset: f64) {
        if self.stand_in.is_active() {
            if !self.stand_in.is_fresh() {
                let known = self.footprint.offset(face);
                let mean = known + (offset - known) * self.stand_in.offset_weight();
                self.footprint.set_offset(face, mean.max(FACE_OFFSET_M.0));
            }
            return;
        }
        let first = self.learned.iter().all(|count| *count == 0);
        for (other, count) in Face::ALL.into_iter().zip(&mut self.learned) {
            if other == face {
                *count = count.saturating_add(1);
                let known = self.footprint.offset(face);
                let mean = known + (offset - known) / f64::from(*count);
                self.footprint.set_offset(face, mean);
            }
        }
        if first || self.only_one_learned() {
            let mean = self.footprint.offset(face);
            for (other, count) in Face::ALL.into_iter().zip(&self.learned) {
                if *count == 0 {
                    self.footprint.set_offset(other, mean);
                }
            }
        }
    }

    fn only_one_learned(&self) -> bool {
        self.learned.iter().filter(|count| **count > 0).count() == 1
    }

    fn at(&self, time: Time) -> Option<Past> {
        // the newest that is not later; the ring is short and vision is slow
        self.past
            .iter()
            .filter(|past| past.time <= time && past.time > Time::ZERO)
            .max_by_key(|past| past.time)
            .copied()
    }

    /// Section III-A, case 1: the tool is inside the model and touches nothing. A face that has never
    /// been touched is not where it was thought to be and is carved back; a known face, or any in the
    /// paper's mode, means that the box is further away.
    pub fn carve(&mut self, tool: Vec2, face: Face) {
        let tool = self.pose.point_to_object(tool);
        if self.config.learn && !self.footprint.within_ends(face, tool) {
            // slipped past the end of the face: the box is not further away, but aside
            return;
        }
        let depth = -self.footprint.distance(face, tool);
        let depth = depth + self.carve_margin;
        if depth <= 0.0 {
            return;
        }
        let known = self.is_known(face) && !self.stand_in.is_active();
        if !self.config.learn || known {
            let inward = -rotate(self.pose.angle, face.outward());
            self.pose.position += inward * (depth - self.carve_margin + CARVE_MARGIN_M.0);
            return;
        }
        self.carve_margin = (self.carve_margin * 2.0).min(CARVE_MARGIN_M.1);
        // a tool past the centre has not found a face; the offset stays in its accepted range
        let carved = (self.footprint.offset(face) - depth).max(FACE_OFFSET_M.0);
        self.footprint.set_offset(face, carved);
    }

    fn is_known(&self, face: Face) -> bool {
        Face::ALL
            .into_iter()
            .zip(&self.learned)
            .any(|(other, count)| other == face && *count > 0)
    }
}

#[cfg(test)]
mod tests;
