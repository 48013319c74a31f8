//! How a contact begins, fitted: what a force sensor with a gain and a lag measures of an object at rest that is pressed through a
//! contact of known stiffness, stands, and slides.
//!
//! While the object stands, (6) gives the force from the tool's way. Once it slides, (1) gives its motion. Least squares with priors
//! find six unknowns, a step at a time. Pure, of one window.

use mmt_shared::model::contact::Coupling;
use mmt_shared::time::TICK_S;
use nalgebra::{SMatrix, SVector};

use crate::levenberg_marquardt::LevenbergMarquardt;

/// Ticks of a window before contact is noticed: a noisy force is averaged, and a lagging one comes late.
const BEFORE: usize = 20;
/// Ticks of a window from then on.
pub(super) const AFTER: usize = 300;
/// Ticks of a window.
pub(super) const WINDOW: usize = BEFORE + AFTER;
/// Which tick of a window may be the first that touches. Each has a search of its own, for the force jumps there.
pub(super) const FIRST_TOUCHES: std::ops::RangeInclusive<usize> = BEFORE - 12..=BEFORE;

const STEPS_MAX: u32 = 20;
/// A search ends where a step lowers the cost by less than this share.
const FALL: f64 = 1e-4;
/// A model of so few numbers is no better than this, N.
const MODEL_ERROR_N: f64 = 0.03;

/// ln m (kg), ln c (N), b (N s/m), ln g, the lag, and where the face stands (m along the push).
type Unknowns = SVector<f64, 6>;
type Samples = [f64; WINDOW];

/// ln m (kg) of any object.
const MASS: Normal = Normal {
    mean: -0.7,
    deviation: 1.0,
};
/// b (N s/m) of any object.
const DAMPING: Normal = Normal {
    mean: 2.0,
    deviation: 3.0,
};
/// Standard deviations of ln c about the force that is pressed with, and of the face's place, m.
const FRICTION_DEVIATION: f64 = 1.0;
const FACE_DEVIATION_M: f64 = 0.01;
/// By how much each unknown is moved for the derivative.
const DIFFERENCES: [f64; 6] = [1e-3, 1e-3, 1e-2, 1e-3, 1e-3, 1e-6];

/// A number that is normally distributed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Normal {
    pub(super) mean: f64,
    pub(super) deviation: f64,
}

/// What is known of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sensor {
    /// Natural logarithm of the gain.
    pub(super) ln_gain: Normal,
    /// Share of the measured force that is the one of the tick before: exp(-T/tau) at a lag of tau.
    pub(super) lag: Normal,
}

/// The beginning of a contact, along the push.
#[derive(Clone, Copy, Debug)]
pub(super) struct Onset {
    pub(super) coupling: Coupling,
    /// The tool, m.
    pub(super) tool: Samples,
    /// The measured force less its bias, N.
    pub(super) force: Samples,
    /// Noise of the force, N.
    pub(super) noise_n: f64,
}

/// What a search found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub(super) sensor: Sensor,
    /// Mean square of what is left, over the variance that is expected of it.
    pub(super) misfit: f64,
    /// Squares of what is left, and of how far the unknowns are from what was known, each over its variance.
    pub(super) cost: f64,
}

impl Onset {
    /// Inverse variance of a sample, 1/N².
    fn weight(&self) -> f64 {
        let noise_n = self.noise_n.max(MODEL_ERROR_N);
        1.0 / (noise_n * noise_n)
    }

    /// What the model measures beyond the sensor, N, tick by tick: (6) with damping, (1), lag and gain.
    fn left(&self, unknowns: &Unknowns, touches: usize) -> Samples {
        let [ln_m, ln_c, b, ln_gain, lag, mut face] = (*unknowns).into();
        let (m, c, gain) = (libm::exp(ln_m), libm::exp(ln_c), libm::exp(ln_gain));
        let (mut velocity, mut lagging) = (0.0, 0.0);
        let [mut before, ..] = self.tool;
        let mut left = [0.0; WINDOW];
        let samples = self.tool.iter().zip(&self.force);
        for (tick, (left, (&tool, measured))) in left.iter_mut().zip(samples).enumerate() {
            let rate = (tool - before) / TICK_S - velocity;
            before = tool;
            let force = if tick >= touches {
                self.coupling.force(tool - face, rate)
            } else {
                0.0
            };
            let free: f64 = m * velocity + TICK_S * (force - b * velocity);
            velocity = (free.abs() - TICK_S * c).max(0.0).copysign(free) / m;
            face += TICK_S * velocity;
            lagging = lag * lagging + (1.0 - lag) * force;
            *left = gain * lagging - measured;
        }
        left
    }
}

/// A search for the unknowns, with one tick as the first that touches: with the face's place the force would jump.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    pub(super) touches: usize,
    start: Unknowns,
    /// Inverse variances of what was known.
    weights: Unknowns,
    descent: LevenbergMarquardt<6>,
    steps: u32,
}

impl Search {
    /// At what is known.
    pub(super) fn new(onset: &Onset, known: &Sensor, touches: usize) -> Self {
        let near = onset.tool.iter().skip(touches.saturating_sub(1)).take(2);
        let last = onset.force.iter().skip(WINDOW - AFTER / 2);
        let pressed_n = mean(last).max(0.1);
        let known = [
            MASS,
            Normal {
                mean: libm::log(pressed_n),
                deviation: FRICTION_DEVIATION,
            },
            DAMPING,
            known.ln_gain,
            known.lag,
            Normal {
                mean: mean(near),
                deviation: FACE_DEVIATION_M,
            },
        ];
        let start = Unknowns::from(known.map(|of| of.mean));
        Self {
            touches,
            start,
            weights: Unknowns::from(known.map(|of| of.deviation.powi(-2))),
            descent: LevenbergMarquardt::new(start, f64::INFINITY, 1e-2),
            steps: 0,
        }
    }

    /// One step; whether it is the last.
    pub(super) fn step(&mut self, onset: &Onset) -> bool {
        let mut descent = self.descent;
        let left = onset.left(&descent.at, self.touches);
        if self.steps == 0 {
            descent.cost = self.cost_of(onset, &descent.at, &left);
        }
        self.steps += 1;
        let (hessian, gradient) = self.normal_equations(onset, &left);
        let step = descent.step(&hessian, &gradient, |next| {
            self.cost_of(onset, next, &onset.left(next, self.touches))
        });
        self.descent = descent;
        step.is_last(FALL) || self.steps >= STEPS_MAX
    }

    /// What it found; none where the numbers are none.
    pub(super) fn found(&self, onset: &Onset) -> Option<Fit> {
        let left = onset.left(&self.descent.at, self.touches);
        let (hessian, _) = self.normal_equations(onset, &left);
        let covariance = hessian.cholesky()?.inverse();
        let [_, _, _, ln_gain, lag, _] = self.descent.at.into();
        let [_, _, _, gain_variance, lag_variance, _] = covariance.diagonal().into();
        Some(Fit {
            sensor: Sensor {
                ln_gain: Normal {
                    mean: ln_gain,
                    deviation: gain_variance.sqrt(),
                },
                lag: Normal {
                    mean: lag,
                    deviation: lag_variance.sqrt(),
                },
            },
            misfit: onset.weight() * dot(&left, &left) / WINDOW as f64,
            cost: self.descent.cost,
        })
    }

    fn cost_of(&self, onset: &Onset, at: &Unknowns, left: &Samples) -> f64 {
        let off = at - self.start;
        onset.weight() * dot(left, left) + off.component_mul(&off).dot(&self.weights)
    }

    /// Half of the cost's Gauss–Newton Hessian and gradient.
    fn normal_equations(&self, onset: &Onset, left: &Samples) -> (SMatrix<f64, 6, 6>, Unknowns) {
        let mut slopes = [[0.0; WINDOW]; 6];
        for (index, (slope, difference)) in slopes.iter_mut().zip(DIFFERENCES).enumerate() {
            let beside = self.descent.at + Unknowns::ith(index, difference);
            *slope = onset.left(&beside, self.touches);
            for (r, left) in slope.iter_mut().zip(left) {
                *r = (*r - left) / difference;
            }
        }
        let slopes = slopes.each_ref();
        let hessian = SMatrix::from(slopes.map(|one| slopes.map(|other| dot(one, other))));
        let gradient = Unknowns::from(slopes.map(|one| dot(one, left)));
        let known = (self.descent.at - self.start).component_mul(&self.weights);
        let weight = onset.weight();
        let hessian = hessian * weight + SMatrix::from_diagonal(&self.weights);
        let gradient = gradient * weight + known;
        (hessian, gradient)
    }
}

fn dot(one: &Samples, other: &Samples) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

fn mean<'a>(of: impl ExactSizeIterator<Item = &'a f64>) -> f64 {
    let n = of.len() as f64;
    of.sum::<f64>() / n
}
