//! The clock of a slave on another host.

use std::time::Duration;

use mmt_shared::time::Time;

/// The slave's clock as a function of the master's, which is the world's.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlaveClock {
    pub(super) ahead: Duration,
    /// How much it gains, ns per ms, which is ppm.
    pub(super) drift_ppm: u64,
}

impl SlaveClock {
    pub(super) fn at(&self, now: Time) -> Time {
        let ms = now.as_nanos() / 1_000_000;
        now + self.ahead + Duration::from_nanos(ms.saturating_mul(self.drift_ppm))
    }
}
