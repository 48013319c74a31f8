//! A histogram of durations with a bounded relative error, of fixed size, and its quantiles.
//!
//! Below 512 ns each nanosecond has a bucket; above, each octave up to 2^36 ns (69 s) has 512 equal
//! buckets, so that a bucket is at most 1/512 = 0.2 % of its values wide. A quantile is reported as the
//! middle of its bucket: at most 0.1 % off.

use std::time::Duration;

use crate::time::duration_nanos;

/// Buckets per octave: 2^9.
const BITS: u32 = 9;
const PER_OCTAVE: u64 = 1 << BITS;
/// Octaves above the linear part.
const OCTAVES: u64 = 27;
const BUCKETS: usize = (PER_OCTAVE * (OCTAVES + 1)) as usize;

/// How often each duration occurred. 69 s and longer share the last bucket.
#[derive(Clone, Debug)]
pub struct Histogram {
    /// On the heap: 115 kB are too much for the stack of a thread that moves what holds them.
    counts: Box<[u32]>,
    total: u64,
    max: Duration,
}

/// How durations are spread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Quantiles {
    /// Durations counted; with none, all the others are zero.
    pub count: u64,
    /// Half were not longer.
    pub p50: Duration,
    /// 99 of 100 were not longer.
    pub p99: Duration,
    /// 999 of 1000 were not longer.
    pub p999: Duration,
    /// The longest, exactly.
    pub max: Duration,
}

impl Default for Histogram {
    /// Nothing counted. Allocates, and nothing does afterwards but a clone.
    fn default() -> Self {
        Self {
            counts: vec![0; BUCKETS].into(),
            total: 0,
            max: Duration::ZERO,
        }
    }
}

impl Histogram {
    /// Counts one duration.
    pub fn record(&mut self, duration: Duration) {
        if let Some(count) = self.counts.get_mut(bucket(duration_nanos(duration))) {
            *count = count.saturating_add(1);
        }
        self.total = self.total.saturating_add(1);
        self.max = self.max.max(duration);
    }

    /// How many have been counted.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// The least duration (within 0.1 %) that a share `q` (0 to 1) of all does not exceed; none if
    /// nothing has been counted or `q` is no number.
    pub fn quantile(&self, q: f64) -> Option<Duration> {
        if self.total == 0 || q.is_nan() {
            return None;
        }
        let rank = (q.clamp(0.0, 1.0) * self.total as f64).ceil() as u64;
        let rank = rank.clamp(1, self.total);
        let mut up_to = 0_u64;
        for (index, &count) in self.counts.iter().enumerate() {
            up_to = up_to.saturating_add(u64::from(count));
            if up_to >= rank {
                return Some(Duration::from_nanos(middle(index as u64)));
            }
        }
        None
    }

    /// The quantiles so far. Takes some microseconds.
    pub fn quantiles(&self) -> Quantiles {
        // the middle of a bucket may lie above all that is in it
        let at = |q| self.quantile(q).unwrap_or_default().min(self.max);
        Quantiles {
            count: self.total,
            p50: at(0.5),
            p99: at(0.99),
            p999: at(0.999),
            max: self.max,
        }
    }
}

/// The bucket of a duration in ns.
fn bucket(nanos: u64) -> usize {
    let octave = nanos.checked_ilog2().unwrap_or(0).saturating_sub(BITS);
    let index = u64::from(octave) * PER_OCTAVE + (nanos >> octave);
    usize::try_from(index).map_or(BUCKETS - 1, |index| index.min(BUCKETS - 1))
}

/// The middle of a bucket, ns.
fn middle(index: u64) -> u64 {
    let octave = (index / PER_OCTAVE).saturating_sub(1);
    let low = (index - octave * PER_OCTAVE) << octave;
    low + (1 << octave) / 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn buckets_are_in_order_without_gaps_and_all_used() {
        for index in 0..BUCKETS {
            assert_eq!(bucket(middle(index as u64)), index);
        }
        let mut last = 0;
        for nanos in 0..1_000_000 {
            let index = bucket(nanos);
            assert!(index == last || index == last + 1, "{nanos}");
            last = index;
        }
        assert_eq!(bucket((1 << 36) - 1), BUCKETS - 1);
        assert_eq!(bucket(u64::MAX), BUCKETS - 1);
    }

    #[test]
    fn quantiles_are_nearest_ranks_and_absent_without_values() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.quantile(0.5), None);
        for ms in 1..=100 {
            histogram.record(Duration::from_millis(ms));
        }
        for (q, ms) in [(0.0, 1.0), (0.5, 50.0), (0.99, 99.0), (1.0, 100.0)] {
            let found = histogram.quantile(q).unwrap().as_secs_f64() * 1e3;
            assert!((found / ms - 1.0).abs() < 0.001, "{q}: {found} for {ms}");
        }
        assert_eq!(histogram.quantile(f64::NAN), None);
        assert_eq!(histogram.total(), 100);
        let all = histogram.quantiles();
        assert_eq!((all.count, all.max), (100, Duration::from_millis(100)));
        assert!(all.p50 < all.p99 && all.p999 <= all.max);
    }

    #[test]
    fn an_empty_histogram_has_no_count_and_extremes_are_counted() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.quantiles(), Quantiles::default());
        histogram.record(Duration::ZERO);
        histogram.record(Duration::MAX);
        assert_eq!(histogram.quantiles().count, 2);
        assert_eq!(histogram.quantiles().max, Duration::MAX);
    }

    proptest! {
        #[test]
        fn one_value_is_reported_within_0_1_percent(nanos in 1_u64..(1 << 36)) {
            let mut histogram = Histogram::default();
            histogram.record(Duration::from_nanos(nanos));
            let found = histogram.quantile(0.5).unwrap().as_nanos() as f64;
            prop_assert!((found / nanos as f64 - 1.0).abs() <= 0.5 / 512.0);
        }
    }
}
