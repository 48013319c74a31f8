//! Time as an argument: a point on one host's monotonic clock, in nanoseconds.
//!
//! Nothing here reads a clock. In the live system the shells read one and pass it in; in the lab the
//! world counts. Two hosts' `Time`s have different epochs and must never be compared with each other.

use std::ops::{Add, AddAssign, Sub};
use std::time::Duration;

use serde::{Deserialize, Serialize};

/// The sample period T of both 1 kHz loops.
pub const TICK: Duration = Duration::from_millis(1);
/// The sample period T of both 1 kHz loops, in seconds.
pub const TICK_S: f64 = 1e-3;

/// A point on one host's monotonic clock: nanoseconds since an epoch that only this host knows.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct Time(u64);

impl Time {
    /// The epoch itself.
    pub const ZERO: Self = Self(0);
    /// The end of time: later than every stamp of a session.
    pub const MAX: Self = Self(u64::MAX);

    /// The point `nanos` nanoseconds after the epoch.
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// The point `millis` milliseconds after the epoch.
    pub const fn from_millis(millis: u64) -> Self {
        Self(millis.saturating_mul(1_000_000))
    }

    /// Nanoseconds since the epoch.
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// Seconds since the epoch.
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// Whether it is time, at `now`, for what is due at this point. [`Time::MAX`] never comes, or whatever is due again and
    /// again would be due without end.
    #[must_use]
    pub fn has_come(self, now: Self) -> bool {
        self <= now && self < Self::MAX
    }

    /// Time passed since `earlier`; zero if `earlier` is later than `self`.
    #[must_use]
    pub const fn saturating_since(self, earlier: Self) -> Duration {
        Duration::from_nanos(self.0.saturating_sub(earlier.0))
    }

    /// Signed difference `self - other` in nanoseconds, saturating.
    pub const fn signed_since(self, other: Self) -> i64 {
        if self.0 >= other.0 {
            let d = self.0 - other.0;
            if d > i64::MAX as u64 {
                i64::MAX
            } else {
                d as i64
            }
        } else {
            let d = other.0 - self.0;
            if d > i64::MAX as u64 {
                i64::MIN
            } else {
                -(d as i64)
            }
        }
    }

    /// This point moved by a signed number of nanoseconds, saturating at both ends.
    #[must_use]
    pub const fn offset_by(self, nanos: i64) -> Self {
        Self(self.0.saturating_add_signed(nanos))
    }
}

/// Nanoseconds of a duration, saturating at `u64::MAX` (585 years).
pub fn duration_nanos(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

impl Add<Duration> for Time {
    type Output = Self;
    fn add(self, duration: Duration) -> Self {
        Self(self.0.saturating_add(duration_nanos(duration)))
    }
}

impl AddAssign<Duration> for Time {
    fn add_assign(&mut self, duration: Duration) {
        *self = *self + duration;
    }
}

impl Sub<Duration> for Time {
    type Output = Self;
    fn sub(self, duration: Duration) -> Self {
        Self(self.0.saturating_sub(duration_nanos(duration)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_comes_but_the_end_of_time() {
        let now = Time::from_millis(2);
        assert!(now.has_come(now) && Time::ZERO.has_come(now) && now.has_come(Time::MAX));
        assert!(!Time::from_millis(3).has_come(now) && !Time::MAX.has_come(Time::MAX));
    }

    #[test]
    fn arithmetic_saturates_instead_of_wrapping() {
        assert_eq!(Time::MAX + TICK, Time::MAX);
        assert_eq!(Time::ZERO - TICK, Time::ZERO);
        assert_eq!(Time::ZERO.saturating_since(Time::MAX), Duration::ZERO);
        assert_eq!(Time::MAX.signed_since(Time::ZERO), i64::MAX);
        assert_eq!(Time::ZERO.signed_since(Time::MAX), i64::MIN);
        assert_eq!(
            Time::from_millis(2).signed_since(Time::from_millis(3)),
            -1_000_000
        );
        assert_eq!(Time::from_millis(2).offset_by(-2_000_001), Time::ZERO);
    }
}
