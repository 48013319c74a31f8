//! How a duration is spread: a histogram of fixed size that is filled without allocating.

use std::time::Duration;

use hdrhistogram::{CreationError, Histogram};

use crate::time::duration_nanos;

/// The longest duration told apart from longer ones, 100 s.
const LONGEST_NS: u64 = 100_000_000_000;
/// Significant decimal digits kept: quantiles are right to 1 %, in about 30 kB.
const DIGITS: u8 = 2;

/// Durations from 1 ns to 100 s; longer ones count as the longest.
#[derive(Clone, Debug)]
pub struct Spread(Histogram<u64>);

/// What a report says about a [`Spread`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Quantiles {
    /// Durations recorded; with none, all the others are zero.
    pub count: u64,
    /// Half were not longer.
    pub p50: Duration,
    /// 99 of 100 were not longer.
    pub p99: Duration,
    /// 999 of 1000 were not longer.
    pub p999: Duration,
    /// The longest.
    pub max: Duration,
}

impl Spread {
    /// An empty spread, with all the memory that it will ever use.
    ///
    /// # Errors
    /// The library's word that the bounds make no histogram; they are constants, and a test holds them.
    pub fn new() -> Result<Self, CreationError> {
        Histogram::new_with_bounds(1, LONGEST_NS, DIGITS).map(Self)
    }

    /// Counts one duration. Neither allocates nor fails.
    pub fn record(&mut self, duration: Duration) {
        self.0.saturating_record(duration_nanos(duration));
    }

    /// The quantiles so far. Does not allocate; takes some microseconds.
    #[must_use]
    pub fn quantiles(&self) -> Quantiles {
        let at = |quantile| Duration::from_nanos(self.0.value_at_quantile(quantile));
        Quantiles {
            count: self.0.len(),
            p50: at(0.5),
            p99: at(0.99),
            p999: at(0.999),
            max: Duration::from_nanos(self.0.max()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_right_to_one_per_cent() {
        let mut spread = Spread::new().unwrap();
        for micros in 1..=10_000 {
            spread.record(Duration::from_micros(micros));
        }
        let got = spread.quantiles();
        assert_eq!(got.count, 10_000);
        for (value, micros) in [(got.p50, 5000.0), (got.p99, 9900.0), (got.p999, 9990.0)] {
            let error = value.as_secs_f64() / (micros * 1e-6) - 1.0;
            assert!(error.abs() < 0.01, "{value:?} for {micros} us");
        }
        assert!(got.max >= Duration::from_millis(10));
    }

    #[test]
    fn an_empty_spread_says_so() {
        assert_eq!(Spread::new().unwrap().quantiles(), Quantiles::default());
    }

    #[test]
    fn extremes_are_counted_and_not_refused() {
        let mut spread = Spread::new().unwrap();
        spread.record(Duration::ZERO);
        spread.record(Duration::MAX);
        assert_eq!(spread.quantiles().count, 2);
        assert!(spread.quantiles().max >= Duration::from_nanos(LONGEST_NS));
    }
}
