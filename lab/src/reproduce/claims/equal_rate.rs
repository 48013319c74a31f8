//! Which of two schemes has the lower PMSE at the same packet rate.
//!
//! Each scheme's runs give a curve of PMSE over rate: means over the seeds at the seven deadbands, joined on
//! logarithmic axes. The ratio is averaged over the rates that both curves reach. Rate and PMSE of a run depend on
//! one another, so the interval comes from leaving out one seed at a time (jackknife).

use super::{DEADBANDS, Interval, Runs};
use crate::reproduce::Curve;

/// Rates at which the curves are compared, evenly spaced in ln rate.
const PLACES: usize = 64;

/// A curve: (ln rate, ln PMSE), by rising rate.
type LogCurve = Vec<(f64, f64)>;

impl Runs<'_> {
    /// Geometric mean of PMSE of one scheme over that of another at equal rates; none if no rate is reached by both.
    pub(super) fn ratio_at_equal_rate(&self, better: Curve, worse: Curve) -> Option<Interval> {
        let without = |left_out: Option<u64>| {
            let seeds: Vec<u64> = (1..=self.seeds)
                .filter(|seed| Some(*seed) != left_out)
                .collect();
            log_ratio(
                &self.log_curve(better, &seeds),
                &self.log_curve(worse, &seeds),
            )
        };
        let all = without(None)?;
        if self.seeds < 2 {
            return Interval::of_ratios([libm::exp(all)]);
        }
        let left_out: Option<Vec<f64>> = (1..=self.seeds).map(|seed| without(Some(seed))).collect();
        // pseudo-values: their mean and its deviation are the jackknife's
        let n = self.seeds as f64;
        let pseudo = left_out?.into_iter().map(|part| n * all - (n - 1.0) * part);
        let interval = Interval::of(pseudo)?;
        let half = interval.high - interval.mean;
        Some(Interval {
            n: interval.n,
            mean: libm::exp(all),
            low: libm::exp(all - half),
            high: libm::exp(all + half),
        })
    }

    fn log_curve(&self, curve: Curve, seeds: &[u64]) -> LogCurve {
        let knot = |deadband: &f64| {
            let runs = || {
                seeds
                    .iter()
                    .filter_map(|seed| self.run(curve, *deadband, *seed))
            };
            let rate = Interval::of(runs().filter_map(|run| run.updates.rate_hz()))?.mean;
            let pmse = Interval::of(runs().filter_map(|run| run.force.pmse))?.mean;
            Some((libm::log(rate), libm::log(pmse)))
        };
        let mut knots: LogCurve = DEADBANDS.iter().filter_map(knot).collect();
        knots.sort_by(|a, b| a.0.total_cmp(&b.0));
        knots
    }
}

/// Mean of the difference of two curves over the abscissae that both cover.
pub(in crate::reproduce) fn log_ratio(first: &[(f64, f64)], second: &[(f64, f64)]) -> Option<f64> {
    let low = first.first()?.0.max(second.first()?.0);
    let high = first.last()?.0.min(second.last()?.0);
    if low >= high {
        return None;
    }
    let places = (0..PLACES).map(|k| low + (high - low) * (k as f64 + 0.5) / PLACES as f64);
    let differences: Option<Vec<f64>> = places
        .map(|x| Some(at(first, x)? - at(second, x)?))
        .collect();
    let differences = differences?;
    Some(differences.iter().sum::<f64>() / differences.len() as f64)
}

/// A curve at an abscissa, joined by straight lines.
fn at(curve: &[(f64, f64)], x: f64) -> Option<f64> {
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
    fn curves_are_compared_where_both_are() {
        let first = [(0.0, 1.0), (2.0, 3.0)];
        let second = [(1.0, 1.0), (3.0, 3.0)];
        // between 1 and 2 the first is one above the second
        assert!((log_ratio(&first, &second).unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(log_ratio(&first, &[(2.5, 0.0), (3.0, 0.0)]), None);
        assert_eq!(log_ratio(&first, &[]), None);
    }
}
