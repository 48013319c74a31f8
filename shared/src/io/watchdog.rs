//! The hang watchdog of a 1 kHz loop: is a tick under way that does not end?
//!
//! The policy is a pure function of what a thread beside the loop sees every [`LOOK`]. A tick has hung once it has stood or
//! computed for [`HUNG`] and the share of missed ticks that it makes up for. Time in which nobody could have noticed
//! does not count: a look that came late (the process was stopped, the host suspended or short of CPU), a loop that
//! is ready to run and gets no CPU, one that the kernel keeps from running, and the wait for the next deadline, which
//! only a host can make long.

mod thread;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crate::time::{TICK, Time};

pub use thread::watch;

/// Between two looks.
pub const LOOK: Duration = Duration::from_millis(10);
/// So long a tick may take, by looks that count: with the look that finds it, a hang is noticed within 100 ms.
pub const HUNG: Duration = Duration::from_millis(80);
/// The most missed ticks that one tick makes up for: a second of them.
const MADE_UP_MAX: u64 = 1000;

/// The pulse of a loop: its ticks begin and end on it. Copies are the same pulse.
#[derive(Clone, Debug, Default)]
pub struct Pulse(Arc<Beats>);

#[derive(Debug, Default)]
struct Beats {
    /// Odd while a tick is under way.
    count: AtomicU64,
    /// Ticks that were missed right before the one under way.
    missed: AtomicU64,
}

impl Pulse {
    /// A tick begins, after so many that were missed. Neither this nor [`Pulse::end`] waits or allocates; the loop's thread alone
    /// calls them.
    pub fn begin(&self, missed: u64) {
        self.0.missed.store(missed, Ordering::Relaxed);
        let count = self.0.count.load(Ordering::Relaxed);
        self.0.count.store(count | 1, Ordering::Release);
    }

    /// The tick has ended.
    pub fn end(&self) {
        let count = self.0.count.load(Ordering::Relaxed);
        let even = count.wrapping_add(count & 1);
        self.0.count.store(even, Ordering::Release);
    }

    /// The tick that is under way; none while the loop waits for the next.
    pub fn tick(&self) -> Option<TickSeen> {
        let number = self.0.count.load(Ordering::Acquire);
        let missed = self.0.missed.load(Ordering::Relaxed);
        (number & 1 == 1).then_some(TickSeen { number, missed })
    }
}

/// A tick under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickSeen {
    /// Differs from that of every other tick.
    pub number: u64,
    /// How many were missed right before it.
    pub missed: u64,
}

/// What the loop's thread does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doing {
    /// It waits for something that is no disk: a lock, a socket, another thread.
    Blocked,
    /// It runs or could run, and has used so much CPU time since it began.
    Runnable(Duration),
    /// The kernel keeps it: it waits for a disk or a page, or is stopped; or nothing is known of it.
    Kept,
}

/// The policy.
#[derive(Clone, Debug)]
pub struct Watchdog {
    /// The last look.
    looked: Time,
    /// The tick that was under way then.
    tick: Option<u64>,
    /// CPU time of the loop's thread then, where it could run.
    used: Option<Duration>,
    /// For how long this tick has stood or computed, by looks that count.
    stood: Duration,
}

impl Watchdog {
    /// From now on.
    pub fn new(now: Time) -> Self {
        Self {
            looked: now,
            tick: None,
            used: None,
            stood: Duration::ZERO,
        }
    }

    /// Takes a look; whether the tick under way has hung. `doing` is asked only if the same tick was under way at the look before.
    pub fn look(
        &mut self,
        now: Time,
        tick: Option<TickSeen>,
        doing: impl FnOnce() -> Doing,
    ) -> bool {
        let elapsed = now.saturating_since(self.looked);
        self.looked = now;
        let Some(seen) = tick.filter(|seen| Some(seen.number) == self.tick) else {
            self.tick = tick.map(|seen| seen.number);
            (self.stood, self.used) = (Duration::ZERO, None);
            return false;
        };
        let doing = doing();
        let used = match doing {
            Doing::Runnable(used) => Some(used),
            Doing::Blocked | Doing::Kept => None,
        };
        let counts = match (doing, self.used) {
            // whoever looks late was not there either
            _ if elapsed >= 2 * LOOK => Duration::ZERO,
            (Doing::Blocked, _) => elapsed,
            (Doing::Runnable(used), Some(before)) => used.saturating_sub(before).min(elapsed),
            (Doing::Runnable(_), None) | (Doing::Kept, _) => Duration::ZERO,
        };
        self.used = used;
        self.stood += counts;
        let made_up = seen.missed.min(MADE_UP_MAX) as u32;
        self.stood >= HUNG + made_up * TICK
    }
}

#[cfg(test)]
mod tests;
