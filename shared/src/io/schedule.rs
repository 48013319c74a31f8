//! The deadline policy of the 1 kHz loops, as a pure function of the times that the clock showed.
//!
//! Deadlines lie on a grid `first + k·period` that never moves. After an overrun the loop waits for the
//! next deadline that is still to come; a wake that comes whole periods late takes the grid point that it
//! came into. So no deadline is served twice, none is served early, missed ones are counted and never made
//! up for in a burst, and the phase is kept for ever.

use std::time::Duration;

use crate::time::{Time, duration_nanos};

/// One turn of the loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick {
    /// Number of the grid point, from 0; rises by more than one when some were skipped.
    pub index: u64,
    /// The grid point itself: the tick's stamp, free of wake-up jitter.
    pub deadline: Time,
    /// Grid points missed since the tick before.
    pub skipped: u64,
    /// From the deadline that was slept for to the wake. Longer than a period if some were skipped by it.
    pub lateness: Duration,
}

/// The grid of deadlines and the place on it.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    first: Time,
    period_ns: u64,
    /// The next grid point that has not been served or skipped.
    next: u64,
    /// The grid point that the loop sleeps for.
    awaited: u64,
}

impl Schedule {
    /// A grid that starts at `first`; a zero period counts as 1 ns.
    pub fn new(first: Time, period: Duration) -> Self {
        Self {
            first,
            period_ns: duration_nanos(period).max(1),
            next: 0,
            awaited: 0,
        }
    }

    /// The deadline to sleep for, seen from `now`: the next one, or, after an overrun, the first that is
    /// still to come.
    pub fn next_deadline(&mut self, now: Time) -> Time {
        self.awaited = match self.latest_at(now) {
            Some(latest) if latest >= self.next => latest.saturating_add(1),
            _ => self.next,
        };
        self.deadline(self.awaited)
    }

    /// The tick that a wake at `now` begins; `None` if it came before its deadline and must sleep again.
    pub fn wake(&mut self, now: Time) -> Option<Tick> {
        let index = self.latest_at(now).filter(|&at| at >= self.awaited)?;
        let tick = Tick {
            index,
            deadline: self.deadline(index),
            skipped: index.saturating_sub(self.next),
            lateness: now.saturating_since(self.deadline(self.awaited)),
        };
        self.next = index.saturating_add(1);
        self.awaited = self.next;
        Some(tick)
    }

    /// The latest grid point that is not after `now`.
    fn latest_at(&self, now: Time) -> Option<u64> {
        let since_ns = now.as_nanos().checked_sub(self.first.as_nanos())?;
        since_ns.checked_div(self.period_ns)
    }

    fn deadline(&self, index: u64) -> Time {
        self.first + Duration::from_nanos(index.saturating_mul(self.period_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::TICK;
    use proptest::prelude::*;

    fn at(micros: u64) -> Time {
        Time::from_nanos(micros * 1000)
    }

    /// Sleeps and wakes once: begins to wait at `now`, wakes `late_us` after the deadline.
    fn turn(schedule: &mut Schedule, now: Time, late_us: u64) -> (Tick, Time) {
        let woken = schedule.next_deadline(now).max(now) + Duration::from_micros(late_us);
        (schedule.wake(woken).unwrap(), woken)
    }

    #[test]
    fn a_loop_on_time_serves_every_deadline() {
        let mut schedule = Schedule::new(at(500), TICK);
        let mut now = at(0);
        for k in 0..1000 {
            let (tick, woken) = turn(&mut schedule, now, 60);
            assert_eq!((tick.index, tick.skipped), (k, 0));
            assert_eq!(tick.deadline, at(500 + 1000 * k));
            assert_eq!(tick.lateness, Duration::from_micros(60));
            now = woken + Duration::from_micros(200);
        }
    }

    #[test]
    fn an_overrun_waits_for_the_next_deadline_to_come() {
        let mut schedule = Schedule::new(at(0), TICK);
        schedule.wake(at(0)).unwrap();
        // work until 3.2 ms: 1, 2 and 3 are lost, 4 is waited for
        assert_eq!(schedule.next_deadline(at(3200)), at(4000));
        let tick = schedule.wake(at(4010)).unwrap();
        assert_eq!((tick.index, tick.skipped), (4, 3));
        assert_eq!(tick.lateness, Duration::from_micros(10));
    }

    #[test]
    fn work_that_ends_exactly_on_a_deadline_has_missed_it() {
        let mut schedule = Schedule::new(at(0), TICK);
        schedule.wake(at(0)).unwrap();
        let mut just_before = schedule;
        assert_eq!(
            just_before.next_deadline(Time::from_nanos(999_999)),
            at(1000)
        );
        assert_eq!(schedule.next_deadline(at(1000)), at(2000));
    }

    #[test]
    fn a_wake_whole_periods_late_takes_the_grid_point_it_came_into() {
        let mut schedule = Schedule::new(at(0), TICK);
        schedule.wake(at(0)).unwrap();
        assert_eq!(schedule.next_deadline(at(100)), at(1000));
        let tick = schedule.wake(at(3500)).unwrap();
        assert_eq!((tick.index, tick.skipped, tick.deadline), (3, 2, at(3000)));
        assert_eq!(tick.lateness, Duration::from_micros(2500));
        // no burst: the next is the next to come
        assert_eq!(schedule.next_deadline(at(3600)), at(4000));
    }

    #[test]
    fn an_early_wake_is_no_tick() {
        let mut schedule = Schedule::new(at(0), TICK);
        schedule.wake(at(0)).unwrap();
        let deadline = schedule.next_deadline(at(100));
        assert_eq!(schedule.wake(at(999)), None);
        assert_eq!(schedule.wake(deadline).map(|tick| tick.index), Some(1));
    }

    #[test]
    fn the_end_of_time_does_not_panic() {
        let mut schedule = Schedule::new(Time::MAX, Duration::ZERO);
        assert_eq!(schedule.next_deadline(Time::ZERO), Time::MAX);
        assert!(schedule.wake(Time::MAX).is_some());
        let _ = schedule.next_deadline(Time::MAX);
        let _ = schedule.wake(Time::MAX);
    }

    proptest! {
        #[test]
        fn no_deadline_is_served_twice_or_early_and_every_one_is_accounted_for(
            steps in prop::collection::vec((0u64..4000, 0u64..4000), 1..200),
        ) {
            let mut schedule = Schedule::new(at(0), TICK);
            let (mut now, mut served, mut skipped, mut last) = (at(0), 0, 0, None);
            for (work_us, late_us) in steps {
                let (tick, woken) = turn(&mut schedule, now, late_us);
                prop_assert!(last.is_none_or(|last| tick.index > last));
                prop_assert!(tick.deadline <= woken, "served early");
                prop_assert!(woken.saturating_since(tick.deadline) < TICK, "served stale");
                prop_assert_eq!(tick.deadline.as_nanos() % 1_000_000, 0, "the phase moved");
                served += 1;
                skipped += tick.skipped;
                prop_assert_eq!(tick.index + 1, served + skipped);
                last = Some(tick.index);
                now = woken + Duration::from_micros(work_us);
            }
        }
    }
}
