//! Recursive least squares for m, b, c of (1) with forgetting, a prior and physical bounds.
//!
//! Minimises (3) over all rows so far, each weighed by forgetting, plus a pull towards the last well
//! founded value: what the data do not show stays where it was. m ≥ 0.05 kg, b ≥ 0 and c ≥ 0 hold by the
//! constrained minimum. It must never publish a number that is not finite, and never move when no row
//! comes.

use mmt_shared::model::params::MASS_KG;
use mmt_shared::time::TICK_S;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::filter::Row;
use super::quadratic::{condition, inverse_of_gram, minimum_above};

/// Least values of m, b, c: the least mass that the model accepts, and no negative resistance.
const LEAST: Vector3<f64> = Vector3::new(MASS_KG.0, 0.0, 0.0);
/// Least variance of a filtered row's error, N²: 1 mN r.m.s., the default force noise after the filter.
const ROW_VARIANCE_MIN: f64 = 1e-6;
/// Least speed (m/s) at which a row separates b from c: half of the gate's.
const TELLING_SPEED: f64 = 0.010;
/// Pull of m towards the prior in powers of the noise: five times the scatter of the noise's power over
/// a memory, so that the matrix stays positive when the noise is taken away.
const PRIOR_PULL: f64 = 2.0;

/// What to do when the model suddenly predicts wrongly: friction has changed under the object.
///
/// Rows that do not fit are held back. If the misfit lasts, the friction found so far is dropped (it is
/// marginalised out, as if c had jumped to an unknown value), m and b keep a part of their weight, and
/// the filter starts anew because it still holds rows of the old friction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChangeTest {
    /// Share of the force by which the prediction must be off. 0.10: the force difference a hand feels.
    pub error_share: f64,
    /// For how long, s. 30 ms: longer than one swing of the filtered noise.
    pub after_s: f64,
    /// Share of the weight that m and b keep, 0 to 1. 0.05: m and b survive a change of mu, and a change
    /// of mass is still followed in half a second (measured in the tests).
    pub trust: f64,
}

impl Default for ChangeTest {
    fn default() -> Self {
        Self {
            error_share: 0.10,
            after_s: 0.030,
            trust: 0.05,
        }
    }
}

/// What noise of the measurements adds to the sums of products of a filtered row, in the mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RowNoise {
    /// Covariance of the regressor: of a (m/s²), v (m/s) and s.
    pub(super) gram: Matrix3<f64>,
    /// Covariance of the regressor and the force, N.
    pub(super) moment: Vector3<f64>,
}

impl RowNoise {
    pub(super) const ZERO: Self = Self {
        gram: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        moment: Vector3::new(0.0, 0.0, 0.0),
    };

    /// Of the acceleration alone, whose variance is this, (m/s²)².
    pub(super) fn of_acceleration(variance: f64) -> Self {
        Self {
            gram: Matrix3::from_diagonal(&Vector3::new(variance, 0.0, 0.0)),
            ..Self::ZERO
        }
    }

    /// With that of noise which has nothing to do with this, `power` times.
    fn with(&self, other: &Self, power: f64) -> Self {
        Self {
            gram: self.gram + other.gram * power,
            moment: self.moment + other.moment * power,
        }
    }
}

/// Whether a row was taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// It counts.
    Taken,
    /// It does not fit: held back.
    Doubted,
    /// The object has changed: the filter must start anew.
    Changed,
}

/// Settings of `RecursiveLeastSquares`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecursiveConfig {
    /// Weight that a row keeps from tick to tick. 0.998, a memory of 500 ms: half the error in b and c of
    /// 0.995; a change is followed by the change test, not by short memory (measured in the tests).
    pub forgetting: f64,
    /// Watching for a change of friction; none: forgetting alone.
    pub change: Option<ChangeTest>,
    /// Values of m (kg), b (N s/m), c (N) before any data.
    pub prior: [f64; 3],
    /// Standard deviation of the prior's b (N s/m) and c (N).
    pub prior_deviation: [f64; 2],
    /// By how much (standard deviation, same units) b and c may have moved away from their last well
    /// founded values while the data cannot separate them.
    pub held_deviation: [f64; 2],
    /// How many times the power of the noise the acceleration must have for m to count as seen.
    pub excitation: f64,
    /// Largest force that the uncertainty of b may stand for at the present speed, N.
    pub damping_force_n: f64,
}

impl Default for RecursiveConfig {
    fn default() -> Self {
        Self {
            forgetting: 0.998,
            change: Some(ChangeTest::default()),
            prior: [0.4, 0.0, 1.0],
            prior_deviation: [3.0, 3.0],
            held_deviation: [1.0, 1.0],
            excitation: 20.0,
            damping_force_n: 0.05,
        }
    }
}

/// The running solution.
#[derive(Clone, Copy, Debug)]
pub(super) struct RecursiveLeastSquares {
    config: RecursiveConfig,
    /// Noise that is in every row, what white noise of the force of 1 N adds, and the noise of the last row.
    least_noise: RowNoise,
    force_noise: RowNoise,
    noise: RowNoise,
    gram: Matrix3<f64>,
    moment: Vector3<f64>,
    weight: f64,
    /// Sums of the rows' scales and of their squares: how often the noise is in `moment` and in `gram`.
    scales: f64,
    scale_squares: f64,
    squares: f64,
    /// Sum of the squares of the rows' forces in memory, N²: what [`RecursiveLeastSquares::misfit`] is taken of.
    force_squares: f64,
    /// From how many root mean squares of the misfit on a row is doubted; 0: whatever the misfit is.
    doubt_deviations: f64,
    off_ticks: u32,
    settled: bool,
    founded: bool,
    held: Vector3<f64>,
    /// m (kg), b (N s/m), c (N).
    pub(super) estimate: Vector3<f64>,
    /// Covariance of m, b, c as if the errors of the rows were independent.
    pub(super) covariance: Matrix3<f64>,
    /// Condition number of the data in memory: see [`condition`].
    pub(super) condition: f64,
    /// Whether the last tick brought data from which m, b and c can all be found.
    pub(super) excited: bool,
    /// Rows so far.
    pub(super) samples: u64,
}

impl RecursiveLeastSquares {
    /// At the prior. `noise` is in every row, and `force_noise` for each N² of white noise of the force.
    #[must_use]
    pub(super) fn new(config: RecursiveConfig, noise: RowNoise, force_noise: RowNoise) -> Self {
        let prior = Vector3::from(config.prior).sup(&LEAST);
        let [b, c] = config.prior_deviation;
        Self {
            config,
            least_noise: noise,
            force_noise,
            noise,
            gram: Matrix3::zeros(),
            moment: Vector3::zeros(),
            weight: 0.0,
            scales: 0.0,
            scale_squares: 0.0,
            squares: 0.0,
            force_squares: 0.0,
            doubt_deviations: 0.0,
            off_ticks: 0,
            settled: false,
            founded: false,
            held: prior,
            estimate: prior,
            covariance: Matrix3::from_diagonal(&Vector3::new(prior.x * prior.x, b * b, c * c)),
            condition: f64::INFINITY,
            excited: false,
            samples: 0,
        }
    }

    /// The same that doubts a row only if it is off by more than so many root mean squares of the misfit.
    #[must_use]
    pub(super) fn doubting_from(mut self, deviations: f64) -> Self {
        self.doubt_deviations = deviations;
        self
    }

    /// The same where noise of the force is not in the motion.
    #[must_use]
    pub(super) fn without_force_noise(mut self) -> Self {
        self.force_noise = RowNoise::ZERO;
        self
    }

    /// Mean square of what the estimate leaves of the rows in memory, N²; none before there are any.
    #[must_use]
    pub(super) fn misfit(&self) -> Option<f64> {
        let explained = self
            .estimate
            .dot(&(self.moment * 2.0 - self.gram * self.estimate));
        (self.weight > 0.0).then(|| (self.force_squares - explained).max(0.0) / self.weight)
    }

    /// The forces of all rows so far were this many times as large: a gain of the force sensor has been found.
    pub(super) fn rescale(&mut self, times: f64) {
        self.moment *= times;
        self.squares *= times * times;
        self.force_squares *= times * times;
        self.held *= times;
        self.estimate *= times;
        self.covariance *= times * times;
    }

    /// Takes one filtered row of a force with this much white noise, N.
    pub(super) fn update(&mut self, row: &Row, force_noise_n: f64) -> Verdict {
        let power = force_noise_n * force_noise_n;
        self.noise = self.least_noise.with(&self.force_noise, power);
        let error = row.force - self.estimate.dot(&row.regressor);
        let verdict = self.doubt(row.force, error);
        match verdict {
            Verdict::Taken => self.take(row, error),
            Verdict::Doubted => self.excited = false,
            Verdict::Changed => self.drop_friction(),
        }
        verdict
    }

    /// No row this tick: the estimate is held.
    pub(super) fn hold(&mut self) {
        self.excited = false;
        self.off_ticks = 0;
    }

    /// Only a well founded estimate may doubt a row: at first it is the estimate that is wrong.
    fn doubt(&mut self, force: f64, error: f64) -> Verdict {
        let Some(change) = self.config.change else {
            return Verdict::Taken;
        };
        // 0.3 N: below, ten per cent would be force noise
        let share = change.error_share * force.abs().max(0.3);
        let usual = self.doubt_deviations * self.misfit().unwrap_or_default().sqrt();
        let off = error.abs() > share.max(usual);
        if !off || !self.settled {
            self.settled |= !off && self.excited;
            self.off_ticks = 0;
            return Verdict::Taken;
        }
        self.off_ticks = self.off_ticks.saturating_add(1);
        if f64::from(self.off_ticks) * TICK_S > change.after_s {
            Verdict::Changed
        } else {
            Verdict::Doubted
        }
    }

    fn take(&mut self, row: &Row, error: f64) {
        let keep = self.config.forgetting;
        self.gram = self.gram * keep + row.regressor * row.regressor.transpose();
        self.moment = self.moment * keep + row.regressor * row.force;
        self.weight = self.weight * keep + 1.0;
        self.scales = self.scales * keep + row.scale;
        self.scale_squares = self.scale_squares * keep + row.scale * row.scale;
        self.squares = self.squares * keep + error * error;
        self.force_squares = self.force_squares * keep + row.force * row.force;
        self.samples = self.samples.saturating_add(1);
        self.solve(row);
    }

    /// c has jumped to an unknown value: m and b by the rows so far without it, less trusted.
    fn drop_friction(&mut self) {
        self.hold();
        self.settled = false;
        let trust = self.config.change.map_or(1.0, |change| change.trust);
        let with_c = self.gram.column(2).into_owned();
        if with_c.z > 0.0 {
            let share = with_c / with_c.z;
            self.force_squares -= self.moment.z * self.moment.z / with_c.z;
            self.moment -= share * self.moment.z;
            self.gram -= share * with_c.transpose();
        }
        self.gram *= trust;
        self.moment *= trust;
        self.weight *= trust;
        self.scales *= trust;
        self.scale_squares *= trust;
        self.squares *= trust;
        self.force_squares *= trust;
    }

    fn solve(&mut self, row: &Row) {
        let variance = (self.squares / self.weight).max(ROW_VARIANCE_MIN);
        let pull = self.pull(variance);
        // noise in a regressor makes its parameter look smaller, 0.8 % of m at 10 µm and 3 to 5 % at 0.1 N: taken away, it does not
        let matrix = self.gram - self.noise.gram * self.scale_squares + pull;
        let right = self.moment - self.noise.moment * self.scales + pull * self.held;
        // (3), under the bounds
        let Some(estimate) = minimum_above(&matrix, &right, &LEAST) else {
            return self.hold();
        };
        let Some(inverse) = matrix.try_inverse() else {
            return self.hold();
        };
        if !estimate.iter().chain(inverse.iter()).all(|x| x.is_finite()) {
            return self.hold();
        }
        self.estimate = estimate;
        self.covariance = inverse * variance;
        self.judge(row, variance);
        if self.excited {
            self.founded = true;
            self.held = estimate;
        }
    }

    /// The pull towards the held value: for m as strong as the least acceleration that counts, for b and
    /// c by the prior deviations. Before anything was well founded the held value is only the prior,
    /// and m is pulled just enough to outweigh the noise.
    fn pull(&self, variance: f64) -> Matrix3<f64> {
        let (excitation, [b, c]) = if self.founded {
            (self.config.excitation, self.config.held_deviation)
        } else {
            (PRIOR_PULL, self.config.prior_deviation)
        };
        let m = self.weight * self.outweighs(excitation);
        Matrix3::from_diagonal(&Vector3::new(m, variance / (b * b), variance / (c * c)))
    }

    /// The power that outweighs the noise of an acceleration, (m/s²)²: `times` that of the noise which is in every row, and at least
    /// `PRIOR_PULL` times that of the last row's. Of a whole row: beside the centre, where the noise is smaller, this is the stricter. An
    /// object that does not move was taken to slide where it was scaled as well.
    fn outweighs(&self, times: f64) -> f64 {
        let always = times * self.least_noise.gram.m11;
        always.max(PRIOR_PULL * self.noise.gram.m11)
    }

    fn judge(&mut self, row: &Row, variance: f64) {
        let inverse = inverse_of_gram(&self.gram);
        self.condition = condition(&self.gram, inverse.as_ref());
        self.excited = inverse.is_some_and(|inverse| {
            // what of the acceleration v and s do not explain, and what b is worth at this speed
            let seen = 1.0 / inverse.m11;
            let b_force = (variance * inverse.m22).sqrt() * row.regressor.y.abs();
            self.condition.is_finite()
                && row.regressor.y.abs() > TELLING_SPEED
                && seen > self.weight * self.outweighs(self.config.excitation)
                && b_force < self.config.damping_force_n
        });
    }
}
