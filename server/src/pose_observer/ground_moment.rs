//! Turning by its cause: the moment of the push against the ground.
//!
//! The direction of the force shows theta, but is too noisy for omega to be had from it soon; the moment is
//! known at once. What resists is learned as a multiple of what a square of this m, b and c would resist.
//! It must never be used before the parameters have been learned.

use mmt_shared::model::params::{ModelParams, friction_torque_of_square};
use mmt_shared::time::TICK_S;

use crate::square_friction as square;

/// Speed of the centre from which the box slides for certain, m/s: the gate of the estimator.
const SLIDES_M_PER_S: f64 = 0.020;
/// Sliding after which the parameters are known well enough to reckon with, ticks.
const TICKS_TO_LEARN: u32 = 500;
/// Weight that a tick of the resistance keeps from tick to tick: a memory of 5 s of sliding.
const KEEP: f64 = 0.9998;
/// Pull of the resistance towards the square's, (N m)²: as much as 200 ticks at 50 mN m.
const PULL: f64 = 0.5;
/// Accepted multiple of the square's resistance.
const RESISTANCE: (f64, f64) = (0.3, 3.0);
/// Relative error that the square's own resistance may have: within it, an object is taken for a square.
const SQUARE_ERROR: f64 = 0.05;
/// Time constant of the radius e/c, s.
const RADIUS_S: f64 = 0.100;

/// What the push is doing to the box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Push {
    /// Side l of the square, m.
    pub(super) side: f64,
    /// Speed of the centre along the inward normal, m/s.
    pub(super) speed: f64,
    /// omega as known so far, rad/s.
    pub(super) omega: f64,
    /// Moment of the force about the centre, N m.
    pub(super) moment: f64,
}

/// What has been learned of turning.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turning {
    slid: u32,
    /// omega of the tick before, if the box slid then, rad/s.
    before: Option<f64>,
    /// Sums of squares of the square's torque and of its products with the real one, (N m)².
    squares: f64,
    products: f64,
    /// e/(c l) with which the local model turns as the box does.
    radius_ratio: f64,
}

impl Default for Turning {
    /// Nothing is known: e is (9).
    fn default() -> Self {
        Self {
            slid: 0,
            before: None,
            squares: 0.0,
            products: 0.0,
            // (9)
            radius_ratio: friction_torque_of_square(1.0, 1.0),
        }
    }
}

impl Turning {
    /// e/(c l) with which the local model turns as the box does.
    pub(super) fn radius_ratio(&self) -> f64 {
        self.radius_ratio
    }

    /// Whether the box has slid for long enough to be reckoned with.
    pub(super) fn is_learned(&self) -> bool {
        self.slid >= TICKS_TO_LEARN
    }

    /// omega (rad/s) after this tick's push, if it can be reckoned: not where more than the push may turn the box.
    pub(super) fn step(
        &mut self,
        params: &ModelParams,
        push: &Push,
        push_is_all: bool,
    ) -> Option<f64> {
        let before = self.before.take();
        if push.speed < SLIDES_M_PER_S {
            return None;
        }
        self.slid = self.slid.saturating_add(1);
        if !push_is_all {
            return None;
        }
        self.before = Some(push.omega);
        if !self.is_learned() {
            return None;
        }
        let Push {
            side,
            omega,
            moment,
            ..
        } = *push;
        let drag = square::drag(params, side, push.speed, omega);
        if let Some(before) = before {
            let real = moment - params.inertia() * (omega - before) / TICK_S;
            self.learn(drag * omega, real);
        }
        self.fit(params.c(), drag, push);
        Some(square::turned(
            params.inertia(),
            drag * self.resistance(),
            omega,
            moment,
        ))
    }

    /// What resists turning, as a multiple of the square's.
    fn resistance(&self) -> f64 {
        let (least, most) = RESISTANCE;
        ((self.products + PULL) / (self.squares + PULL)).clamp(least, most)
    }

    fn learn(&mut self, square: f64, real: f64) {
        self.squares = self.squares * KEEP + square * square;
        self.products = self.products * KEEP + square * real;
    }

    fn fit(&mut self, c: f64, drag: f64, push: &Push) {
        if c <= 0.0 {
            return;
        }
        let excess = self.resistance() - 1.0;
        let clear = (excess.abs() - SQUARE_ERROR).max(0.0).copysign(excess);
        let radius = square::friction_radius(c, drag * (1.0 + clear), push.speed, push.omega);
        self.radius_ratio += (radius / push.side - self.radius_ratio) * (TICK_S / RADIUS_S);
    }
}
