//! The bias of the measured force: how large it is, and how fast it drifts.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;
use nalgebra::{Matrix2, Vector2};

use super::noise::FIRST_SAMPLES;

/// A bias below this is left, N: half of F_min.
const LEFT_N: f64 = 0.02;
/// No bias of an untouched tool is more, N: more is contact.
pub(super) const MAX_N: f64 = 0.5;
/// Standard deviation of the drift before it is measured, N/s: a good sensor's.
const DRIFT_N_PER_S: f64 = 0.01;
/// A bias may have drifted by so much since it was last measured, N/s: three times a good sensor's.
pub(super) const DRIFT_MAX_N_PER_S: f64 = 3.0 * DRIFT_N_PER_S;
/// Standard deviations by which a bias strays in a second from a steady drift, N, and the drift from what it was, N/s.
const STRAYS: Vector2<f64> = Vector2::new(3e-3, 1e-3);

/// A sample shows the bias no better than one with this noise per axis, N: a real sensor's noise is not white, and 20 mN with a time
/// constant of 50 ms would else be a drift.
const SLOW_NOISE_N: f64 = 0.1;
/// A drift of fewer of its standard deviations is none while nothing is seen of the bias.
const KNOWN_DEVIATIONS: f64 = 3.0;

/// The bias. It is followed together with its drift by a Kalman filter, and goes on as it drifts while the tool touches and nothing
/// is seen of it. It is tared once it is large enough.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bias {
    value: Vec2,
    /// Its drift, N/s.
    drift: Vec2,
    /// Covariance of bias and drift, of each axis.
    covariance: Matrix2<f64>,
    samples: u32,
    /// Whether it is still being measured for the first time.
    pub(super) first: bool,
    /// Whether it is large enough to be tared.
    tared: bool,
    /// Time in contact since it was last measured, s.
    age_s: f64,
}

impl Default for Bias {
    fn default() -> Self {
        Self {
            value: Vec2::zeros(),
            drift: Vec2::zeros(),
            covariance: unknown_drift(MAX_N),
            samples: 0,
            first: true,
            tared: false,
            age_s: 0.0,
        }
    }
}

impl Bias {
    /// What is to be taken off the measured force, N.
    pub(super) fn known(&self) -> Vec2 {
        if self.tared {
            self.value
        } else {
            Vec2::zeros()
        }
    }

    /// By how much it may have drifted in contact since it was last measured, N.
    pub(super) fn drifted_n(&self) -> f64 {
        DRIFT_MAX_N_PER_S * self.age_s
    }

    /// Nothing is known of it, and the tool may touch.
    pub(super) fn begin(&mut self) {
        *self = Self {
            samples: FIRST_SAMPLES,
            first: false,
            age_s: MAX_N / DRIFT_MAX_N_PER_S,
            ..Self::default()
        };
    }

    /// Takes the force (N) of a tick in which the tool touches nothing, with noise (N) per axis.
    pub(super) fn follow(&mut self, measured: Vec2, noise_n: f64) {
        self.samples = self.samples.saturating_add(1);
        self.first &= self.samples < FIRST_SAMPLES;
        self.age_s = 0.0;
        self.predict(self.drift);
        let noise_n = noise_n.max(SLOW_NOISE_N);
        self.correct(measured, noise_n * noise_n);
        self.tare();
    }

    /// Takes the force (N) that is left where the tool has turned out to touch nothing, with this standard deviation (N) per axis.
    /// It has not drifted as it seemed to.
    pub(super) fn find(&mut self, left: Vec2, deviation: f64) {
        self.value = self.known() + left;
        self.drift = Vec2::zeros();
        self.covariance = unknown_drift(deviation);
        self.age_s = 0.0;
        self.tare();
    }

    /// Takes it off from now on if it is large enough.
    fn tare(&mut self) {
        self.tared |= !self.first && self.value.norm() > LEFT_N;
    }

    /// A tick in contact.
    pub(super) fn touch(&mut self) {
        self.age_s += TICK_S;
        self.go_on();
    }

    /// A tick in which nothing is seen of it.
    pub(super) fn go_on(&mut self) {
        let least = KNOWN_DEVIATIONS * self.covariance.m22.sqrt();
        let size = self.drift.norm();
        let known = size > least && size < DRIFT_MAX_N_PER_S;
        self.predict(if known { self.drift } else { Vec2::zeros() });
    }

    /// A tick of this drift, N/s.
    fn predict(&mut self, drift: Vec2) {
        self.value += drift * TICK_S;
        let step = Matrix2::new(1.0, TICK_S, 0.0, 1.0);
        let strays = STRAYS.component_mul(&STRAYS) * TICK_S;
        self.covariance =
            step * self.covariance * step.transpose() + Matrix2::from_diagonal(&strays);
    }

    /// Takes a sample of it with this variance, N².
    fn correct(&mut self, measured: Vec2, variance: f64) {
        let of_value = self.covariance.column(0).into_owned();
        let gain = of_value / (of_value.x + variance);
        let off = measured - self.value;
        self.value += off * gain.x;
        self.drift += off * gain.y;
        self.covariance -= gain * of_value.transpose();
    }
}

/// Covariance of a bias that is known to this standard deviation, N, and whose drift is not.
fn unknown_drift(deviation: f64) -> Matrix2<f64> {
    Matrix2::from_diagonal(
        &Vector2::new(deviation, DRIFT_N_PER_S).map(|deviation| deviation * deviation),
    )
}
