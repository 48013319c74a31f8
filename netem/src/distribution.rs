//! Distributions of delay beyond the normal one: quantiles of one uniform number each.
//!
//! Tables come as text; reading a file is for whoever has one.

use std::time::Duration;

use mmt_shared::stats::values::quantile;

use crate::quantile::standard_normal;
use crate::trace::{TraceError, meaningful_lines};

mod gamma;

pub(crate) use gamma::gamma;

/// The longest delay or jitter, 1 h: beyond any path on Earth, and far from overflow in nanoseconds.
pub const DELAY_MAX: Duration = Duration::from_secs(3600);
/// Where iproute2's tables end: 32767 / 8192.
const TABLE_END: f64 = 32_767.0 / TABLE_UNIT;
/// The table entry that stands for one J (the kernel's `NETEM_DIST_SCALE`).
const TABLE_UNIT: f64 = 8192.0;
/// The most entries the kernel takes (`NETEM_DIST_MAX`).
const TABLE_MAX: usize = 16_384;
/// The most points of a measured distribution.
const POINTS_MAX: usize = 1_000_000;

/// Pareto of exponent 3 in the scale of iproute2's `pareto.c`: mean 0, cut at the end of its table.
pub(crate) fn pareto(p: f64) -> f64 {
    let x = 4.0 / 3.0 * (1.0 / libm::cbrt(1.0 - p) - 1.5);
    x.min(TABLE_END)
}

/// A quarter normal, three quarters Pareto (iproute2's `paretonormal.c`).
pub(crate) fn pareto_normal(p: f64) -> f64 {
    let normal = standard_normal(p).clamp(-TABLE_END, TABLE_END);
    0.25 * normal + 0.75 * pareto(p)
}

/// Log-normal with this mean and standard deviation.
pub(crate) fn lognormal(mean: f64, sd: f64, p: f64) -> f64 {
    if mean <= 0.0 {
        return 0.0;
    }
    let ratio = sd / mean;
    let variance = libm::log1p(ratio * ratio);
    mean * libm::exp(variance.sqrt() * standard_normal(p) - 0.5 * variance)
}

/// A distribution table of iproute2 (`*.dist`): 16-bit numbers, 8192 for one J; `#` begins a comment.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What the settings call it.
    pub(crate) name: String,
    sorted: Vec<i16>,
}

impl Table {
    /// Reads a table; `name` is what the settings call it.
    ///
    /// # Errors
    /// The line of what is no 16-bit number; a table without any or with more than 16384.
    pub fn parse(name: &str, text: &str) -> Result<Self, TraceError> {
        let mut sorted = Vec::new();
        for (line, content) in meaningful_lines(text) {
            for word in content.split_whitespace() {
                let number = word.parse();
                sorted.push(number.map_err(|_| {
                    TraceError::at(line, "expected whole numbers from -32768 to 32767")
                })?);
            }
            if sorted.len() > TABLE_MAX {
                return Err(TraceError::at(line, "a table has 16384 numbers at most"));
            }
        }
        if sorted.is_empty() {
            return Err(TraceError::at(1, "the table holds no number"));
        }
        sorted.sort_unstable();
        Ok(Self {
            name: name.to_owned(),
            sorted,
        })
    }

    /// In J.
    pub(crate) fn quantile(&self, p: f64) -> f64 {
        f64::from(quantile(&self.sorted, p).unwrap_or_default()) / TABLE_UNIT
    }
}

/// A measured distribution of delay: points of the cumulative distribution, straight lines between.
#[derive(Clone, Debug, PartialEq)]
pub struct Cdf {
    /// The file it came from, as the settings call it; none: it stands among the words.
    pub(crate) name: Option<String>,
    /// Cumulative share and delay in nanoseconds, ascending in both.
    points: Vec<(f64, f64)>,
}

impl Cdf {
    /// From points (delay in nanoseconds, cumulative share 0 to 1).
    ///
    /// # Errors
    /// In words: fewer than two points, points out of order, shares that do not run from 0 to 1.
    pub fn try_new(name: Option<String>, points: &[(u64, f64)]) -> Result<Self, &'static str> {
        let (Some(first), Some(last)) = (points.first(), points.last()) else {
            return Err("a distribution needs points");
        };
        if first.1 != 0.0 || last.1 != 1.0 {
            return Err("the shares of a distribution run from 0% to 100%");
        }
        let pairs = || points.iter().zip(points.iter().skip(1));
        if !pairs().all(|(a, b)| a.0 <= b.0 && a.1 <= b.1) {
            return Err("delays and shares of a distribution must not fall");
        }
        if points.len() > POINTS_MAX || last.0 > DELAY_MAX.as_nanos() as u64 {
            return Err("a distribution has a million points and delays of 1 h at most");
        }
        let points = points.iter().map(|(delay, p)| (*p, *delay as f64));
        Ok(Self {
            name,
            points: points.collect(),
        })
    }

    /// Reads a file: a line for each point with delay in ms and cumulative share from 0 to 1, or a line
    /// for each measured delay in ms. Separators are blanks, commas or semicolons.
    ///
    /// # Errors
    /// Line and reason.
    pub fn parse(name: &str, text: &str) -> Result<Self, TraceError> {
        let mut rows = Vec::new();
        for (line, content) in meaningful_lines(text) {
            let numbers = content.split([',', ';', ' ', '\t']).map(str::trim);
            let numbers: Result<Vec<f64>, _> = numbers
                .filter(|word| !word.is_empty())
                .map(str::parse)
                .collect();
            let expected = "expected a delay in ms, and perhaps a cumulative share from 0 to 1";
            let row = match numbers.as_deref() {
                Ok([delay]) => (*delay, None),
                Ok([delay, share]) => (*delay, Some(*share)),
                _ => return Err(TraceError::at(line, expected)),
            };
            if !(0.0..=3.6e6).contains(&row.0) {
                return Err(TraceError::at(line, "a delay lies between 0 and 1 h"));
            }
            rows.push((line, row));
        }
        let shares = rows.iter().filter(|(_, (_, share))| share.is_some());
        let points = match shares.count() {
            0 => steps_of(rows.iter().map(|(_, (delay, _))| *delay).collect()),
            n if n == rows.len() => rows
                .iter()
                .map(|(_, (delay, share))| ((*delay * 1e6) as u64, share.unwrap_or(0.0)))
                .collect(),
            _ => return Err(TraceError::at(1, "either every line has a share or none")),
        };
        let last = rows.last().map_or(1, |(line, _)| *line);
        Self::try_new(Some(name.to_owned()), &points).map_err(|why| TraceError::at(last, why))
    }

    /// The points: delay in nanoseconds and cumulative share.
    pub fn points(&self) -> impl Iterator<Item = (u64, f64)> + '_ {
        self.points.iter().map(|(p, delay)| (*delay as u64, *p))
    }

    pub(crate) fn quantile_nanos(&self, p: f64) -> f64 {
        let above = self.points.partition_point(|(share, _)| *share <= p);
        let low = self.points.get(above.saturating_sub(1));
        let (Some((p0, x0)), Some((p1, x1))) = (low, self.points.get(above)) else {
            return self.points.last().map_or(0.0, |(_, delay)| *delay);
        };
        x0 + (x1 - x0) * (p - p0) / (p1 - p0)
    }
}

/// Points of the cumulative distribution of measured delays in ms.
fn steps_of(mut delays_ms: Vec<f64>) -> Vec<(u64, f64)> {
    delays_ms.sort_unstable_by(f64::total_cmp);
    let last = delays_ms.len().saturating_sub(1).max(1) as f64;
    let point = |(i, delay): (usize, &f64)| ((*delay * 1e6) as u64, i as f64 / last);
    delays_ms.iter().enumerate().map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(quantile: impl Fn(f64) -> f64) -> f64 {
        let n = 200_000;
        let middle = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
        (0..n).map(|i| quantile(middle(i))).sum::<f64>() / f64::from(n)
    }

    #[test]
    fn the_pareto_is_iproute2s_to_the_entry() {
        // entries 0, 1024, 2048 and 3072 of `pareto.dist` by its generator: i = 65536 - 16 n
        let entry = |p: f64| (pareto(p) * 8192.0).round();
        assert_eq!(
            [entry(0.0), entry(0.25), entry(0.5), entry(0.75)],
            [-5461.0, -4362.0, -2622.0, 955.0]
        );
        assert_eq!(entry(1.0), 32_767.0);
        // the cut at 4 J takes the tail away, and with it a little of the mean, which was zero
        let tail = |x: f64| 1.0 - 1.0 / (0.75 * x + 1.5_f64).powi(3);
        assert!(pareto(tail(4.1)) < 4.0 && pareto(tail(3.9)) < 3.91);
        let shortfall = mean(pareto);
        assert!((-0.1..0.0).contains(&shortfall), "{shortfall}");
    }

    #[test]
    fn the_lognormal_has_its_mean_and_standard_deviation() {
        let of = |p| lognormal(50.0, 20.0, p);
        let m = mean(of);
        assert!((m - 50.0).abs() < 0.01, "{m}");
        let variance = mean(|p| (of(p) - m) * (of(p) - m));
        assert!((variance.sqrt() - 20.0).abs() < 0.05, "{variance}");
        assert_eq!(lognormal(0.0, 5.0, 0.9), 0.0);
    }

    #[test]
    fn a_table_is_read_with_comments_and_refused_with_its_line() {
        let table = Table::parse("t", "# a comment\n -8192 0\n 8192 16384\n").unwrap();
        let quantiles = [0.0, 0.3, 0.6, 0.99].map(|p| table.quantile(p));
        assert_eq!(quantiles, [-1.0, 0.0, 1.0, 2.0]);
        for (text, line) in [("1\n2 x\n", 2), ("# none\n", 1), ("40000", 1)] {
            assert_eq!(Table::parse("t", text).unwrap_err().line, line, "{text}");
        }
    }

    #[test]
    fn a_measured_distribution_is_met_at_its_points_and_straight_between() {
        let cdf = Cdf::parse("f", "40 0\n50, 0.5\n# tail\n100; 1\n").unwrap();
        let ms = [0.0, 0.25, 0.5, 0.75, 1.0].map(|p| cdf.quantile_nanos(p) / 1e6);
        assert_eq!(ms, [40.0, 45.0, 50.0, 75.0, 100.0]);
        let samples = Cdf::parse("f", "30\n10\n20\n").unwrap();
        assert_eq!(samples.quantile_nanos(0.5), 20e6);
        for (text, line) in [
            ("40 0\nx 1", 2),
            ("40 0\n30 1", 2),
            ("40 0\n50 0.9", 2),
            ("40 0 7", 1),
            ("40 0\n50", 1),
            ("-1", 1),
            ("", 1),
        ] {
            assert_eq!(Cdf::parse("f", text).unwrap_err().line, line, "{text}");
        }
    }
}
