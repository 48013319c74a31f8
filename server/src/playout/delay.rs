//! The play-out delay: it follows what 99 of 100 samples need, slowly, within its configured range.

use std::time::Duration;

use mmt_shared::time::Time;

use super::config::PlayoutConfig;
use super::lateness::Lateness;

/// Room above the lateness of 99 of 100 samples, ns: the slave's ticks.
const ROOM_NS: i64 = 2_000_000;
/// How often the delay that is wanted is computed, ticks: the histogram changes slowly.
const COMPUTE_EVERY: u32 = 100;
/// The delay grows by at most 1/20 of the time that passes, and shrinks by 1/100: played motion is 5 % too
/// slow while samples come late, which a hand does not notice, and 1 % too quick afterwards.
const GROW_DIVISOR: i64 = 20;
const SHRINK_DIVISOR: i64 = 100;
/// A delay stays while what is wanted is less than this below it, ns: no hunting.
const SHRINK_BAND_NS: i64 = 2_000_000;

/// The delay and how late samples have been.
#[derive(Clone, Debug)]
pub(super) struct AdaptiveDelay {
    delay_ns: i64,
    /// Least and greatest delay, ns.
    range_ns: (i64, i64),
    /// Where the delay slews to, ns.
    wanted_ns: i64,
    ticks: u32,
    lateness: Lateness,
}

impl AdaptiveDelay {
    pub(super) fn new(config: &PlayoutConfig) -> Self {
        let least = (config.delay_ms * 1e6) as i64;
        Self {
            delay_ns: least,
            range_ns: (least, least.max((config.delay_max_ms * 1e6) as i64)),
            wanted_ns: least,
            ticks: 0,
            lateness: Lateness::new(),
        }
    }

    pub(super) fn get(&self) -> Duration {
        Duration::from_nanos(self.delay_ns.unsigned_abs())
    }

    /// The stamp that is due where the quickest sample that could arrive now has the stamp `newest`.
    pub(super) fn before(&self, newest: Time) -> Time {
        newest.offset_by(-self.delay_ns)
    }

    /// Takes a sample that arrived at `arrived`, `late` after the quickest would have.
    pub(super) fn observe(&mut self, arrived: Time, late: Duration) {
        self.lateness.observe(arrived, late);
    }

    /// Begins again from the least delay, because the clock is learned anew.
    pub(super) fn relearn(&mut self) {
        self.lateness = Lateness::new();
        self.wanted_ns = self.range_ns.0;
    }

    /// Lets `elapsed` pass: brings the delay towards what samples need.
    pub(super) fn advance(&mut self, elapsed: Duration) {
        let (least, most) = self.range_ns;
        if least == most {
            return;
        }
        self.ticks += 1;
        if self.ticks >= COMPUTE_EVERY {
            self.ticks = 0;
            let needed = self.lateness.p99().map_or(least, |late| {
                i64::try_from(late.as_nanos()).map_or(most, |late| late.saturating_add(ROOM_NS))
            });
            self.wanted_ns = needed.clamp(least, most);
        }
        let passed = i64::try_from(elapsed.as_nanos()).unwrap_or(i64::MAX);
        let off = self.wanted_ns - self.delay_ns;
        if off > 0 {
            self.delay_ns += off.min(passed / GROW_DIVISOR);
        } else if off < -SHRINK_BAND_NS || self.wanted_ns == least {
            self.delay_ns += off.max(-passed / SHRINK_DIVISOR);
        }
    }
}
