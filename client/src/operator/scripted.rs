//! The scripted operator: goes round the box and pushes its faces, as a person would who sees it.
//!
//! It plans on the box as it sees it (the local model, unless somebody wants to show why not), so it
//! follows what it pushes. Between its wish and the HIP is a hand, so force moves the HIP. A run is a
//! pure function of the configuration, the views and the forces. Its HIP must never jump, never leave
//! the finite numbers, and never enter the box but by the face it means to push.

mod config;
mod handover;
mod nudge_policy;
mod push_profile;
mod view;

use mmt_shared::model::geometry::{Face, Vec2, rotate};
use mmt_shared::range::OutOfRange;
use mmt_shared::time::TICK_S;

use super::hand::Hand;
use super::route;
use nudge_policy::NudgePolicy;
use push_profile::PushProfile;

pub use config::{ScriptedConfig, VisualFeedback};
pub use view::{Phase, View};

/// A push or an approach that takes longer is given up, s: the box is blocked or not there.
const GIVE_UP_S: f64 = 10.0;
/// A hand that pushes into air notices it after this long and approaches again, ticks: between the reflex
/// (50 ms) and the voluntary reaction to a touch (150 ms).
const REACTION_TICKS: u32 = 80;
/// Time from the touch to the full speed of the push, s: a hand loads what it touches before it shoves, and
/// a movement of two to three seconds takes about a third of it to reach its speed.
const PUSH_ONSET_S: f64 = 0.8;
/// Press of a hand that rests on a face, N: a light touch, below 1 N (Jeka and Lackner 1994).
const REST_PRESS_N: f64 = 0.5;
/// Time in which a resting hand makes up for a press that has changed, s: the voluntary reaction to a touch.
const REST_REACTION_S: f64 = 0.15;
/// A goal is reached when the wish is this near, m.
const REACHED_M: f64 = 0.005;
/// Rate at which a lateral error is steered out, 1/s, and the most speed for it, m/s.
const STEER_PER_S: f64 = 8.0;
const STEER_MAX_M_PER_S: f64 = 0.15;
/// Share of the acceleration limit that braking ahead of a goal counts on.
const BRAKE_SHARE: f64 = 0.6;
/// Where the HIP starts: in front of the first face, m.
pub const START_M: f64 = 0.25;

/// The scripted operator.
#[derive(Clone, Debug)]
pub struct Scripted {
    config: ScriptedConfig,
    hand: Hand,
    home: Vec2,
    seen: View,
    phase: Phase,
    ticks_in_phase: u32,
    face: Face,
    profile: PushProfile,
    pushes_begun: u64,
    pushes_completed: u64,
    /// Way made along the face's normal in this push, m.
    pushed: f64,
    nudge: NudgePolicy,
    /// Ticks without contact in a row.
    ticks_in_air: u32,
    /// Where the operator wants the HIP, m, and its velocity, m/s.
    wanted: Vec2,
    wanted_velocity: Vec2,
}

impl Scripted {
    /// An operator at rest in front of the west face of the box in `view`, which is where its home is.
    ///
    /// # Errors
    /// Names the first number of the configuration that is outside its range.
    pub fn try_new(config: ScriptedConfig, view: View) -> Result<Self, OutOfRange> {
        config.checked()?;
        let face = Face::West;
        let start =
            view.pose
                .point_to_world(route::in_front_of(&view.footprint, face, START_M, 0.0));
        Ok(Self {
            hand: Hand::new(config.hand, config.seed, start),
            home: view.pose.position,
            seen: view,
            phase: Phase::Travel,
            ticks_in_phase: 0,
            face,
            profile: PushProfile::draw(&config, 0),
            pushes_begun: 0,
            pushes_completed: 0,
            pushed: 0.0,
            nudge: NudgePolicy::new(config.dwell_s > 0.0, config.nudge_m),
            ticks_in_air: 0,
            wanted: start,
            wanted_velocity: Vec2::zeros(),
            config,
        })
    }

    /// Where the HIP is now, m, world frame.
    pub fn hip(&self) -> Vec2 {
        self.hand.hip()
    }

    /// What it is doing.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// The face that it pushes, or will push next.
    pub fn face(&self) -> Face {
        self.face
    }

    /// Pushes that went over their whole length.
    pub fn pushes_completed(&self) -> u64 {
        self.pushes_completed
    }

    /// Moves on by one tick T and returns the HIP, m, world frame.
    ///
    /// `view` is the box as it is seen now (a view that is not finite is ignored); `force_on_hand`
    /// is the device's force, N.
    pub fn step(&mut self, view: &View, force_on_hand: Vec2) -> Vec2 {
        if view.is_finite() {
            self.seen = *view;
        }
        self.decide();
        let wish = self.wish();
        let change = wish - self.wanted_velocity;
        let most = self.config.acceleration_m_per_s2 * TICK_S;
        self.wanted_velocity += change * (most / change.norm().max(most));
        let hip = self
            .hand
            .step(self.wanted, self.wanted_velocity, force_on_hand);
        self.wanted += self.wanted_velocity * TICK_S;
        self.give_way();
        self.ticks_in_air = if self.seen.in_contact {
            0
        } else {
            self.ticks_in_air.saturating_add(1)
        };
        if self.phase == Phase::Push && self.seen.in_contact {
            self.pushed += self.wanted_velocity.dot(&self.seen.inward(self.face)) * TICK_S;
        }
        self.ticks_in_phase = self.ticks_in_phase.saturating_add(1);
        hip
    }

    fn seconds_in_phase(&self) -> f64 {
        f64::from(self.ticks_in_phase) * TICK_S
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        self.ticks_in_phase = 0;
    }

    /// Goes on to the next phase when this one is done.
    fn decide(&mut self) {
        let late = self.seconds_in_phase() > GIVE_UP_S;
        match self.phase {
            Phase::Travel if self.distance_to(self.stand_off()) < REACHED_M => {
                self.enter(Phase::Approach);
            }
            Phase::Approach if self.seen.in_contact => {
                self.nudge.touch(self.seen.pose.position);
                self.enter(Phase::Push);
            }
            Phase::Dwell if self.seconds_in_phase() >= self.config.dwell_s => {
                let position = self.seen.pose.position;
                self.nudge.rested(self.face, position, self.pushed);
                self.enter(Phase::Push);
            }
            Phase::Push if self.pushed >= self.config.push_m => {
                self.pushes_completed += 1;
                self.enter(Phase::Hold);
            }
            Phase::Push if self.nudges() && self.nudge.is_nudged(self.pushed) => {
                self.enter(Phase::Dwell);
            }
            Phase::Push if self.ticks_in_air > REACTION_TICKS => self.enter(Phase::Approach),
            Phase::Approach | Phase::Push if late => self.enter(Phase::Retract),
            Phase::Hold if self.seconds_in_phase() >= self.config.hold_s => {
                self.enter(Phase::Retract);
            }
            Phase::Retract if self.distance_to(self.retreat()) < REACHED_M => self.next_push(),
            _ => {}
        }
    }

    fn nudges(&self) -> bool {
        self.nudge.nudges(self.face)
    }

    fn next_push(&mut self) {
        self.pushes_begun += 1;
        self.pushed = 0.0;
        self.nudge.begin();
        self.profile = PushProfile::draw(&self.config, self.pushes_begun);
        self.face = self.next_face();
        self.enter(Phase::Travel);
    }

    /// Round and round, unless the box has strayed: then the face that pushes it home.
    fn next_face(&self) -> Face {
        let next = route::next_face(self.face);
        let homeward = self.home - self.seen.pose.position;
        if homeward.norm() <= self.config.home_radius_m {
            return next;
        }
        let homeward_by = |face: Face| self.seen.inward(face).dot(&homeward);
        Face::ALL.into_iter().fold(next, |best, face| {
            if homeward_by(face) > homeward_by(best) {
                face
            } else {
                best
            }
        })
    }

    /// The velocity that the operator would like now, m/s, world frame.
    fn wish(&self) -> Vec2 {
        let config = &self.config;
        match self.phase {
            Phase::Travel => self.travel(),
            Phase::Approach => self.forward(config.approach_m_per_s),
            Phase::Push => self.forward(self.push_speed() * self.ease()),
            Phase::Dwell => self.rest_on_face(),
            Phase::Hold => Vec2::zeros(),
            Phase::Retract => self.towards(self.retreat()),
        }
    }

    /// Keeps a light press on the face and goes after it if it recedes.
    fn rest_on_face(&self) -> Vec2 {
        let inward = self.seen.inward(self.face);
        let press = self.hand.pull(self.wanted).dot(&inward);
        let way = (REST_PRESS_N - press) / self.config.hand.stiffness_n_per_m;
        inward * (way / REST_REACTION_S)
    }

    /// From the approach's speed at the touch up to the push's; a nudge keeps the approach's.
    fn push_speed(&self) -> f64 {
        if self.nudges() {
            return self.config.approach_m_per_s;
        }
        let seconds = self.seconds_in_phase();
        let share = (seconds / PUSH_ONSET_S).min(1.0);
        let approach = self.config.approach_m_per_s;
        approach + (self.profile.speed(seconds) - approach) * share
    }

    /// Along the face's inward normal, steered onto the lateral place that was drawn.
    fn forward(&self, speed: f64) -> Vec2 {
        let at = self.wanted_in_object();
        let left = route::left_of(self.face);
        let error = self.profile.lateral - left.dot(&at);
        let steer = (STEER_PER_S * error).clamp(-STEER_MAX_M_PER_S, STEER_MAX_M_PER_S);
        rotate(
            self.seen.pose.angle,
            left * steer - self.face.outward() * speed,
        )
    }

    /// 1 at a light press, 0 at the hardest: the operator does not push against a wall.
    fn ease(&self) -> f64 {
        let press = self
            .hand
            .pull(self.wanted)
            .dot(&self.seen.inward(self.face));
        (4.0 * (1.0 - press / self.config.press_max_n)).clamp(0.0, 1.0)
    }

    /// Does not let the wish run ahead into a box that stands: the press is at most the limit.
    fn give_way(&mut self) {
        if !matches!(self.phase, Phase::Dwell | Phase::Push | Phase::Hold) {
            return;
        }
        let inward = self.seen.inward(self.face);
        let excess = self.hand.pull(self.wanted).dot(&inward) - self.config.press_max_n;
        if excess > 0.0 {
            self.wanted -= inward * (excess / self.config.hand.stiffness_n_per_m);
            self.wanted_velocity -= inward * self.wanted_velocity.dot(&inward).max(0.0);
        }
    }

    fn travel(&self) -> Vec2 {
        let (at, goal) = (self.wanted_in_object(), self.stand_off());
        let next = route::way_point(&self.seen.footprint, at, self.face, goal);
        if next == goal {
            return self.towards(goal);
        }
        let way = next - at;
        rotate(
            self.seen.pose.angle,
            way * (self.config.travel_m_per_s / way.norm().max(REACHED_M)),
        )
    }

    /// Straight to a point of the object's frame, braking in time.
    fn towards(&self, goal: Vec2) -> Vec2 {
        let way = goal - self.wanted_in_object();
        let distance = way.norm();
        let brake = BRAKE_SHARE * self.config.acceleration_m_per_s2;
        let speed = (2.0 * brake * distance)
            .sqrt()
            .min(self.config.travel_m_per_s);
        rotate(
            self.seen.pose.angle,
            way * (speed / distance.max(REACHED_M)),
        )
    }

    fn wanted_in_object(&self) -> Vec2 {
        self.seen.pose.point_to_object(self.wanted)
    }

    fn distance_to(&self, point_in_object: Vec2) -> f64 {
        (point_in_object - self.wanted_in_object()).norm()
    }

    fn stand_off(&self) -> Vec2 {
        route::in_front_of(
            &self.seen.footprint,
            self.face,
            self.config.stand_off_m,
            self.profile.lateral,
        )
    }

    /// Straight back from where the wish is to the retracted distance.
    fn retreat(&self) -> Vec2 {
        let lateral = route::left_of(self.face).dot(&self.wanted_in_object());
        route::in_front_of(
            &self.seen.footprint,
            self.face,
            self.config.retract_m,
            lateral,
        )
    }
}

#[cfg(test)]
mod tests;
