//! When a relay need not wake up: what saves wake-ups, and moves no departure or moves it by 100 us at most.

use std::time::Duration;

use mmt_shared::time::Time;

/// The longest time for which what comes in is left to the kernel.
const REST_MAX: Duration = Duration::from_millis(1);
/// Bytes a second, by the kernel's count, that must find room in a socket meanwhile: six times what a relay carries.
const REST_BYTES_PER_S: u64 = 1_000_000_000;
/// Wake-ups are close within this time of each other, so many in a row; then there is one in that time at most.
const CLOSE: Duration = Duration::from_micros(200);
const IN_A_ROW: u32 = 4;
const MERGED: Duration = Duration::from_micros(100);

/// What is known of the wake-ups so far.
#[derive(Debug)]
pub(super) struct Pace {
    /// The longest rest in which no socket overflows.
    rest: Duration,
    woke: Time,
    /// Wake-ups in a row that were close to the one before.
    close: u32,
}

impl Pace {
    /// That of a relay whose sockets have room for so many bytes.
    pub(super) fn new(room: usize) -> Self {
        let rest = Duration::from_nanos(room as u64 * 1_000_000_000 / REST_BYTES_PER_S);
        Self {
            rest: rest.min(REST_MAX),
            woke: Time::ZERO,
            close: 0,
        }
    }

    /// Takes note of a wake-up.
    pub(super) fn wakes(&mut self, now: Time) {
        let is_close = now.saturating_since(self.woke) < CLOSE;
        self.close = if is_close {
            self.close.saturating_add(1)
        } else {
            0
        };
        self.woke = now;
    }

    /// Whether wake-ups are close to each other.
    pub(super) fn is_busy(&self) -> bool {
        self.close >= IN_A_ROW
    }

    /// Until when the sockets need no look, if that is so. Something leaves next at `due`; of what comes from now on nothing
    /// leaves before `earliest`, and the kernel notes when it came: then all that comes until `due` is read with one wake-up.
    pub(super) fn rest(&self, now: Time, due: Option<Time>, earliest: Time) -> Option<Time> {
        let rests = |due: &Time| *due > now && *due <= now + self.rest && earliest >= *due;
        let merged = self.is_busy().then(|| self.woke + MERGED);
        due.filter(rests).max(merged).filter(|until| *until > now)
    }
}

/// What ends a wait after a rest: what is due later, or what has become due meanwhile, at once. If nothing has, the next
/// datagram does; a rest that ended the wait by itself would wake up again and again with nothing to do.
pub(super) fn after(rest: Option<Time>, due: Option<Time>) -> (Option<Time>, Option<Time>) {
    let passed = due.filter(|due| rest.is_some_and(|rest| *due <= rest));
    (due.filter(|_| passed.is_none()), passed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn us(us: u64) -> Time {
        Time::from_nanos(us * 1000)
    }

    #[test]
    fn it_rests_until_the_next_departure_where_nothing_can_leave_earlier() {
        let pace = Pace::new(8 << 20);
        let rest = |due, earliest| pace.rest(us(10_000), due, earliest);
        let due = Some(us(10_900));
        assert_eq!(rest(due, us(15_000)), due);
        assert_eq!(
            rest(due, us(10_800)),
            None,
            "something may come that leaves earlier"
        );
        assert_eq!(rest(Some(us(11_100)), us(15_000)), None, "too long");
        assert_eq!(rest(Some(us(9_000)), us(15_000)), None, "due already");
        assert_eq!(rest(None, us(15_000)), None, "nobody wakes it");
        let small = Pace::new(400_000);
        assert_eq!(small.rest(us(10_000), due, us(15_000)), None, "no room");
        let due = Some(us(10_400));
        assert_eq!(small.rest(us(10_000), due, us(15_000)), due);
    }

    #[test]
    fn close_wake_ups_are_merged_and_others_are_not() {
        let mut pace = Pace::new(8 << 20);
        (1..=3).for_each(|n| pace.wakes(us(10_000 + 20 * n)));
        assert_eq!(pace.rest(us(10_062), None, us(0)), None);
        (4..=6).for_each(|n| pace.wakes(us(10_000 + 20 * n)));
        assert_eq!(pace.rest(us(10_122), None, us(0)), Some(us(10_220)));
        // of what is due meanwhile nothing is later than that
        let due = Some(us(10_130));
        assert_eq!(pace.rest(us(10_122), due, us(0)), Some(us(10_220)));
        assert_eq!(pace.rest(us(10_230), None, us(0)), None, "long at work");
        pace.wakes(us(11_000));
        assert_eq!(pace.rest(us(11_001), None, us(0)), None);
    }

    #[test]
    fn a_rest_ends_the_wait_after_it_only_for_what_became_due() {
        let (rest, early, late) = (Some(us(100)), Some(us(90)), Some(us(110)));
        assert_eq!(after(rest, None), (None, None));
        assert_eq!(after(rest, late), (late, None));
        assert_eq!(after(rest, early), (None, early));
        assert_eq!(after(rest, rest), (None, rest));
        assert_eq!(after(None, late), (late, None));
    }
}
