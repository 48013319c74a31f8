//! How late the drivers release packets: the part of the delay that is not the link's but the host's.

use std::sync::Mutex;

use hdrhistogram::Histogram;
use mmt_shared::report::{EmulationReport, LateReport};
use mmt_shared::time::{Time, duration_nanos};
use serde::Serialize;

use super::lock;
pub use crate::record::summary::{MAX_DEGRADED_US, P99_DEGRADED_US};

/// The longest lateness told apart from a longer one, 10 s.
const MAX_NANOS: u64 = 10_000_000_000;

/// Release lateness in microseconds: from the theoretical departure to the moment of sending.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Lateness {
    /// Packets released.
    pub count: u64,
    /// Median, us.
    pub p50_us: f64,
    /// 99th percentile, us.
    pub p99_us: f64,
    /// 99.9th percentile, us.
    pub p999_us: f64,
    /// Maximum, us.
    pub max_us: f64,
}

impl Lateness {
    /// Whether the host was too slow for the results to be about the link: p99 above
    /// [`P99_DEGRADED_US`] or anything above [`MAX_DEGRADED_US`].
    #[must_use]
    pub fn degraded(&self) -> bool {
        self.p99_us > P99_DEGRADED_US || self.max_us > MAX_DEGRADED_US
    }

    /// What the report of a run says of it; nothing if no packet was released.
    #[must_use]
    pub fn report(&self) -> EmulationReport {
        if self.count == 0 {
            return EmulationReport::default();
        }
        EmulationReport {
            released: Some(self.count),
            late_us: LateReport {
                p50: self.p50_us.into(),
                p99: self.p99_us.into(),
                max: self.max_us.into(),
            },
            degraded: Some(self.degraded()),
        }
    }
}

/// The histogram behind it: 1 % wide bins from 1 ns up.
#[derive(Debug)]
pub(crate) struct Recorder(Mutex<Histogram<u64>>);

impl Recorder {
    pub(crate) fn try_new() -> Result<Self, hdrhistogram::CreationError> {
        let histogram = Histogram::new_with_bounds(1, MAX_NANOS, 2)?;
        Ok(Self(Mutex::new(histogram)))
    }

    /// Records that a packet due at `due` left at `now`.
    pub(crate) fn record(&self, due: Time, now: Time) {
        let late = duration_nanos(now.saturating_since(due));
        lock(&self.0).saturating_record(late);
    }

    pub(crate) fn summary(&self) -> Lateness {
        // Copied first, so that the releasing thread waits for a copy and not for the quantiles.
        let histogram = lock(&self.0).clone();
        if histogram.is_empty() {
            return Lateness::default();
        }
        let us = |quantile| histogram.value_at_quantile(quantile) as f64 * 1e-3;
        Lateness {
            count: histogram.len(),
            p50_us: us(0.5),
            p99_us: us(0.99),
            p999_us: us(0.999),
            max_us: histogram.max() as f64 * 1e-3,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn quantiles_are_those_of_what_was_recorded_and_early_counts_as_on_time() {
        let recorder = Recorder::try_new().unwrap();
        assert_eq!(recorder.summary(), Lateness::default());
        for us in 1..=1000 {
            recorder.record(Time::ZERO, Time::ZERO + Duration::from_micros(us));
        }
        recorder.record(Time::MAX, Time::ZERO);
        let summary = recorder.summary();
        assert_eq!(summary.count, 1001);
        assert!((summary.p50_us / 500.0 - 1.0).abs() < 0.02, "{summary:?}");
        assert!((summary.max_us / 1000.0 - 1.0).abs() < 0.02, "{summary:?}");
        assert!(summary.degraded());
        let report = summary.report();
        assert_eq!((report.released, report.degraded), (Some(1001), Some(true)));
        assert_eq!(Lateness::default().report(), EmulationReport::default());
    }
}
