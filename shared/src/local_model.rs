//! The local model: the box that the master renders and that the slave runs as its shadow.
//!
//! One HIP sample in, one force out: smooth the parameters (4), bleed the pose correction, touch, force
//! (6), step (5) or the limit surface. The master and the slave's shadow both run this very type, so that
//! the trigger compares with what the hand feels. It must never set a received pose on arrival (but for
//! the paper's literal mode), never allocate in a tick, and never see a number that was not checked.

use crate::contact::{GodObject, Touch, contact_force};
use crate::correction::Correction;
use crate::dynamics::Motion;
use crate::geometry::{Face, Vec2, rotate};
use crate::history::{HISTORY_TICKS, History, Moment};
use crate::params::{ModelParams, ModelState};
use crate::settings::{ModelSettings, PoseCorrection, Smoothing};
use crate::time::{TICK, TICK_S, Time};
use crate::wire::message::{Cause, Update};

/// What the local model did with one HIP sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rendered {
    /// f_m, N, world: on the object; the hand gets −f_m.
    pub force: Vec2,
    /// What the HIP touches.
    pub touch: Option<Touch>,
}

impl Rendered {
    /// Whether the HIP touches the model.
    #[must_use]
    pub fn in_contact(&self) -> bool {
        self.touch.is_some()
    }
}

/// The box that is rendered.
#[derive(Clone, Debug)]
pub struct LocalModel {
    settings: ModelSettings,
    /// Parameters in use, footprint, pose and velocity.
    state: ModelState,
    /// Parameters that the smoothing in time runs towards.
    target: ModelParams,
    god: GodObject,
    correction: Correction,
    history: History,
    /// The previous HIP and its stamp.
    previous: Option<(Time, Vec2)>,
    rendered: Rendered,
}

impl LocalModel {
    /// A model at rest in `start`, with an empty history.
    #[must_use]
    pub fn new(settings: ModelSettings, start: ModelState) -> Self {
        Self {
            settings,
            state: start,
            target: start.params,
            god: GodObject::default(),
            correction: Correction::default(),
            history: History::with_capacity(HISTORY_TICKS),
            previous: None,
            rendered: Rendered::default(),
        }
    }

    /// The settings that it is run by.
    #[must_use]
    pub fn settings(&self) -> &ModelSettings {
        &self.settings
    }

    /// Parameters in use, footprint, pose and velocity now.
    #[must_use]
    pub fn state(&self) -> &ModelState {
        &self.state
    }

    /// What the last HIP sample rendered.
    #[must_use]
    pub fn rendered(&self) -> &Rendered {
        &self.rendered
    }

    /// What remains of the pose correction, and its tank.
    #[must_use]
    pub fn correction(&self) -> &Correction {
        &self.correction
    }

    /// What the model was at each sample.
    #[must_use]
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Takes in an accepted update: parameters, footprint and pose.
    pub fn apply(&mut self, update: &Update) {
        self.take_params(&update.state.params);
        match self.settings.correction {
            PoseCorrection::Snap => self.snap(update),
            PoseCorrection::MatchedStamps => self.match_stamps(update),
        }
    }

    fn take_params(&mut self, received: &ModelParams) {
        self.target = *received;
        if let Smoothing::PerPacket { lambda } = self.settings.smoothing {
            // (4)
            self.state.params = self.state.params.blend(received, lambda);
            self.target = self.state.params;
        }
    }

    /// The paper's way. Cases 1 and 2 of III-A and a lost contact set position and orientation, a force
    /// mismatch or the timer the orientation alone (a timer packet may say the model's own).
    fn snap(&mut self, update: &Update) {
        self.aim(update);
        match update.cause {
            Cause::MasterOnlyContact | Cause::SlaveOnlyContact | Cause::ContactLost => {
                self.state.footprint = update.state.footprint;
                self.correction.snap(&mut self.state.pose);
                self.state.twist = update.state.twist;
            }
            Cause::Deadband | Cause::EverySample | Cause::Timer => {
                let pivot = self
                    .rendered
                    .touch
                    .map_or(self.state.pose.position, |t| t.proxy);
                self.correction.snap_turn(&mut self.state.pose, pivot);
            }
        }
        self.correction.remaining = Default::default();
    }

    /// Compares at the stamp that the update answers; the ticks bleed the difference in.
    fn match_stamps(&mut self, update: &Update) {
        self.take_footprint(update);
        self.aim(update);
    }

    fn aim(&mut self, update: &Update) {
        let Some(then) = self.history.at(update.answers) else {
            return;
        };
        self.correction
            .aim(&update.state.pose, &then.motion.pose, &then.corrected);
    }

    /// Takes over the face offsets. The face that the HIP touches, or is in front of, stays where it is:
    /// the centre moves instead (which no force notices), and the bleed brings the plane to its place.
    /// Only when the slave does not touch is a face carved at once: the force must vanish anyway.
    fn take_footprint(&mut self, update: &Update) {
        let received = update.state.footprint;
        let Some((_, hip)) = self.previous else {
            self.state.footprint = received;
            return;
        };
        let face = self.god.touched().unwrap_or_else(|| self.facing(hip));
        let growth = received.offset(face) - self.state.footprint.offset(face);
        self.state.footprint = received;
        if growth <= 0.0 && !update.slave_in_contact {
            return;
        }
        let shift = -rotate(self.state.pose.angle, face.outward()) * growth;
        self.state.pose.position += shift;
        self.correction.count(shift);
    }

    fn facing(&self, hip: Vec2) -> Face {
        self.state
            .footprint
            .nearest(self.state.pose.point_to_object(hip))
            .0
    }

    /// One sample period: the HIP (m, world) with its stamp in, the force out.
    ///
    /// The HIP's velocity is the difference to the previous sample over their stamps, so that the shadow,
    /// which gets the same samples later, computes the same.
    pub fn step(&mut self, stamp: Time, hip: Vec2) -> Rendered {
        let hip_velocity = self.hip_velocity(stamp, hip);
        self.previous = Some((stamp, hip));
        if let Smoothing::InTime { tau_s } = self.settings.smoothing {
            let keep = libm::exp(-TICK_S / tau_s);
            self.state.params = self.state.params.blend(&self.target, keep);
        }
        if self.settings.correction == PoseCorrection::MatchedStamps {
            self.bleed(hip);
        }
        let motion = Motion {
            pose: self.state.pose,
            twist: self.state.twist,
        };
        let corrected = self.correction.done;
        self.history.push(Moment {
            stamp,
            hip,
            motion,
            corrected,
        });
        self.rendered = self.render(hip, hip_velocity);
        self.advance();
        self.rendered
    }

    /// One tick of pose correction. Turning about the proxy in contact costs nothing; in free space the
    /// box may come up to the HIP but not over it.
    fn bleed(&mut self, hip: Vec2) {
        let touch = self
            .god
            .touch_at(&self.state.footprint, &self.state.pose, hip);
        self.correction.bleed(
            &mut self.state.pose,
            touch.as_ref(),
            &self.settings.coupling,
        );
        if touch.is_none() {
            let after = self
                .god
                .touch_at(&self.state.footprint, &self.state.pose, hip);
            if let Some(after) = after {
                self.correction.back_off(&mut self.state.pose, &after);
            }
        }
    }

    fn hip_velocity(&self, stamp: Time, hip: Vec2) -> Vec2 {
        self.previous.map_or(Vec2::zeros(), |(then, previous)| {
            // stamps closer than half a period are a clock's jitter, not a faster hand
            let dt = stamp.saturating_since(then).max(TICK / 2).as_secs_f64();
            (hip - previous) / dt
        })
    }

    fn render(&mut self, hip: Vec2, hip_velocity: Vec2) -> Rendered {
        let state = &self.state;
        let touch = self.god.follow(&state.footprint, &state.pose, hip);
        // (6)
        let force = touch.map_or(Vec2::zeros(), |touch| {
            let coupling = &self.settings.coupling;
            contact_force(
                coupling,
                &touch,
                hip_velocity,
                &state.twist,
                state.pose.position,
            )
        });
        Rendered { force, touch }
    }

    fn advance(&mut self) {
        let lever = self
            .rendered
            .touch
            .map_or(Vec2::zeros(), |t| t.proxy - self.state.pose.position);
        let before = Motion {
            pose: self.state.pose,
            twist: self.state.twist,
        };
        let law = self.settings.friction;
        let after = before.step(law, &self.state.params, self.rendered.force, lever);
        self.correction
            .tank
            .fill(after.dissipation(law, &self.state.params) * TICK_S);
        self.state.pose = after.pose;
        self.state.twist = after.twist;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Coupling;
    use crate::geometry::{BoxFootprint, Pose, Twist};
    use crate::settings::Mode;

    const COUPLING: Coupling = Coupling {
        stiffness_n_per_m: 1000.0,
        damping_ns_per_m: 10.0,
    };

    fn state(m: f64, b: f64, c: f64) -> ModelState {
        let params = ModelParams::of_square(m, b, c, 0.4, &COUPLING).unwrap();
        ModelState::try_new(
            params,
            BoxFootprint::square(0.4),
            Pose::default(),
            Twist::default(),
        )
        .unwrap()
    }

    fn model(mode: Mode, correction: PoseCorrection) -> LocalModel {
        let settings = ModelSettings {
            correction,
            ..mode.model_settings(COUPLING)
        };
        LocalModel::new(settings, state(0.7, 3.0, 2.06))
    }

    fn update(cause: Cause, answers_ms: u64, state: ModelState) -> Update {
        Update {
            sequence: 1,
            cause,
            answers: Time::from_millis(answers_ms),
            newest_command: 1,
            slave_in_contact: true,
            state,
        }
    }

    /// Pushes the west face at 0.1 m/s from a stand-off of 1 cm; ticks from 1 to `until`.
    fn push(model: &mut LocalModel, ticks: std::ops::RangeInclusive<u64>) -> Rendered {
        let mut last = Rendered::default();
        for n in ticks {
            let hip = Vec2::new(-0.21 + 1e-4 * n as f64, 0.0);
            last = model.step(Time::from_millis(n), hip);
        }
        last
    }

    #[test]
    fn a_steady_push_is_met_by_friction_and_damping() {
        let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
        let rendered = push(&mut model, 1..=3000);
        // c + b v = 2.06 + 3·0.1
        assert!(
            (rendered.force.x - 2.36).abs() < 1e-6,
            "{:?}",
            rendered.force
        );
        assert!(rendered.force.y.abs() < 1e-12);
    }

    #[test]
    fn equation_4_blends_once_per_packet() {
        let mut model = model(Mode::Paper, PoseCorrection::Snap);
        push(&mut model, 1..=10);
        model.apply(&update(Cause::Timer, 10, state(0.9, 1.0, 4.06)));
        let params = model.state().params;
        assert!((params.m() - 0.8).abs() < 1e-12);
        assert!((params.b() - 2.0).abs() < 1e-12);
        assert!((params.c() - 3.06).abs() < 1e-12);
        push(&mut model, 11..=50);
        assert_eq!(model.state().params, params, "time alone changes nothing");
    }

    #[test]
    fn smoothing_in_time_has_its_time_constant() {
        let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
        push(&mut model, 1..=10);
        model.apply(&update(Cause::Timer, 10, state(1.7, 3.0, 2.06)));
        push(&mut model, 11..=30);
        let expected = 0.7 + 1.0 * (1.0 - libm::exp(-1.0));
        assert!((model.state().params.m() - expected).abs() < 1e-9);
    }

    #[test]
    fn a_received_pose_is_never_set_on_arrival() {
        let mut far = state(0.7, 3.0, 2.06);
        far.pose = Pose::new(-0.05, 0.03, 0.3);
        let jump = |correction| {
            let mut model = model(Mode::Recommended, correction);
            push(&mut model, 1..=1000);
            let before = model.rendered().force;
            model.apply(&update(Cause::SlaveOnlyContact, 1000, far));
            (push(&mut model, 1001..=1001).force - before).norm()
        };
        assert!(jump(PoseCorrection::Snap) > 10.0, "the effect exists");
        assert!(jump(PoseCorrection::MatchedStamps) < 0.5);
    }

    #[test]
    fn the_pose_is_held_against_what_the_model_was_at_the_stamp() {
        // the slave says, late, exactly what the model was: nothing must be corrected
        let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
        push(&mut model, 1..=1000);
        let then = model
            .history()
            .at(Time::from_millis(700))
            .unwrap()
            .motion
            .pose;
        let mut late = *model.state();
        late.pose = then;
        model.apply(&update(Cause::Deadband, 700, late));
        assert!(model.correction().remaining.shift.norm() < 1e-15);
        assert!(
            model.state().pose.position.x - then.position.x > 0.01,
            "the box has moved on"
        );
    }

    #[test]
    fn a_learned_offset_does_not_move_the_touched_face() {
        let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
        let before = push(&mut model, 1..=1000).touch.unwrap();
        let mut learned = *model.state();
        learned.footprint = BoxFootprint::square(0.36);
        learned.pose = model
            .history()
            .at(Time::from_millis(1000))
            .unwrap()
            .motion
            .pose;
        learned.pose.position.x -= 0.02;
        model.apply(&update(Cause::Deadband, 1000, learned));
        let after = push(&mut model, 1001..=1001).touch.unwrap();
        assert!((after.penetration - before.penetration).abs() < 1e-5);
        assert_eq!(model.state().footprint.west, 0.18);
        assert!(
            model.correction().remaining.shift.norm() < 1e-9,
            "plane and centre agree already"
        );
    }

    #[test]
    fn mismatch_case_1_releases_the_master() {
        // the slave is free where the master touches: the carved face lets go at once
        let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
        assert!(push(&mut model, 1..=105).in_contact());
        let mut carved = *model.state();
        carved.pose = model
            .history()
            .at(Time::from_millis(105))
            .unwrap()
            .motion
            .pose;
        carved.footprint.west -= 0.005;
        let free = Update {
            slave_in_contact: false,
            ..update(Cause::MasterOnlyContact, 105, carved)
        };
        model.apply(&free);
        assert!(!push(&mut model, 106..=106).in_contact());
    }

    #[test]
    fn mismatch_case_2_brings_the_model_to_the_hand() {
        let mut model = model(Mode::Paper, PoseCorrection::Snap);
        push(&mut model, 1..=50);
        let mut near = *model.state();
        near.pose.position.x -= 0.008;
        assert!(!model.rendered().in_contact());
        model.apply(&update(Cause::SlaveOnlyContact, 50, near));
        assert!(push(&mut model, 51..=51).in_contact());
    }

    #[test]
    fn in_free_space_the_box_comes_up_to_the_hip_and_not_over_it() {
        let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
        // not a whole number of the bleed's steps away
        let hip = Vec2::new(-0.2053, 0.0);
        let rest = |model: &mut LocalModel, ticks: std::ops::RangeInclusive<u64>| {
            ticks
                .map(|n| model.step(Time::from_millis(n), hip).force.norm())
                .fold(0.0, f64::max)
        };
        rest(&mut model, 1..=10);
        let mut nearer = *model.state();
        nearer.pose.position.x -= 0.020;
        model.apply(&update(Cause::SlaveOnlyContact, 10, nearer));
        // the tank is empty: nothing has been dissipated yet
        let largest = rest(&mut model, 11..=500);
        let moved = model.state().pose.position.x;
        assert!((moved + 0.0053).abs() < 1e-6, "up to the HIP: {moved}");
        assert!(largest < 1e-6, "not over it: {largest} N");
    }

    #[test]
    fn two_models_with_the_same_samples_and_updates_are_equal_to_the_bit() {
        let run = || {
            let mut model = model(Mode::Recommended, PoseCorrection::MatchedStamps);
            push(&mut model, 1..=500);
            model.apply(&update(Cause::Deadband, 400, state(0.9, 1.0, 3.0)));
            push(&mut model, 501..=1500);
            *model.state()
        };
        assert_eq!(run(), run());
    }
}
