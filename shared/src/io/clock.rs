//! The one place that reads the host's clocks.
//!
//! Stamps are `CLOCK_MONOTONIC` since the clock was started: no jump of the wall clock touches them, the
//! host's uptime stays private, and they are short on the wire. It must never read the wall clock.

use std::time::Duration;

use rustix::fs::Timespec;
use rustix::io::Errno;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, clock_gettime};

use crate::time::Time;

const NANOS_PER_S: u64 = 1_000_000_000;

/// The host's monotonic clock with its own epoch. Copies share the epoch; start one per process and hand
/// out copies.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    /// `CLOCK_MONOTONIC` at the epoch, ns.
    epoch_ns: u64,
}

impl Clock {
    /// A clock whose epoch is now.
    pub fn start() -> Self {
        Self {
            epoch_ns: nanos(clock_gettime(ClockId::Monotonic)),
        }
    }

    /// A clock that counts from the boot of the host, for times that never leave the process.
    pub const fn since_boot() -> Self {
        Self { epoch_ns: 0 }
    }

    /// Now. Neither locks nor allocates; does not enter the kernel where it has a vDSO.
    pub fn now(&self) -> Time {
        let now_ns = nanos(clock_gettime(ClockId::Monotonic));
        Time::from_nanos(now_ns.saturating_sub(self.epoch_ns))
    }

    /// Waits until `deadline`; returns at once if it has passed. A signal does not end the wait early.
    ///
    /// The deadline is absolute (`TIMER_ABSTIME`), so that the time between reading the clock and falling
    /// asleep is not added to the wait.
    pub fn sleep_until(&self, deadline: Time) {
        let at = timespec(self.epoch_ns.saturating_add(deadline.as_nanos()));
        // Only EINTR can happen: the clock exists and the timespec is normalised. Anything else would
        // repeat for ever, so it ends the wait, and the caller sees that it is early.
        while let Err(Errno::INTR) = clock_nanosleep_absolute(ClockId::Monotonic, &at) {}
    }
}

/// CPU time that the calling thread has used so far. Costs a system call (about 0.2 µs).
pub fn thread_cpu_time() -> Duration {
    Duration::from_nanos(nanos(clock_gettime(ClockId::ThreadCPUTime)))
}

fn nanos(at: Timespec) -> u64 {
    let seconds = u64::try_from(at.tv_sec).unwrap_or(0);
    let rest = u64::try_from(at.tv_nsec).unwrap_or(0);
    seconds.saturating_mul(NANOS_PER_S).saturating_add(rest)
}

fn timespec(nanos: u64) -> Timespec {
    // u64::MAX ns is 1.8e10 s: both fit.
    Timespec {
        tv_sec: (nanos / NANOS_PER_S) as _,
        tv_nsec: (nanos % NANOS_PER_S) as _,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_never_ends_before_its_deadline() {
        let clock = Clock::start();
        for _ in 0..5 {
            let deadline = clock.now() + Duration::from_micros(300);
            clock.sleep_until(deadline);
            assert!(clock.now() >= deadline);
        }
    }

    #[test]
    fn a_deadline_in_the_past_does_not_wait_for_ever() {
        Clock::start().sleep_until(Time::ZERO);
    }

    #[test]
    fn copies_share_the_epoch() {
        let clock = Clock::start();
        let copy = clock;
        let (first, second, third) = (clock.now(), copy.now(), clock.now());
        assert!(first <= second && second <= third);
    }

    #[test]
    fn thread_cpu_time_counts_work_and_not_sleep() {
        let clock = Clock::start();
        let before = thread_cpu_time();
        clock.sleep_until(clock.now() + Duration::from_millis(20));
        let slept = thread_cpu_time() - before;
        // an upper bound that a sleep counted as work would break, whatever the scheduler does
        assert!(slept < Duration::from_millis(20), "{slept:?}");
        let mut x = 1u64;
        while thread_cpu_time() - before < slept + Duration::from_micros(100) {
            x = std::hint::black_box(x.wrapping_mul(3));
        }
        assert!(thread_cpu_time() > before + slept);
    }

    #[test]
    fn timespecs_survive_the_round_trip() {
        for ns in [0, 1, 999_999_999, 1_000_000_000, 86_400_000_000_123] {
            assert_eq!(nanos(timespec(ns)), ns);
        }
    }
}
