//! The runs of the paper's schemes by scheme, deadband and seed, and which of two schemes has the lower PMSE at the
//! same packet rate.
//!
//! Each scheme's runs give a curve of PMSE over rate: means over the seeds at the seven deadbands, joined on
//! logarithmic axes. The ratio is averaged over the rates that both curves reach. Rate and PMSE of a run depend on
//! one another, so the interval comes from leaving out one seed at a time (jackknife).

use mmt_shared::stats::values::mean;
use nalgebra::{RowVector3, SMatrix, SVector};

use crate::experiment::grid::Group;
use crate::setting::{Curve, DEADBANDS, Point, knee};
use crate::statistics::{Interval, log_ratio};
use crate::trial::Measured;

/// A curve: (ln rate, ln PMSE), by rising rate.
type LogCurve = Vec<(f64, f64)>;

/// All runs, in paper mode.
pub(in crate::experiments) struct Runs<'a> {
    pub(in crate::experiments) groups: &'a [Group<Point, Measured>],
    pub(in crate::experiments) seeds: u64,
}

impl Runs<'_> {
    /// The run of a scheme at a deadband with a seed.
    fn run(&self, curve: Curve, deadband: f64, seed: u64) -> Option<&Measured> {
        let wanted = |point: &Point| point.curve == curve && point.deadband == deadband;
        let group = self.groups.iter().find(|group| wanted(&group.case))?;
        group.runs.get(usize::try_from(seed.checked_sub(1)?).ok()?)
    }

    /// A number of each seed's runs, where all of them have one.
    fn per_seed(&self, of: impl Fn(u64) -> Option<f64>) -> Vec<f64> {
        (1..=self.seeds).filter_map(of).collect()
    }

    fn pmse(&self, curve: Curve, deadband: f64, seed: u64) -> Option<f64> {
        self.run(curve, deadband, seed)?.force.pmse
    }

    pub(super) fn rates(&self, curve: Curve, deadband: f64) -> Vec<f64> {
        self.per_seed(|seed| self.run(curve, deadband, seed)?.updates.rate_hz())
    }

    /// The least rate of any run; a bound is a bound on each, so it has no interval.
    pub(super) fn least_rate(&self, curve: Curve) -> Option<Interval> {
        let rates = DEADBANDS.iter();
        let rates = rates.flat_map(|deadband| self.rates(curve, *deadband));
        Interval::of([rates.reduce(f64::min)?])
    }

    /// How much steeper PMSE falls from 30 to 10 % than from 10 to 2.5 %.
    pub(super) fn knee(&self, curve: Curve) -> Option<Interval> {
        let knees = self.per_seed(|seed| {
            let pmse = |deadband| self.pmse(curve, deadband, seed);
            Some(knee(pmse(0.025)?, pmse(0.10)?, pmse(0.30)?))
        });
        Interval::of(knees)
    }

    /// Exponent of PMSE over Delta between two deadbands.
    pub(super) fn slope(&self, curve: Curve, [fine, coarse]: [f64; 2]) -> Option<Interval> {
        let slopes = self.per_seed(|seed| {
            let pmse = |deadband| self.pmse(curve, deadband, seed);
            Some(libm::log(pmse(coarse)? / pmse(fine)?) / libm::log(coarse / fine))
        });
        Interval::of(slopes)
    }

    /// The deadband at which the slope of PMSE over Delta changes: of the two lines through all seven deadbands that meet at
    /// one of them and fit best, on logarithmic axes.
    pub(super) fn place_of_knee(&self, curve: Curve) -> Option<Interval> {
        let place = |seed| {
            let pmse = |deadband: &f64| self.pmse(curve, *deadband, seed).map(libm::log);
            let logs: Option<Vec<f64>> = DEADBANDS.iter().map(pmse).collect();
            let logs = logs?;
            let inner = DEADBANDS.iter().skip(1).take(DEADBANDS.len() - 2);
            let misfits = inner.map(|knee| Some((*knee, misfit(&logs, *knee)?)));
            let misfits: Option<Vec<(f64, f64)>> = misfits.collect();
            let best = misfits?.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
            best.map(|(knee, _)| knee)
        };
        Interval::of_ratios(self.per_seed(place))
    }

    /// Geometric mean of PMSE of one scheme over that of another at equal deadbands.
    pub(super) fn ratio_at_equal_deadband(&self, better: Curve, worse: Curve) -> Option<Interval> {
        let ratios = self.per_seed(|seed| {
            let pmse = |curve, deadband: &f64| self.pmse(curve, *deadband, seed);
            let log = |deadband| Some(libm::log(pmse(better, deadband)? / pmse(worse, deadband)?));
            let logs: Option<Vec<f64>> = DEADBANDS.iter().map(log).collect();
            mean(logs?).map(libm::exp)
        });
        Interval::of_ratios(ratios)
    }

    /// Packets per second of contact at 15 %: of the first second over those of the rest.
    pub(super) fn opening(&self, curve: Curve) -> Option<Interval> {
        let ratios = self.per_seed(|seed| {
            let run = self.run(curve, 0.15, seed)?;
            let later = run.later_rate_hz.filter(|rate| *rate > 0.0)?;
            Some(run.opening_rate_hz.filter(|rate| *rate > 0.0)? / later)
        });
        Interval::of_ratios(ratios)
    }

    /// Geometric mean of PMSE of one scheme over that of another at equal rates; none if no rate is reached by both.
    pub(super) fn ratio_at_equal_rate(&self, better: Curve, worse: Curve) -> Option<Interval> {
        let without = |left_out: Option<u64>| {
            let seeds = (1..=self.seeds).filter(|seed| Some(*seed) != left_out);
            let seeds: Vec<u64> = seeds.collect();
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
        let point = |deadband: &f64| {
            let run = |seed: &u64| self.run(curve, *deadband, *seed);
            let runs = || seeds.iter().filter_map(run);
            let rate = mean(runs().filter_map(|run| run.updates.rate_hz()))?;
            let pmse = mean(runs().filter_map(|run| run.force.pmse))?;
            Some((libm::log(rate), libm::log(pmse)))
        };
        let mut points: LogCurve = DEADBANDS.iter().filter_map(point).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    }
}

/// Sum of squares that two lines leave which meet at a deadband, of ln PMSE at each deadband.
fn misfit(logs: &[f64], knee: f64) -> Option<f64> {
    let rows = DEADBANDS.map(|deadband| {
        let x = libm::log(deadband / knee);
        RowVector3::new(1.0, x, x.max(0.0))
    });
    let design = SMatrix::<f64, { DEADBANDS.len() }, 3>::from_rows(&rows);
    let values = SVector::<f64, { DEADBANDS.len() }>::from_iterator(logs.iter().copied());
    let inverse = (design.transpose() * design).try_inverse()?;
    let lines = inverse * (design.transpose() * values);
    Some((values - design * lines).norm_squared())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_lines_are_found_to_meet_where_they_do() {
        for knee in [0.05, 0.10, 0.20] {
            let log = |deadband: f64| {
                0.1 * libm::log(deadband) + 2.0 * libm::log(deadband / knee).max(0.0)
            };
            let logs = DEADBANDS.map(log);
            let misfits = DEADBANDS.map(|place| misfit(&logs, place));
            let at = DEADBANDS.iter().position(|deadband| *deadband == knee);
            assert!(misfits[at.unwrap()].unwrap() < 1e-20, "{misfits:?}");
            let exact = misfits.iter().flatten().filter(|misfit| **misfit < 1e-20);
            assert_eq!(exact.count(), 1, "{misfits:?}");
        }
    }
}
