//! The clock of the drivers.

use mmt_shared::io::clock::Clock;
use mmt_shared::time::Time;

pub(crate) use mmt_shared::io::alarm::{Alarm, wait};

/// The time of `CLOCK_MONOTONIC`, which is the clock of every `Time` in the drivers.
#[must_use]
pub fn now() -> Time {
    const CLOCK: Clock = Clock::since_boot();
    CLOCK.now()
}
