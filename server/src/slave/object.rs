//! Pose and parameters of the object, as the slave finds them.
//!
//! The object is the body that the tool touches, or touched last. What was found of each body is remembered.

use std::collections::BTreeMap;

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{BoxFootprint, Pose, Vec2, rotate};
use mmt_shared::model::params::{
    FRICTION_TORQUE_NM, ModelParams, friction_torque_of_square, inertia_of_square,
    least_stable_mass,
};
use mmt_shared::model::settings::Mode;
use mmt_shared::range::in_range;
use mmt_shared::time::{TICK, Time};
use serde::{Deserialize, Serialize};

use super::config::{SlaveConfig, SlaveError};
use crate::contact::Contact;
use crate::contact_prediction::{ContactPredictor, Expected};
use crate::environment::SIDE_M;
use crate::estimator::{
    Estimate, Estimator, EstimatorConfig, Measured, OBSTACLE_N, Seen, ToolGives,
};
use crate::pose_observer::{ContactForce, ObserverConfig, PoseObserver};
use crate::sensing::SensorLag;

/// Pushes whose directions differ by less than 60° are against the same obstacle: the cosine of that.
const SAME_PUSH: f64 = 0.5;

/// An object that is this far from where it was, m, is none that no tool moves: images show its place better.
const MOVED_M: f64 = 0.02;

/// The pose observer and the estimator, which need each other.
pub(super) struct ObjectEstimate {
    pub(super) observer: PoseObserver,
    pub(super) estimator: Estimator,
    /// Where the next contact of an object that is pushed slowly will be.
    predictor: Option<ContactPredictor>,
    /// The last parameters that were accepted.
    pub(super) params: ModelParams,
    /// Estimates whose numbers were not accepted as parameters.
    pub(super) refused: u64,
    /// Images that are older than what the observer remembers.
    pub(super) images_too_old: u64,
    /// Whether a mass too light for the coupling is brought to the least that is accepted.
    raises_mass: bool,
    coupling: Coupling,
    /// No hand presses with more, N.
    hand_force_max_n: f64,
    /// What gives while the tool presses.
    tool_gives: ToolGives,
    /// The tool as the estimator is given it, and how far that stands back, as late as the force.
    tool: SensorLag,
    back: SensorLag,
    observer_config: ObserverConfig,
    estimator_config: EstimatorConfig,
    /// Inward normal, world frame, of the face that was touched last.
    touched: Option<Vec2>,
    /// Where the body was when it was taken up, m.
    first: Vec2,
    /// What was met in the last tick.
    met: Option<Contact>,
    /// Number of the body.
    body: usize,
    /// What was found of other bodies, by their numbers.
    found: BTreeMap<usize, Found>,
    /// What is taken for true of a body that has never been touched, but for its footprint where that was seen.
    start: Found,
    /// Footprints of the bodies as vision saw them before the session, by their numbers.
    seen: Vec<BoxFootprint>,
    start_params: ModelParams,
}

/// What is remembered of a body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Found {
    /// What the model got: m, b, c, I, e.
    params: [f64; 5],
    /// The estimator's m, b and c.
    mbc: [f64; 3],
    footprint: BoxFootprint,
}

impl ObjectEstimate {
    /// Starts from the configured parameters, and from the pose that vision has averaged before the session and the footprints of
    /// all bodies that it saw; none where it sees no size.
    pub(super) fn try_new(
        config: &SlaveConfig,
        coupling: Coupling,
        pose: Pose,
        seen: Vec<BoxFootprint>,
    ) -> Result<Self, SlaveError> {
        let sensing = &config.sensing;
        let start = config.start;
        let mbc = [start.mass_kg, start.damping_ns_per_m, start.friction_n];
        let estimator = config
            .estimator
            .unwrap_or_else(|| EstimatorConfig::of_mode(config.mode, coupling))
            .starting_at(mbc);
        let learn = config.mode == Mode::Recommended;
        let observer = ObserverConfig {
            coupling,
            quasi_static: matches!(estimator, EstimatorConfig::QuasiStatic(_)),
            force_noise_n: sensing.force_noise_n,
            vision_noise_m: sensing.vision.position_noise_m,
            vision_noise_rad: sensing.vision.angle_noise_rad,
            size_noise_m: sensing.vision.size_noise_m.filter(|_| !seen.is_empty()),
            tool_friction: config.plant.friction_in(config.mode),
            images: learn || sensing.vision.rate_hz > 0.0,
            learn,
        };
        let [m, b, c] = mbc;
        in_range("start model: side", "m", start.side_m, SIDE_M)?;
        estimator.check()?;
        let hand_force_max_n = config.tool_energy.hand_force_max_n;
        let tool_gives = config.tool_gives();
        let footprint = (seen.first().copied()).unwrap_or(BoxFootprint::square(start.side_m));
        let params = ModelParams::of_square(m, b, c, footprint.mean_side(), &coupling)?;
        let start = Found {
            params: params.to_array(),
            mbc,
            footprint,
        };
        Ok(Self {
            observer: PoseObserver::new(observer, pose, footprint),
            estimator: Estimator::new(&estimator, coupling, hand_force_max_n, tool_gives),
            predictor: predictor(&observer),
            params,
            refused: 0,
            images_too_old: 0,
            // the paper's block fit may give anything, and what is out of range is no estimate
            raises_mass: matches!(estimator, EstimatorConfig::Recommended(_)),
            coupling,
            hand_force_max_n,
            tool_gives,
            tool: SensorLag::new(config.conditioning.lag_ms, None),
            back: SensorLag::new(config.conditioning.lag_ms, None),
            observer_config: observer,
            estimator_config: estimator,
            touched: None,
            first: pose.position,
            met: None,
            body: 0,
            found: BTreeMap::new(),
            start,
            start_params: params,
            seen,
        })
    }

    /// Goes over to the body that is touched now, at the pose that vision has averaged before. Returns whether that is
    /// another one than before.
    pub(super) fn follow_body(&mut self, contact: &Contact) -> bool {
        if contact.body == self.body {
            return false;
        }
        self.found.insert(self.body, self.own());
        self.take_up(contact.body, contact.truth);
        true
    }

    /// The contact that is expected, or was before this one.
    pub(super) fn expected(&self) -> Option<Expected> {
        self.predictor.as_ref()?.expected()
    }

    /// Number of the body.
    pub(super) fn body(&self) -> usize {
        self.body
    }

    /// What was found of all bodies, by their numbers.
    pub(super) fn found(&self) -> BTreeMap<usize, Found> {
        let mut all = self.found.clone();
        all.insert(self.body, self.own());
        all
    }

    fn own(&self) -> Found {
        let Estimate { m, b, c, .. } = *self.estimator.estimate();
        Found {
            params: self.params.to_array(),
            mbc: [m, b, c],
            footprint: self.observer.footprint(),
        }
    }

    /// Goes on with what was found in an earlier session; `body` is the one that was touched last, at `pose`.
    pub(super) fn remember(&mut self, found: &BTreeMap<usize, Found>, body: usize, pose: Pose) {
        self.found.clone_from(found);
        self.take_up(body, pose);
    }

    /// Takes up a body at `pose` with what was found of it. Parameters that the coupling of this session does not allow
    /// are those of the start.
    fn take_up(&mut self, body: usize, pose: Pose) {
        let unknown = Found {
            footprint: self.seen.get(body).copied().unwrap_or(self.start.footprint),
            ..self.start
        };
        let found = self.found.get(&body).copied().unwrap_or(unknown);
        let [m, b, c, inertia, e] = found.params;
        self.body = body;
        self.params =
            ModelParams::try_new(m, b, c, inertia, e, &self.coupling).unwrap_or(self.start_params);
        let estimator = self.estimator_config.starting_at(found.mbc);
        self.estimator = Estimator::new(
            &estimator,
            self.coupling,
            self.hand_force_max_n,
            self.tool_gives,
        );
        self.observer = PoseObserver::new(self.observer_config, pose, found.footprint);
        self.predictor = predictor(&self.observer_config);
        (self.touched, self.first) = (None, pose.position);
    }

    /// So many ticks, of which all but the last were missed; what the estimator was given. In those the tool and its force are
    /// taken to have gone straight on to what they are now. `held_back`: whether the limit of the tool's force keeps the tool
    /// from the HIP.
    pub(super) fn step(
        &mut self,
        now: Time,
        ticks: u32,
        contact: &Contact,
        held_back: bool,
    ) -> Measured {
        let before = self.met.replace(*contact).unwrap_or(*contact);
        for missed in (1..ticks).rev() {
            let then = now - TICK * missed;
            let share = f64::from(missed) / f64::from(ticks);
            self.take_in(then, &contact.towards(&before, share), held_back);
        }
        self.take_in(now, contact, held_back)
    }

    fn take_in(&mut self, now: Time, contact: &Contact, held_back: bool) -> Measured {
        if contact.rescaled != 1.0 {
            self.estimator.rescale(contact.rescaled);
        }
        let beyond_m = self.estimator.beyond_m(contact.back, contact.force);
        let obstacle = self.estimator.estimate().holding.is_some();
        let observer = &mut self.observer;
        observer.step(
            now,
            contact.tool,
            ContactForce {
                force: contact.force,
                steady: contact.steady,
                noise_n: contact.noise_n,
                beyond_m,
                obstacle,
            },
            contact.in_contact,
            &self.params,
        );
        if let Some(predictor) = &mut self.predictor {
            let touched = contact.in_contact.then_some(contact.force);
            predictor.step(contact.tool, touched, observer.pose());
            observer.expect(predictor.expected().filter(|_| !contact.in_contact));
        }
        if let Some(vision) = contact.vision {
            self.images_too_old += u64::from(observer.is_too_old(&vision));
            observer.see(&vision);
        }
        // as wide as the learned faces; without images the paper's never change
        let side = observer.footprint().mean_side();
        let measured = Measured {
            tool: self.tool.step(contact.tool),
            back: self.back.step(contact.back),
            force: contact.force,
            force_noise_n: contact.noise_n,
            held_back,
            normal: observer.contact().map(|frame| frame.inward),
            seen: Some(Seen {
                centre: observer.pose().position,
                turning: observer.twist().angular,
                body_turning: observer.body_rate(),
                side,
            }),
        };
        self.touched = measured.normal.or(self.touched);
        let estimate = self.estimator.step(&measured);
        self.take(self.accept(&estimate, side, held_back));
        measured
    }

    /// Whether friction alone is known to hold the object where the tool (m, world) is: it has been moved, and the tool is in front
    /// of another face than it touched last, so that it would not push against what was behind the object then.
    pub(super) fn only_friction_holds(&self, tool: Vec2) -> bool {
        let (pose, footprint) = (self.observer.pose(), self.observer.footprint());
        let (face, _) = footprint.nearest(pose.point_to_object(tool));
        let inward = -rotate(pose.angle, face.outward());
        let elsewhere = (self.touched).is_some_and(|touched| touched.dot(&inward) < SAME_PUSH);
        elsewhere && (pose.position - self.first).norm() > MOVED_M
    }

    /// Takes m (kg), b (N s/m) and c (N) of somebody else's in the place of the estimator's, if they are accepted.
    pub(super) fn replace(&mut self, [m, b, c]: [f64; 3]) {
        let side = self.observer.footprint().mean_side();
        let radius = self.observer.friction_radius();
        self.take(self.params_of(m, b, c, side, radius));
    }

    fn take(&mut self, params: Option<ModelParams>) {
        match params {
            Some(params) => self.params = params,
            None => self.refused += 1,
        }
    }

    /// The parameters of an estimate; none if they are not accepted.
    fn accept(&self, estimate: &Estimate, side: f64, held_back: bool) -> Option<ModelParams> {
        let Estimate { m, b, .. } = *estimate;
        // where nothing shows the mass, it may come out as next to none; the friction beside it is good all the same
        let m = if self.raises_mass {
            m.max(least_stable_mass(b, &self.coupling))
        } else {
            m
        };
        let c = match estimate.holding {
            // a tool that may press no harder does not find out how hard the object is held
            Some(_) if estimate.sticking && held_back => OBSTACLE_N,
            Some(holding) => holding,
            // before it slides it is as hard to push as expected
            None if !estimate.excited => self.expected().map_or(estimate.c, |e| e.force.norm()),
            None => estimate.c,
        };
        let radius = match estimate.holding {
            // (9): the radius was learned while the object slid, and now something holds it
            Some(_) => friction_torque_of_square(1.0, side),
            None => self.observer.friction_radius(),
        };
        let accepted = self.params_of(m, b, c, side, radius);
        // an object that is held is held whatever m and b come out as
        let held = estimate.holding.and(Some(&self.params));
        accepted.or_else(|| self.params_of(held?.m(), held?.b(), c, side, radius))
    }

    /// The parameters of an object that turns as one does whose friction has this radius e/c, m; none if they are not accepted.
    fn params_of(&self, m: f64, b: f64, c: f64, side: f64, radius: f64) -> Option<ModelParams> {
        let e = friction_torque(c, radius);
        ModelParams::try_new(m, b, c, inertia_of_square(m, side), e, &self.coupling).ok()
    }
}

/// For an object that is pushed slowly.
fn predictor(observer: &ObserverConfig) -> Option<ContactPredictor> {
    observer.quasi_static.then(ContactPredictor::default)
}

/// Friction torque e (N m) of c (N) at the radius e/c (m), at most what is accepted. Damping resists turning too, so the radius of
/// an object that slides with next to no friction is large, and another c may come beside it.
fn friction_torque(c: f64, radius: f64) -> f64 {
    let (least, most) = FRICTION_TORQUE_NM;
    (c * radius).clamp(least, most)
}

#[cfg(test)]
mod tests;
