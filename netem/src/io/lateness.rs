//! How late the drivers release packets: the part of the delay that is not the link's but the host's.

use std::sync::Mutex;
use std::time::Duration;

use mmt_shared::report::{EmulationReport, LateReport};
use mmt_shared::stats::histogram::{Histogram, Quantiles};
use mmt_shared::time::Time;
use serde::Serialize;

use super::lock;
pub use crate::record::summary::P999_DEGRADED_US;

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
    /// Whether the host was too slow for the results to be about the link: p99.9 above
    /// [`P999_DEGRADED_US`]. One late packet of 40 000 is not a verdict.
    #[must_use]
    pub fn degraded(&self) -> bool {
        self.p999_us > P999_DEGRADED_US
    }

    /// The form that the report of a run has; empty if no packet was released.
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

/// The histogram behind it.
#[derive(Debug, Default)]
pub(crate) struct Recorder(Mutex<Histogram>);

impl Recorder {
    /// Records that a packet due at `due` left at `now`.
    pub(crate) fn record(&self, due: Time, now: Time) {
        lock(&self.0).record(now.saturating_since(due));
    }

    /// What was recorded since the last call.
    pub(crate) fn take(&self) -> Quantiles {
        std::mem::take(&mut *lock(&self.0)).quantiles()
    }

    pub(crate) fn summary(&self) -> Lateness {
        // Copied first, so that the releasing thread waits for a copy and not for the quantiles.
        let histogram = lock(&self.0).clone();
        let late = histogram.quantiles();
        let us = |duration: Duration| duration.as_secs_f64() * 1e6;
        Lateness {
            count: late.count,
            p50_us: us(late.p50),
            p99_us: us(late.p99),
            p999_us: us(late.p999),
            max_us: us(late.max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_what_was_recorded_and_early_counts_as_on_time() {
        let recorder = Recorder::default();
        assert_eq!(recorder.summary(), Lateness::default());
        for us in 1..=1000 {
            recorder.record(Time::ZERO, Time::ZERO + Duration::from_micros(us));
        }
        recorder.record(Time::MAX, Time::ZERO);
        let summary = recorder.summary();
        assert_eq!(summary.count, 1001);
        assert!((summary.p50_us / 500.0 - 1.0).abs() < 0.002, "{summary:?}");
        assert!((summary.max_us / 1000.0 - 1.0).abs() < 0.002, "{summary:?}");
        let report = summary.report();
        assert_eq!(report.released, Some(1001));
        assert_eq!(report.degraded, Some(false));
        assert_eq!(Lateness::default().report(), EmulationReport::default());
    }

    #[test]
    fn a_run_is_degraded_once_more_than_one_packet_of_a_thousand_is_late() {
        let recorder = Recorder::default();
        let late = || recorder.record(Time::ZERO, Time::from_millis(30));
        (0..9_990).for_each(|_| recorder.record(Time::ZERO, Time::ZERO));
        (0..10).for_each(|_| late());
        assert!(!recorder.summary().degraded());
        (0..2).for_each(|_| late());
        assert!(recorder.summary().degraded());
    }
}
