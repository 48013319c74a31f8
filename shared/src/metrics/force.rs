//! How near the model's force f_m is to the measured force f_s: PMSE (13)–(15) and what it cannot see.
//!
//! Forces are paired by HIP sample: f_s is measured for the sample that f_m was rendered for, before the
//! limiter. PMSE must never be the only judge: it ignores an axis on which either force is below F_min,
//! and a small axis can dominate it. So the same pairs give |f|-PMSE, a vector error and JND shares.

use serde::{Deserialize, Serialize};

use crate::model::geometry::Vec2;
use crate::stats::values::mean_of_sum;

/// F_min, N: below, no force is perceived at all (section IV-B).
pub const F_MIN_N: f64 = 0.04;
/// Lower end of the just noticeable difference of force, relative.
pub const JND_LOW: f64 = 0.07;
/// Upper end of the just noticeable difference of force, relative.
pub const JND_HIGH: f64 = 0.10;

/// Mean of (ln |s/m|)² over the samples on which both |s| and |m| exceed F_min; the constant c is 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct LogRatio {
    sum: f64,
    n: u64,
}

impl LogRatio {
    fn push(&mut self, s: f64, m: f64) {
        let (s, m) = (s.abs(), m.abs());
        if s > F_MIN_N && m > F_MIN_N {
            // one term of (13), (14); ln s − ln m instead of ln(s/m), which a huge s/m would overflow
            let log = libm::log(s) - libm::log(m);
            self.sum += log * log;
            self.n += 1;
        }
    }

    fn mean(&self) -> Option<f64> {
        mean_of_sum(self.sum, self.n)
    }
}

/// Accumulates every force metric from the paired forces of a run. Fixed size, no allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForceMetrics {
    x: LogRatio,
    y: LogRatio,
    magnitude: LogRatio,
    samples: u64,
    rejected: u64,
    in_contact: u64,
    sum_error2: f64,
    sum_measured2: f64,
    outside_low: u64,
    outside_high: u64,
}

impl ForceMetrics {
    /// Takes the measured force f_s and the model's force f_m of one HIP sample, N, world frame.
    ///
    /// A pair with a number that is not finite, or that squares beyond f64, is counted as rejected and
    /// otherwise ignored.
    pub fn push(&mut self, f_s: Vec2, f_m: Vec2) {
        let error2 = (f_s - f_m).norm_squared();
        let measured2 = f_s.norm_squared();
        let model2 = f_m.norm_squared();
        let sums_finite = (self.sum_error2 + error2).is_finite()
            && (self.sum_measured2 + measured2).is_finite()
            && model2.is_finite();
        if !sums_finite {
            self.rejected += 1;
            return;
        }
        self.samples += 1;
        // (13)
        self.x.push(f_s.x, f_m.x);
        // (14)
        self.y.push(f_s.y, f_m.y);
        let (measured, model) = (measured2.sqrt(), model2.sqrt());
        self.magnitude.push(measured, model);
        if measured > F_MIN_N || model > F_MIN_N {
            self.push_contact(error2, measured2);
        }
    }

    fn push_contact(&mut self, error2: f64, measured2: f64) {
        self.in_contact += 1;
        self.sum_error2 += error2;
        self.sum_measured2 += measured2;
        let outside = |jnd: f64| u64::from(error2 > jnd * jnd * measured2);
        self.outside_low += outside(JND_LOW);
        self.outside_high += outside(JND_HIGH);
    }

    /// Pairs that were not finite.
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// The metrics so far.
    pub fn summary(&self) -> ForceSummary {
        let (pmse_x, pmse_y) = (self.x.mean(), self.y.mean());
        let of_contact = |sum| mean_of_sum(sum, self.in_contact);
        let ratio = (self.sum_measured2 > 0.0).then(|| self.sum_error2 / self.sum_measured2);
        ForceSummary {
            samples: Some(self.samples),
            contact_samples: Some(self.in_contact),
            // (15)
            pmse: match (pmse_x, pmse_y) {
                (None, None) => None,
                (x, y) => Some(x.unwrap_or(0.0) + y.unwrap_or(0.0)),
            },
            pmse_x,
            pmse_y,
            pmse_magnitude: self.magnitude.mean(),
            relative_error: ratio.map(f64::sqrt),
            error_rms_n: of_contact(self.sum_error2).map(f64::sqrt),
            jnd7_share: of_contact(self.outside_low as f64),
            jnd10_share: of_contact(self.outside_high as f64),
        }
    }
}

/// The force metrics of a run, dimensionless where no unit stands; each finite, or absent where it has no meaning.
/// A contact sample is a pair with |f_s| > F_min or |f_m| > F_min: a touch that only one side feels is an error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ForceSummary {
    /// Pairs of f_s and f_m.
    pub samples: Option<u64>,
    /// Contact samples.
    pub contact_samples: Option<u64>,
    /// PMSE (15): the sum of the axes that are present.
    pub pmse: Option<f64>,
    /// PMSE_x (13): mean of (ln |f_s^x / f_m^x|)² over the samples on which both exceed F_min.
    pub pmse_x: Option<f64>,
    /// PMSE_y (14).
    pub pmse_y: Option<f64>,
    /// (13) with the magnitudes |f_s| and |f_m| in place of an axis.
    pub pmse_magnitude: Option<f64>,
    /// Relative vector error, sqrt(Σ|f_s − f_m|² / Σ|f_s|²) over the contact samples; absent if f_s is 0 on all of them.
    pub relative_error: Option<f64>,
    /// Root mean square of |f_s − f_m| over the contact samples, N.
    pub error_rms_n: Option<f64>,
    /// Share of the contact samples with |f_s − f_m| > 7 % of |f_s|, 0 to 1.
    pub jnd7_share: Option<f64>,
    /// Share of the contact samples with |f_s − f_m| > 10 % of |f_s|, 0 to 1.
    pub jnd10_share: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metrics(pairs: &[([f64; 2], [f64; 2])]) -> ForceSummary {
        accumulated(pairs).summary()
    }

    fn accumulated(pairs: &[([f64; 2], [f64; 2])]) -> ForceMetrics {
        let mut metrics = ForceMetrics::default();
        for (s, m) in pairs {
            metrics.push(Vec2::new(s[0], s[1]), Vec2::new(m[0], m[1]));
        }
        metrics
    }

    fn close(value: Option<f64>, expected: f64) -> bool {
        value.is_some_and(|v| (v - expected).abs() < 1e-12)
    }

    #[test]
    fn pmse_13_14_15_of_a_hand_computed_case() {
        let run = metrics(&[
            // ln(2/1) on x, ln|−3/1.5| on y: absolute values
            ([2.0, -3.0], [1.0, 1.5]),
            // ln(1/2) on x; y of the model is 0.03 N: the axis does not count here
            ([1.0, 0.5], [2.0, 0.03]),
            // neither axis counts
            ([0.02, 0.01], [0.5, 0.5]),
        ]);
        let ln2 = std::f64::consts::LN_2;
        assert!(close(run.pmse_x, ln2 * ln2));
        assert!(close(run.pmse_y, ln2 * ln2));
        assert!(close(run.pmse, 2.0 * ln2 * ln2));
    }

    #[test]
    fn n_of_an_axis_is_its_own_number_of_samples() {
        let run = metrics(&[
            ([1.0, 1.0], [1.0, 2.0]),
            ([1.0, 0.0], [1.0, 0.0]),
            ([4.0, 0.0], [1.0, 0.0]),
        ]);
        let ln2 = std::f64::consts::LN_2;
        assert!(close(run.pmse_x, 4.0 * ln2 * ln2 / 3.0));
        assert!(close(run.pmse_y, ln2 * ln2));
    }

    #[test]
    fn f_min_itself_is_not_above_f_min() {
        let above = F_MIN_N.next_up();
        assert_eq!(metrics(&[([F_MIN_N, 0.0], [1.0, 0.0])]).pmse_x, None);
        assert_eq!(metrics(&[([1.0, 0.0], [-F_MIN_N, 0.0])]).pmse_x, None);
        assert!(metrics(&[([above, 0.0], [-above, 0.0])]).pmse_x == Some(0.0));
    }

    #[test]
    fn an_axis_without_samples_is_absent_and_not_zero() {
        assert_eq!(metrics(&[]).pmse, None);
        let only_x = metrics(&[([2.0, 0.0], [1.0, 0.0])]);
        assert_eq!(only_x.pmse_y, None);
        assert_eq!(only_x.pmse, only_x.pmse_x);
        assert!(only_x.pmse_x.is_some());
    }

    #[test]
    fn every_sample_at_the_deadband_has_pmse_ln_1_minus_delta_squared() {
        let run = metrics(&[([2.0, 0.0], [1.8, 0.0]), ([1.0, 0.0], [0.9, 0.0])]);
        assert!(close(run.pmse, libm::log(0.9) * libm::log(0.9)));
    }

    #[test]
    fn magnitude_pmse_sees_size_and_the_vector_error_sees_direction() {
        // f_m is f_s turned by a quarter turn: as large, and as wrong as can be
        let turned = metrics(&[([3.0, 4.0], [-4.0, 3.0])]);
        assert!(close(turned.pmse_magnitude, 0.0));
        assert!(close(turned.relative_error, std::f64::consts::SQRT_2));
        let half = metrics(&[([3.0, 4.0], [1.5, 2.0])]);
        assert!(close(half.relative_error, 0.5));
        let ln2 = std::f64::consts::LN_2;
        assert!(close(half.pmse_magnitude, ln2 * ln2));
    }

    #[test]
    fn relative_error_and_jnd_shares_of_a_hand_computed_case() {
        let run = metrics(&[
            // error 0.08 of 1: outside 7 %, inside 10 %
            ([1.0, 0.0], [0.92, 0.0]),
            // error 0.5 of 2: outside both
            ([0.0, 2.0], [0.0, 2.5]),
            // error 0.05 of 5: inside both
            ([3.0, 4.0], [3.03, 4.04]),
            // only the model touches: outside both
            ([0.0, 0.0], [0.0, 0.3]),
            // free space on both sides: no contact sample
            ([0.01, 0.0], [0.0, 0.0]),
        ]);
        assert_eq!((run.samples, run.contact_samples), (Some(5), Some(4)));
        assert!(close(run.jnd7_share, 0.75));
        assert!(close(run.jnd10_share, 0.5));
        let error2 = 0.0064 + 0.25 + 0.0025 + 0.09;
        assert!(close(run.relative_error, (error2 / 30.0_f64).sqrt()));
        assert!(close(run.error_rms_n, (error2 / 4.0_f64).sqrt()));
    }

    #[test]
    fn a_model_that_alone_feels_a_force_has_no_relative_error_but_is_outside_the_jnd() {
        let run = metrics(&[([0.0, 0.0], [1.0, 0.0])]);
        assert_eq!(run.relative_error, None);
        assert!(close(run.jnd10_share, 1.0));
        assert!(close(run.error_rms_n, 1.0));
    }

    #[test]
    fn numbers_that_are_not_finite_are_counted_and_change_nothing() {
        let good = accumulated(&[([1.0, 2.0], [1.1, 2.1])]);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX] {
            for place in 0..4 {
                let mut run = good;
                let mut a = [1.0; 4];
                a[place] = bad;
                run.push(Vec2::new(a[0], a[1]), Vec2::new(a[2], a[3]));
                assert_eq!(run.rejected(), 1);
                assert_eq!(run.summary(), good.summary());
            }
        }
    }
}
