//! Means with confidence intervals over independent runs.
//!
//! Student's t on the runs' own values, or on their logarithms for ratios. It must never hide how many
//! values there were: an interval of fewer than two is absent.

use mmt_shared::stats::values::mean;
use serde::Serialize;

/// 97.5 % points of Student's t for 1 to 30 degrees of freedom.
const T_975: [f64; 30] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160,
    2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056,
    2.052, 2.048, 2.045, 2.042,
];

/// 97.5 % point of Student's t: tabled to 30 degrees of freedom, then by Cornish and Fisher's expansion about the
/// normal's 1.95996 (error below 1e-4 there).
fn t_975(freedom: usize) -> f64 {
    let normal: f64 = 1.959_964;
    let tabled = freedom.checked_sub(1).and_then(|k| T_975.get(k));
    tabled.copied().unwrap_or_else(|| {
        let (n, z) = (freedom as f64, normal);
        let (z2, first) = (z * z, (z * z * z + z) / (4.0 * n));
        z + first + z * (5.0 * z2 * z2 + 16.0 * z2 + 3.0) / (96.0 * n * n)
    })
}

/// How probable a Student's t at least so far from zero is: two-sided, for whole degrees of freedom (Abramowitz and Stegun 1964,
/// 26.7.3 and 26.7.4).
fn t_beyond(t: f64, freedom: usize) -> f64 {
    let angle = libm::atan(t.abs() / (freedom as f64).sqrt());
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    let is_odd = freedom % 2 == 1;
    let mut term = if is_odd { cosine } else { 1.0 };
    let mut sum = if freedom == 1 { 0.0 } else { term };
    let first = if is_odd { 3 } else { 2 };
    for k in (first..freedom.saturating_sub(1)).step_by(2) {
        term *= cosine * cosine * (k - 1) as f64 / k as f64;
        sum += term;
    }
    let within = if is_odd {
        std::f64::consts::FRAC_2_PI * (angle + sine * sum)
    } else {
        sine * sum
    };
    (1.0 - within).clamp(0.0, 1.0)
}

/// The p-values of a family of tests after Holm's correction (1979), in their order.
#[must_use]
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    let p = |k: usize| p_values.get(k).copied().unwrap_or(1.0);
    order.sort_by(|a, b| p(*a).total_cmp(&p(*b)));
    let mut corrected = vec![1.0; p_values.len()];
    let mut least = 0.0_f64;
    for (rank, place) in order.into_iter().enumerate() {
        let left = (p_values.len() - rank) as f64;
        least = least.max((left * p(place)).min(1.0));
        if let Some(slot) = corrected.get_mut(place) {
            *slot = least;
        }
    }
    corrected
}

/// A mean and its 95 % confidence interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Interval {
    /// Number of values.
    pub n: usize,
    /// Mean (of logarithms: the geometric mean).
    pub mean: f64,
    /// Lower end; the mean's own value below two values.
    pub low: f64,
    /// Upper end; likewise.
    pub high: f64,
}

impl Interval {
    /// Of values; none without any. Values that are not finite are an error of the caller and make the mean so.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let values: Vec<f64> = values.into_iter().collect();
        let n = values.len();
        let mean = mean(values.iter().copied())?;
        let half = if n < 2 {
            0.0
        } else {
            let squares = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>();
            t_975(n - 1) * (squares / (n - 1) as f64 / n as f64).sqrt()
        };
        Some(Self {
            n,
            mean,
            low: mean - half,
            high: mean + half,
        })
    }

    /// How probable a mean at least so far from `value` is if that were the true one: two-sided, by Student's t. None of fewer
    /// than two values.
    #[must_use]
    pub fn p_against(&self, value: f64) -> Option<f64> {
        let freedom = self.n.checked_sub(1).filter(|freedom| *freedom > 0)?;
        let error = (self.high - self.mean) / t_975(freedom);
        Some(t_beyond((self.mean - value) / error, freedom))
    }

    /// Of the logarithms of what this is the interval of, if that was found by logarithms.
    #[must_use]
    pub fn logarithms(self) -> Self {
        let [mean, low, high] = [self.mean, self.low, self.high].map(libm::log);
        Self {
            mean,
            low,
            high,
            ..self
        }
    }

    /// Of positive values by their logarithms: geometric mean and an interval of ratios; none without any.
    #[must_use]
    pub fn of_ratios(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let logs = Self::of(values.into_iter().map(libm::log))?;
        Some(Self {
            n: logs.n,
            mean: libm::exp(logs.mean),
            low: libm::exp(logs.low),
            high: libm::exp(logs.high),
        })
    }
}

/// A straight line's slope by least squares.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Slope {
    /// How many points there were.
    pub n: usize,
    /// y for each x.
    pub value: f64,
    /// Its standard error, for points whose distances to the line are independent.
    pub error: f64,
}

impl Slope {
    /// Of points (x, y); none of fewer than three, and none where all x are the same.
    #[must_use]
    pub fn of(points: &[(f64, f64)]) -> Option<Self> {
        let n = points.len();
        let freedom = n.checked_sub(2).filter(|freedom| *freedom > 0)?;
        let mean_x = mean(points.iter().map(|(x, _)| *x))?;
        let mean_y = mean(points.iter().map(|(_, y)| *y))?;
        let off = || points.iter().map(|(x, y)| (x - mean_x, y - mean_y));
        let spread: f64 = off().map(|(x, _)| x * x).sum();
        if spread <= 0.0 {
            return None;
        }
        let value = off().map(|(x, y)| x * y).sum::<f64>() / spread;
        let squares: f64 = off().map(|(x, y)| (y - value * x) * (y - value * x)).sum();
        let error = (squares / freedom as f64 / spread).sqrt();
        Some(Self { n, value, error })
    }
}

/// Abscissae at which two curves are compared.
const PLACES: usize = 64;

/// Mean of the difference of two curves over the abscissae that both cover.
#[must_use]
pub fn log_ratio(first: &[(f64, f64)], second: &[(f64, f64)]) -> Option<f64> {
    let low = first.first()?.0.max(second.first()?.0);
    let high = first.last()?.0.min(second.last()?.0);
    if low >= high {
        return None;
    }
    let places = (0..PLACES).map(|k| low + (high - low) * (k as f64 + 0.5) / PLACES as f64);
    let differences: Option<Vec<f64>> = places
        .map(|x| Some(interpolated(first, x)? - interpolated(second, x)?))
        .collect();
    mean(differences?)
}

/// A curve at an abscissa, joined by straight lines.
fn interpolated(curve: &[(f64, f64)], x: f64) -> Option<f64> {
    curve.windows(2).find_map(|pair| {
        let ((x0, y0), (x1, y1)) = (*pair.first()?, *pair.last()?);
        let inside = (x0..=x1).contains(&x) && x1 > x0;
        inside.then(|| y0 + (y1 - y0) * (x - x0) / (x1 - x0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_a_hand_computed_case() {
        // distances to the line 0.9 x + 0.4: -0.4, 0.7, -0.2, -0.1
        let slope = Slope::of(&[(0.0, 0.0), (1.0, 2.0), (2.0, 2.0), (3.0, 3.0)]).unwrap();
        assert!((slope.value - 0.9).abs() < 1e-12 && slope.n == 4);
        assert!((slope.error - (0.7_f64 / 2.0 / 5.0).sqrt()).abs() < 1e-12);
        assert_eq!(Slope::of(&[(0.0, 1.0), (1.0, 2.0)]), None);
        assert_eq!(Slope::of(&[(1.0, 1.0), (1.0, 2.0), (1.0, 3.0)]), None);
    }

    #[test]
    fn the_interval_of_a_hand_computed_case() {
        // mean 3, s.d. sqrt(2.5), t(4) = 2.776: half width 2.776·sqrt(2.5/5)
        let interval = Interval::of([1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        assert_eq!((interval.n, interval.mean), (5, 3.0));
        let half = 2.776 * 0.5_f64.sqrt();
        assert!((interval.high - 3.0 - half).abs() < 1e-12);
        assert!((3.0 - interval.low - half).abs() < 1e-12);
    }

    #[test]
    fn one_value_has_no_width_and_none_has_no_interval() {
        let one = Interval::of([2.0]).unwrap();
        assert_eq!((one.low, one.high), (2.0, 2.0));
        assert_eq!(Interval::of([]), None);
    }

    #[test]
    fn ratios_are_averaged_as_ratios() {
        let interval = Interval::of_ratios([0.5, 2.0]).unwrap();
        assert!((interval.mean - 1.0).abs() < 1e-12);
        assert!((interval.low * interval.high - 1.0).abs() < 1e-9);
    }

    #[test]
    fn students_t_runs_on_smoothly_beyond_the_table() {
        assert!(t_975(30) > t_975(31) && t_975(31) > t_975(39));
        assert!((t_975(39) - 2.022_691).abs() < 1e-4);
        assert!((t_975(1_000_000) - 1.95996).abs() < 1e-4);
    }

    /// Points of Student's t that every table has.
    #[test]
    fn the_share_beyond_t_is_that_of_the_tables() {
        for (freedom, t, share) in [
            (1, 12.706, 0.05),
            (2, 4.303, 0.05),
            (3, 3.182, 0.05),
            (4, 2.776, 0.05),
            (9, 2.262, 0.05),
            (10, 3.169, 0.01),
            (39, 2.023, 0.05),
            (39, 2.708, 0.01),
        ] {
            let found = t_beyond(t, freedom);
            assert!((found / share - 1.0).abs() < 2e-3, "{freedom} {t}: {found}");
            assert!((t_beyond(-t, freedom) - found).abs() < 1e-15);
        }
        assert_eq!(t_beyond(0.0, 7), 1.0);
    }

    /// Holm's own example of the order: the least p is multiplied most, and none falls below one before it.
    #[test]
    fn holm_multiplies_by_what_is_left_and_never_falls() {
        let corrected = holm(&[0.01, 0.04, 0.03, 0.005]);
        let expected = [0.03, 0.06, 0.06, 0.02];
        for (found, expected) in corrected.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{corrected:?}");
        }
        assert_eq!(holm(&[0.9, 0.8]), [1.0, 1.0]);
    }

    #[test]
    fn a_mean_two_errors_away_is_tested_as_its_interval_shows() {
        let interval = Interval::of([1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        // the end of a 95 % interval is where p is 5 %
        assert!((interval.p_against(interval.low).unwrap() - 0.05).abs() < 1e-4);
        assert_eq!(interval.p_against(3.0), Some(1.0));
        assert_eq!(Interval::of([2.0]).unwrap().p_against(0.0), None);
    }

    #[test]
    fn curves_are_compared_where_both_are() {
        let first = [(0.0, 1.0), (2.0, 3.0)];
        let second = [(1.0, 1.0), (3.0, 3.0)];
        // between 1 and 2 the first is one above the second
        assert!((log_ratio(&first, &second).unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(log_ratio(&first, &[(2.5, 0.0), (3.0, 0.0)]), None);
        assert_eq!(log_ratio(&first, &[]), None);
    }
}
