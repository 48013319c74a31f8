//! The policy in virtual time.

use super::*;

const MS: fn(u64) -> Duration = Duration::from_millis;

/// A loop whose tick number 1 is under way from the beginning, after so many missed ones, and the looks at it.
struct Looks {
    watchdog: Watchdog,
    now: Time,
    seen: TickSeen,
}

impl Looks {
    fn after(missed: u64) -> Self {
        let now = Time::from_millis(5000);
        let mut looks = Self {
            watchdog: Watchdog::new(now),
            now,
            seen: TickSeen { number: 1, missed },
        };
        // the look that sees the tick first
        assert!(!looks.look(LOOK, Doing::Blocked));
        looks
    }

    fn look(&mut self, after: Duration, doing: Doing) -> bool {
        self.now += after;
        self.watchdog.look(self.now, Some(self.seen), || doing)
    }

    /// How long until the tick counts as hung; none within ten seconds.
    fn until_hung(&mut self, mut next: impl FnMut(u32) -> (Duration, Doing)) -> Option<Duration> {
        let began = self.now;
        for k in 0..1000 {
            let (after, doing) = next(k);
            if self.look(after, doing) {
                return Some(self.now.saturating_since(began));
            }
        }
        None
    }
}

#[test]
fn a_tick_that_is_blocked_has_hung_after_80_ms_and_not_a_look_before() {
    let mut looks = Looks::after(0);
    let until = looks.until_hung(|_| (LOOK, Doing::Blocked));
    assert_eq!(until, Some(HUNG));
    // it began at most a look before it was seen
    assert!(HUNG + LOOK < MS(100));
}

#[test]
fn a_tick_that_computes_for_ever_has_hung_after_80_ms_of_cpu_time() {
    let whole = |k: u32| (LOOK, Doing::Runnable(LOOK * k));
    let until = Looks::after(0).until_hung(whole);
    // the first look only learns where the CPU time begins
    assert_eq!(until, Some(HUNG + LOOK));
    let fifth = |k: u32| (LOOK, Doing::Runnable(MS(2) * k));
    assert_eq!(Looks::after(0).until_hung(fifth), Some(5 * HUNG + LOOK));
}

#[test]
fn a_loop_that_gets_no_cpu_is_kept_by_the_kernel_or_waits_for_its_deadline_has_not_hung() {
    let starved = |_| (LOOK, Doing::Runnable(MS(7)));
    assert_eq!(Looks::after(0).until_hung(starved), None);
    assert_eq!(Looks::after(0).until_hung(|_| (LOOK, Doing::Kept)), None);
    let mut watchdog = Watchdog::new(Time::ZERO);
    for k in 1..1000 {
        let waits = watchdog.look(Time::ZERO + LOOK * k, None, || Doing::Blocked);
        assert!(!waits);
    }
}

#[test]
fn looks_that_come_late_tell_nothing_however_long_the_process_was_stopped() {
    assert_eq!(
        Looks::after(0).until_hung(|_| (2 * LOOK, Doing::Blocked)),
        None
    );
    let mut looks = Looks::after(0);
    assert!(!looks.look(MS(5000), Doing::Blocked));
    // and what counted before counts on
    assert_eq!(looks.until_hung(|_| (LOOK, Doing::Blocked)), Some(HUNG));
}

#[test]
fn another_tick_begins_anew() {
    let mut looks = Looks::after(0);
    for k in 0..1000 {
        looks.seen.number += 2;
        for _ in 0..7 {
            assert!(!looks.look(LOOK, Doing::Blocked), "{k}");
        }
    }
}

#[test]
fn a_tick_that_makes_up_for_missed_ones_has_that_much_longer_and_a_second_at_most() {
    let blocked = |_| (LOOK, Doing::Blocked);
    assert_eq!(Looks::after(500).until_hung(blocked), Some(HUNG + MS(500)));
    let most = Some(HUNG + MS(1000));
    assert_eq!(Looks::after(u64::MAX).until_hung(blocked), most);
}

#[test]
fn a_pulse_shows_the_tick_under_way_and_each_has_another_number() {
    let pulse = Pulse::default();
    assert_eq!(pulse.tick(), None);
    pulse.end();
    assert_eq!(pulse.tick(), None);
    pulse.begin(3);
    let first = pulse.tick().unwrap();
    assert_eq!(first.missed, 3);
    pulse.end();
    assert_eq!(pulse.tick(), None);
    pulse.begin(0);
    assert_ne!(pulse.tick().unwrap().number, first.number);
}
