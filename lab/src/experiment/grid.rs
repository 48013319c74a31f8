//! Cases with the runs of their seeds, and the columns that summarise them.

use mmt_shared::stats::values::median;

use crate::digest::of_runs;
use crate::statistics::Interval;
use crate::table::{Cell, Column};
use crate::trial::Measured;

/// A case of a grid with what was measured of it, seed by seed from the first.
#[derive(Clone, Debug, PartialEq)]
pub struct Group<C, R> {
    /// What the runs have in common.
    pub case: C,
    /// What the run of each seed came to.
    pub runs: Vec<R>,
}

/// One run of a group.
#[derive(Debug)]
pub struct Run<'a, C, R> {
    /// What it was a run of.
    pub case: &'a C,
    /// Its seed.
    pub seed: u64,
    /// What it came to.
    pub measured: &'a R,
}

impl<C, R> Group<C, R> {
    /// A number of each run that has one.
    pub fn values(&self, of: impl Fn(&R) -> Option<f64>) -> impl Iterator<Item = f64> {
        self.runs.iter().filter_map(of)
    }

    /// Mean and 95 % interval over the runs that have the number.
    pub fn interval(&self, of: impl Fn(&R) -> Option<f64>) -> Option<Interval> {
        Interval::of(self.values(of))
    }

    /// Mean over the runs that have the number.
    pub fn mean(&self, of: impl Fn(&R) -> Option<f64>) -> Option<f64> {
        self.interval(of).map(|interval| interval.mean)
    }

    /// Median over the runs that have the number.
    pub fn median(&self, of: impl Fn(&R) -> Option<f64>) -> Option<f64> {
        median(self.values(of))
    }

    /// The largest number of any run.
    pub fn largest(&self, of: impl Fn(&R) -> Option<f64>) -> Option<f64> {
        self.values(of).reduce(f64::max)
    }

    /// Geometric mean and interval of a number of this group over that of another, seed by seed.
    pub fn ratio(&self, base: &Self, of: impl Fn(&R) -> Option<f64>) -> Option<Interval> {
        let seeds = self.runs.iter().zip(&base.runs);
        Interval::of_ratios(seeds.filter_map(|(run, base)| Some(of(run)? / of(base)?)))
    }
}

/// Every run of some groups, of which the first seed is given.
pub fn runs<C, R>(groups: &[Group<C, R>], first_seed: u64) -> Vec<Run<'_, C, R>> {
    let mut runs = Vec::new();
    for group in groups {
        runs.extend(
            group
                .runs
                .iter()
                .zip(first_seed..)
                .map(|(measured, seed)| Run {
                    case: &group.case,
                    seed,
                    measured,
                }),
        );
    }
    runs
}

/// SHA-256 over the digests of all runs, in hexadecimal digits.
#[must_use]
pub fn digest<C>(groups: &[Group<C, Measured>]) -> String {
    let runs = groups.iter().flat_map(|group| &group.runs);
    of_runs(runs.map(|run| run.digest.as_str()))
}

/// A column of means over the seeds.
pub fn mean<'a, C: 'a, R: 'a>(
    key: &'static str,
    unit: &'static str,
    decimals: usize,
    of: fn(&R) -> Option<f64>,
) -> Column<'a, Group<C, R>> {
    Column::new(key, unit, decimals, move |group: &Group<C, R>| {
        group.mean(of).into()
    })
}

/// Columns of a mean and the ends of its interval.
pub fn interval<'a, Row: 'a>(
    keys: [&'static str; 3],
    unit: &'static str,
    decimals: usize,
    of: fn(&Row) -> Option<Interval>,
) -> [Column<'a, Row>; 3] {
    let ends: [fn(Interval) -> f64; 3] = [|i| i.mean, |i| i.low, |i| i.high];
    let mut ends = ends.into_iter();
    keys.map(|key| {
        let end = ends.next().unwrap_or(|i| i.mean);
        Column::new(key, unit, decimals, move |row: &Row| {
            Cell::from(of(row).map(end))
        })
    })
}
