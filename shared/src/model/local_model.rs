//! The local model: the box that the master renders and that the slave runs as its shadow.
//!
//! One HIP sample in, one force out: smooth the parameters (4), bleed the pose correction, touch, force
//! (6), step (5) or the limit surface. The master and the slave's shadow both run this very type, so that
//! the trigger compares with what the hand feels. It must never set a received pose on arrival (but for
//! the paper's literal mode), never allocate in a tick, and never see a number that was not checked.

mod body;
mod phantom;
mod received;
mod replay;

use std::time::Duration;

use crate::model::correction::{Correction, IN_CONTACT, IN_CONTACT_REPLAYED, Tank};
use crate::model::dynamics::Motion;
use crate::model::geometry::{Pose, Twist, Vec2};
use crate::model::history::{HISTORY_TICKS, History, Moment};
use crate::model::params::{ModelParams, ModelState};
use crate::model::settings::{ModelSettings, PoseCorrection, Smoothing};
use crate::model::update::Update;
use crate::time::{TICK, TICK_S, Time};

pub use body::{Body, BodyState, Rendered};

pub use replay::REPLAYED_PER_TICK;
use replay::Replay;

/// The box that is rendered.
#[derive(Clone, Debug)]
pub struct LocalModel {
    settings: ModelSettings,
    /// Parameters in use, footprint, pose, velocity, and the face that is touched.
    body: Body,
    /// Parameters that the smoothing in time runs towards.
    target: ModelParams,
    correction: Correction,
    history: History,
    /// The box as it should be, under [`PoseCorrection::Replay`].
    replay: Replay,
    /// The previous HIP and its stamp.
    previous: Option<(Time, Vec2)>,
    rendered: Rendered,
    /// For how long the HIP has touched the box.
    touched: Duration,
    /// The same at the sample that the last update answered, and the object's place in it (m); or at the start.
    last_update: (Duration, Vec2),
    /// Whether updates are of another object than the box that is felt.
    is_another: bool,
    /// Sum of what updates added to the model's energy beyond what the tank paid, J.
    injected_j: f64,
    /// Times that a number of the box was none.
    not_finite: u64,
}

impl LocalModel {
    /// A model at rest in `start`, with an empty history. The slave's tool presses with `tool_force_max_n` (N) at the most.
    pub fn new(settings: ModelSettings, start: ModelState, tool_force_max_n: f64) -> Self {
        Self {
            settings,
            body: Body::new(start),
            target: start.params(),
            correction: Correction::default(),
            history: History::with_capacity(HISTORY_TICKS),
            replay: Replay::new(start, tool_force_max_n),
            previous: None,
            rendered: Rendered::default(),
            touched: Duration::ZERO,
            last_update: (Duration::ZERO, start.pose().position),
            is_another: false,
            injected_j: 0.0,
            not_finite: 0,
        }
    }

    /// The settings that it is run by.
    pub fn settings(&self) -> &ModelSettings {
        &self.settings
    }

    /// Parameters in use, footprint, pose and velocity now.
    pub fn state(&self) -> &BodyState {
        &self.body.state
    }

    /// What the last HIP sample rendered.
    pub fn rendered(&self) -> &Rendered {
        &self.rendered
    }

    /// What remains of the pose correction, and its tank.
    pub fn correction(&self) -> &Correction {
        &self.correction
    }

    /// The pose that the model is on its way to: what it was sent, with the HIP since.
    pub fn pose_to_come(&self) -> Pose {
        let (pose, remaining) = (&self.body.state.pose, &self.correction.remaining);
        Pose {
            position: pose.position + remaining.shift,
            angle: pose.angle + remaining.turn,
        }
    }

    /// What the model was at each sample.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Energy that updates (parameters, pose, face offsets) have added to the model so far beyond what
    /// the tank paid, J: the sum over all ticks of every excess, so that a loss never hides a gain.
    pub fn energy_injected_j(&self) -> f64 {
        self.injected_j
    }

    /// All that the hand could get back, J: what spring and box hold, and what the tank has for corrections.
    pub fn returnable_j(&self) -> f64 {
        self.energy_now() + self.correction.tank.level_j().max(0.0)
    }

    /// Times that a number of the box was none, so that it went back to where it last was good.
    pub fn not_finite(&self) -> u64 {
        self.not_finite
    }

    /// How far the HIP goes before the next sample without the hand, m: the box goes with it.
    pub fn carry(&self) -> Vec2 {
        self.correction.carry()
    }

    /// How far the HIP is from the nearest face, m; negative inside.
    pub fn clearance(&self, hip: Vec2) -> f64 {
        self.body.gap(hip).1
    }

    /// Whether a received pose has been replayed up to the newest sample.
    pub fn is_replayed(&self) -> bool {
        self.replay.is_live()
    }

    /// Takes in an accepted update: parameters, footprint and pose.
    pub fn apply(&mut self, update: &Update) {
        if self.settings.correction == PoseCorrection::Replay && self.replay.is_busy() {
            self.replay.wait(update);
            return;
        }
        self.compare_with_last(update);
        let good = self.body;
        let before = self.energy_now();
        self.take_params(&update.state.params());
        match self.settings.correction {
            PoseCorrection::Snap => self.snap(update),
            PoseCorrection::MatchedStamps => self.match_stamps(update),
            PoseCorrection::Replay => self.restart(update),
        }
        self.account(before, before, self.energy_now());
        self.stay_finite(good);
    }

    /// Becomes what `other` is, but for the history, which stays: both took the same samples.
    pub fn take_over(&mut self, other: &Self) {
        self.body = other.body;
        self.target = other.target;
        self.correction = other.correction;
        self.replay = other.replay;
        self.previous = other.previous;
        self.rendered = other.rendered;
        self.touched = other.touched;
        self.last_update = other.last_update;
        self.is_another = other.is_another;
        self.injected_j = other.injected_j;
    }

    /// One sample period: the HIP (m, world) with its stamp in, the force out.
    ///
    /// The HIP's velocity is the difference to the previous sample over their stamps, so that the shadow,
    /// which gets the same samples later, computes the same.
    pub fn step(&mut self, stamp: Time, hip: Vec2) -> Rendered {
        self.take_carry();
        let hip_velocity = self.hip_velocity(stamp, hip);
        self.previous = Some((stamp, hip));
        let good = self.body;
        self.smooth(hip);
        self.correct(hip);
        self.remember(stamp, hip, hip_velocity);
        let (rendered, dissipated_w) = self.body.step(&self.settings, hip, hip_velocity);
        self.correction.tank.fill(dissipated_w * TICK_S);
        self.rendered = rendered;
        if rendered.in_contact() {
            self.touched += TICK;
        }
        self.go_on_replaying();
        self.stay_finite(good);
        self.rendered
    }

    /// Carries the box to where the HIP has been carried since the last sample: neither moves against the other.
    fn take_carry(&mut self) {
        let shift = self.correction.take_carry(&mut self.body.state.pose);
        if let Some((_, hip)) = &mut self.previous {
            *hip += shift;
        }
    }

    /// A number that is none never stays: the box is what it was when it last was `good`, at rest and felt no more.
    fn stay_finite(&mut self, good: Body) {
        let force = self.rendered.force;
        if self.body.is_finite() && force.x.is_finite() && force.y.is_finite() {
            return;
        }
        self.body = good;
        self.body.state.twist = Twist::default();
        self.target = good.state.params;
        self.correction = Correction::default();
        self.replay.stop();
        self.rendered = Rendered::default();
        self.not_finite = self.not_finite.saturating_add(1);
    }

    /// Smoothing in time. What heavier parameters add to a moving box is paid from the tank, or the box
    /// is slowed by as much.
    fn smooth(&mut self, hip: Vec2) {
        let Smoothing::InTime { tau_s } = self.settings.smoothing else {
            return;
        };
        let keep = libm::exp(-TICK_S / tau_s);
        let params = self.body.state.params.blend(&self.target, keep);
        self.changing(hip, |body, correction, _| {
            body.change_params(params, &mut correction.tank);
        });
    }

    /// One tick of pose correction. Turning about the proxy in contact costs nothing; in free space the
    /// box may come up to the HIP but not over it.
    fn correct(&mut self, hip: Vec2) {
        let rates = match self.settings.correction {
            PoseCorrection::Snap => return,
            PoseCorrection::MatchedStamps => IN_CONTACT,
            PoseCorrection::Replay => IN_CONTACT_REPLAYED,
        };
        self.changing(hip, |body, correction, settings| {
            let touch = body.touch(hip);
            let (_, gap) = body.gap(hip);
            let pose = &mut body.state.pose;
            correction.bleed(pose, touch.as_ref(), &settings.coupling, rates);
            if touch.is_none() {
                body.keep_off(hip, gap, correction);
            }
        });
        let stands = self.body.stands() && !self.replay.is_busy();
        self.correction
            .plan_carry(self.body.touch(hip).as_ref(), stands);
    }

    /// Does a change and accounts for the energy that it adds.
    fn changing(
        &mut self,
        hip: Vec2,
        change: impl FnOnce(&mut Body, &mut Correction, &ModelSettings),
    ) {
        let coupling = self.settings.coupling;
        let before = self.body.energy_j(&coupling, Some(hip));
        let tank = self.correction.tank;
        change(&mut self.body, &mut self.correction, &self.settings);
        let after = self.body.energy_j(&coupling, Some(hip));
        self.account(before, paid(&tank, &self.correction.tank) + before, after);
    }

    fn energy_now(&self) -> f64 {
        let hip = self.previous.map(|(_, hip)| hip);
        self.body.energy_j(&self.settings.coupling, hip)
    }

    /// Adds what lies above `allowed`, unless it is the last bit of a sum of `before`.
    fn account(&mut self, before: f64, allowed: f64, after: f64) {
        let excess = after - allowed;
        if excess > 1e-12 * before.max(1e-3) {
            self.injected_j += excess;
        }
    }

    fn hip_velocity(&self, stamp: Time, hip: Vec2) -> Vec2 {
        self.previous.map_or(Vec2::zeros(), |(then, previous)| {
            // stamps closer than half a period are a clock's jitter, not a faster hand
            let dt = stamp.saturating_since(then).max(TICK / 2).as_secs_f64();
            (hip - previous) / dt
        })
    }

    fn remember(&mut self, stamp: Time, hip: Vec2, hip_velocity: Vec2) {
        let state = &self.body.state;
        self.history.push(Moment {
            stamp,
            hip,
            hip_velocity,
            motion: Motion {
                pose: state.pose,
                twist: state.twist,
            },
            god: self.body.god,
            touched: self.touched,
            corrected: self.correction.done,
        });
    }

    /// One tick of the replay. What remains to be corrected is the way from the box that is felt to the replayed one.
    fn go_on_replaying(&mut self) {
        if self.settings.correction != PoseCorrection::Replay {
            return;
        }
        if let Some(pose) = self.replay.advance(&self.settings, &self.history) {
            self.correction.aim_at(&pose, &self.body.state.pose);
            self.leave_phantom();
            if let Some(update) = self.replay.take_waiting() {
                self.apply(&update);
            }
        }
    }
}

fn paid(before: &Tank, after: &Tank) -> f64 {
    before.level_j() - after.level_j()
}

#[cfg(test)]
mod tests;
