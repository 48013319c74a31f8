//! The 1 kHz loop: waits for absolute deadlines on its own thread and measures itself.
//!
//! The policy is [`Schedule`]'s. The ticker sleeps, never spins (a thread under `SCHED_FIFO` that spins is
//! throttled into holes of 50 ms), never allocates after `new`, never locks and never logs.

use std::ops::ControlFlow;
use std::time::Duration;

use super::clock::{Clock, thread_cpu_time};
use super::schedule::{Schedule, Tick};
use super::watchdog::Pulse;
use crate::report::LoopReport;
use crate::stats::histogram::{Histogram, Quantiles};

/// How a loop did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickerReport {
    /// Ticks served.
    pub ticks: u64,
    /// Deadlines skipped because the loop or the host was late.
    pub skipped: u64,
    /// From the deadline slept for to the wake.
    pub lateness: Quantiles,
    /// CPU time of the thread from the wake to the next wait.
    pub cpu: Quantiles,
}

impl From<&TickerReport> for LoopReport {
    fn from(of: &TickerReport) -> Self {
        Self {
            ticks: Some(of.ticks),
            skipped: Some(of.skipped),
            cpu_us: (&of.cpu).into(),
            lateness_us: (&of.lateness).into(),
        }
    }
}

/// A loop with absolute deadlines. Belongs to one thread: CPU time is that of the thread that calls
/// [`Ticker::wait`].
#[derive(Debug)]
pub struct Ticker {
    clock: Clock,
    schedule: Schedule,
    ticks: u64,
    skipped: u64,
    lateness: Histogram,
    cpu: Histogram,
    /// CPU time of the thread at the last wake; none before the first.
    woken_cpu: Option<Duration>,
    /// Where its ticks are seen by a watchdog.
    pulse: Pulse,
}

impl Ticker {
    /// A loop whose first deadline is one `period` from now.
    pub fn new(clock: Clock, period: Duration) -> Self {
        Self {
            schedule: Schedule::new(clock.now() + period, period),
            clock,
            ticks: 0,
            skipped: 0,
            lateness: Histogram::default(),
            cpu: Histogram::default(),
            woken_cpu: None,
            pulse: Pulse::default(),
        }
    }

    /// The same with this pulse: a tick is under way from each wake to the next wait.
    #[must_use]
    pub fn watched_by(mut self, pulse: Pulse) -> Self {
        self.pulse = pulse;
        self
    }

    /// Waits for the next deadline.
    pub fn wait(&mut self) -> Tick {
        self.pulse.end();
        if let Some(before) = self.woken_cpu {
            self.cpu.record(thread_cpu_time().saturating_sub(before));
        }
        let tick = loop {
            let deadline = self.schedule.next_deadline(self.clock.now());
            self.clock.sleep_until(deadline);
            if let Some(tick) = self.schedule.wake(self.clock.now()) {
                break tick;
            }
        };
        self.ticks = self.ticks.saturating_add(1);
        self.skipped = self.skipped.saturating_add(tick.skipped);
        self.lateness.record(tick.lateness);
        self.woken_cpu = Some(thread_cpu_time());
        self.pulse.begin(tick.skipped);
        tick
    }

    /// Calls `tick` at every deadline until it breaks.
    pub fn run(&mut self, mut tick: impl FnMut(Tick) -> ControlFlow<()>) {
        while tick(self.wait()).is_continue() {}
    }

    /// How the loop did so far. Does not allocate; takes some microseconds.
    pub fn report(&self) -> TickerReport {
        TickerReport {
            ticks: self.ticks,
            skipped: self.skipped,
            lateness: self.lateness.quantiles(),
            cpu: self.cpu.quantiles(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_accounts_for_every_deadline_however_late_the_host_is() {
        let clock = Clock::start();
        let mut ticker = Ticker::new(clock, Duration::from_millis(1));
        let mut last: Option<Tick> = None;
        ticker.run(|tick| {
            assert!(clock.now() >= tick.deadline);
            let expected = last.map_or(0, |last| last.index + 1) + tick.skipped;
            assert_eq!(tick.index, expected);
            last = Some(tick);
            if tick.index < 50 {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        });
        let report = ticker.report();
        assert_eq!(report.ticks + report.skipped, last.unwrap().index + 1);
        assert_eq!(report.lateness.count, report.ticks);
        assert_eq!(report.cpu.count, report.ticks - 1);
    }

    #[test]
    fn an_overrun_is_counted() {
        let clock = Clock::start();
        let mut ticker = Ticker::new(clock, Duration::from_millis(1));
        ticker.wait();
        clock.sleep_until(clock.now() + Duration::from_millis(5));
        assert!(ticker.wait().skipped >= 4);
        assert!(ticker.report().skipped >= 4);
    }
}
