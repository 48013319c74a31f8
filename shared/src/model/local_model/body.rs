//! The box itself: state, contact, force and motion, without anything that corrects it.
//!
//! The box that is felt and the box that is replayed are both this type, so that a replay does to the one
//! what the ticks did to the other. It must never change its parameters for more energy than was paid.

use crate::model::contact::{Coupling, GodObject, Touch, contact_force};
use crate::model::correction::{Correction, ROOM_M, Tank};
use crate::model::dynamics::Motion;
use crate::model::geometry::{BoxFootprint, Face, Pose, Twist, Vec2, rotate};
use crate::model::params::{ModelParams, ModelState};
use crate::model::settings::ModelSettings;

/// A box that is slower than this, m/s and rad/s, stands.
const STANDS_M_PER_S: f64 = 1e-3;
const STANDS_RAD_PER_S: f64 = 1e-2;

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
    pub fn in_contact(&self) -> bool {
        self.touch.is_some()
    }
}

/// What a box is now. It began as an accepted [`ModelState`] and has moved since, wherever the hand took it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyState {
    /// The impedance.
    pub params: ModelParams,
    /// One distance from the reference point to each face.
    pub footprint: BoxFootprint,
    /// `world_from_object`.
    pub pose: Pose,
    /// Velocity of the reference point and turning rate.
    pub twist: Twist,
}

impl From<ModelState> for BodyState {
    fn from(state: ModelState) -> Self {
        Self {
            params: state.params(),
            footprint: state.footprint(),
            pose: state.pose(),
            twist: state.twist(),
        }
    }
}

/// A box and the proxy on it: the local model without smoothing, correction and history.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    pub(super) state: BodyState,
    pub(super) god: GodObject,
}

impl Body {
    /// A box in `state` that nothing has touched yet.
    pub fn new(state: ModelState) -> Self {
        Self {
            state: state.into(),
            god: GodObject::default(),
        }
    }

    /// What it is now.
    pub fn state(&self) -> &BodyState {
        &self.state
    }

    /// Whether every number that moves is one.
    pub(super) fn is_finite(&self) -> bool {
        self.state.pose.is_finite() && self.state.twist.is_finite()
    }

    /// What the HIP touches with the box as it is; changes nothing.
    pub fn touch(&self, hip: Vec2) -> Option<Touch> {
        self.god
            .touch_at(&self.state.footprint, &self.state.pose, hip)
    }

    /// ½ k_p pen² + ½ m |v|² + ½ I omega², J: all that the hand could get back.
    pub(super) fn energy_j(&self, coupling: &Coupling, hip: Option<Vec2>) -> f64 {
        let touch = hip.and_then(|hip| self.touch(hip));
        let elastic = touch.map_or(0.0, |touch| coupling.energy(touch.penetration));
        elastic + self.kinetic_j(&self.state.params)
    }

    fn kinetic_j(&self, params: &ModelParams) -> f64 {
        let twist = &self.state.twist;
        0.5 * (params.m() * twist.linear.norm_squared()
            + params.inertia() * twist.angular * twist.angular)
    }

    /// Takes over parameters. Kinetic energy that a larger m or I would add is paid from the tank; if it
    /// cannot be, the box is slowed until there is no more of it than before.
    pub(super) fn change_params(&mut self, params: ModelParams, tank: &mut Tank) {
        let before = self.kinetic_j(&self.state.params);
        let after = self.kinetic_j(&params);
        self.state.params = params;
        if after > before && !tank.pay(after - before) {
            let share = (before / after).sqrt();
            self.state.twist.linear *= share;
            self.state.twist.angular *= share;
        }
    }

    /// Whether friction holds it.
    pub(super) fn stands(&self) -> bool {
        let Twist { linear, angular } = self.state.twist;
        linear.norm() < STANDS_M_PER_S && angular.abs() < STANDS_RAD_PER_S
    }

    /// The face that a HIP is in front of and how far, m; negative inside.
    pub(super) fn gap(&self, hip: Vec2) -> (Face, f64) {
        let hip_in_object = self.state.pose.point_to_object(hip);
        self.state.footprint.nearest(hip_in_object)
    }

    /// Takes back so much of a correction that a HIP in free space, which was `before` away from the box,
    /// is no nearer to it than [`ROOM_M`], or than it was: a correction may bring the box to the hand but
    /// not into it. What was touched before is touched no more.
    pub(super) fn keep_off(&mut self, hip: Vec2, before: f64, correction: &mut Correction) {
        let (face, gap) = self.gap(hip);
        let wanted = before.min(ROOM_M);
        if gap < wanted {
            let inward = -rotate(self.state.pose.angle, face.outward());
            correction.back_off(&mut self.state.pose, inward * (wanted - gap));
        }
        self.god
            .after_jump(&self.state.footprint, &self.state.pose, hip);
    }

    /// One sample period with the HIP (m, world) and its velocity (m/s). Returns what was rendered and the power that the
    /// ground took, W.
    pub fn step(
        &mut self,
        settings: &ModelSettings,
        hip: Vec2,
        hip_velocity: Vec2,
    ) -> (Rendered, f64) {
        self.step_within(settings, hip, hip_velocity, f64::INFINITY)
    }

    /// The same, pushed with no more than a force, N.
    pub(super) fn step_within(
        &mut self,
        settings: &ModelSettings,
        hip: Vec2,
        hip_velocity: Vec2,
        force_max_n: f64,
    ) -> (Rendered, f64) {
        let state = &mut self.state;
        let touch = self.god.follow(&state.footprint, &state.pose, hip);
        let centre = state.pose.position;
        // (6)
        let force = touch.map_or(Vec2::zeros(), |touch| {
            contact_force(
                &settings.coupling,
                &touch,
                hip_velocity,
                &state.twist,
                centre,
            )
            .cap_magnitude(force_max_n)
        });
        let lever = touch.map_or(Vec2::zeros(), |touch| touch.proxy - centre);
        let before = Motion {
            pose: state.pose,
            twist: state.twist,
        };
        let params = state.params.steadied(&state.footprint, &settings.coupling);
        let after = before.step(settings.friction, &params, force, lever);
        (state.pose, state.twist) = (after.pose, after.twist);
        let dissipated_w = after.dissipation(settings.friction, &params, &before.twist);
        (Rendered { force, touch }, dissipated_w)
    }
}
