//! Which of the last numbers have been seen.

/// How many of the last numbers are remembered: 10 s at 100 datagrams a second, 1 s at 1 kHz.
pub const WINDOW: u32 = 1024;

const WORD: u32 = u64::BITS;
const WORDS: usize = (WINDOW / WORD) as usize;

/// Where a number lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WindowPosition {
    /// Beyond the newest.
    Ahead,
    /// Below the newest, never seen.
    Gap,
    /// Seen before.
    Taken,
    /// Below all that is remembered.
    Behind,
    /// [`WINDOW`] or more beyond the newest, and alone there.
    Implausible,
}

/// The newest number and one bit for each of the [`WINDOW`] last ones, at the number's remainder.
///
/// One number never takes the newest further ahead than the window reaches back: whatever it was, those that follow
/// are still distinguished. Where the numbers have really gone on (an outage, a host that stood still) the second that arrives
/// shows it, however many were lost.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    newest: u32,
    /// The last number that was too far ahead, 0 before the first.
    far: u32,
    seen: [u64; WORDS],
}

impl Default for Window {
    /// The number 0, which nothing has, counts as the newest at first.
    fn default() -> Self {
        let mut window = Self {
            newest: 0,
            far: 0,
            seen: [0; WORDS],
        };
        window.set(0, true);
        window
    }
}

impl Window {
    pub(super) fn newest(&self) -> u32 {
        self.newest
    }

    /// Where `number` lies; from now on it has been seen, unless it is implausible.
    pub(super) fn note(&mut self, number: u32) -> WindowPosition {
        let place = match number.checked_sub(self.newest) {
            Some(0) => WindowPosition::Taken,
            Some(ahead) if ahead < WINDOW || self.is_second(number) && number != self.far => {
                self.go_on(number);
                return WindowPosition::Ahead;
            }
            Some(_) => {
                self.far = number;
                return WindowPosition::Implausible;
            }
            None if self.newest - number >= WINDOW => return WindowPosition::Behind,
            None if self.bit(number) => WindowPosition::Taken,
            None => WindowPosition::Gap,
        };
        self.set(number, true);
        place
    }

    /// Whether a number lies where another one was too far ahead.
    fn is_second(&self, number: u32) -> bool {
        self.far > 0 && number.abs_diff(self.far) < WINDOW
    }

    /// Makes `number` the newest; it is beyond the one before.
    fn go_on(&mut self, number: u32) {
        self.forget(number - self.newest);
        self.newest = number;
        self.set(number, true);
    }

    /// Clears the bits of the `ahead` numbers after the newest.
    fn forget(&mut self, ahead: u32) {
        if ahead >= WINDOW {
            self.seen = [0; WORDS];
        } else {
            for step in 1..=ahead {
                self.set(self.newest.wrapping_add(step), false);
            }
        }
    }

    fn bit(&self, number: u32) -> bool {
        let (word, mask) = position(number);
        self.seen.get(word).is_some_and(|bits| bits & mask != 0)
    }

    fn set(&mut self, number: u32, seen: bool) {
        let (word, mask) = position(number);
        if let Some(bits) = self.seen.get_mut(word) {
            *bits = if seen { *bits | mask } else { *bits & !mask };
        }
    }
}

/// Word and bit of a number. [`WINDOW`] divides 2^32.
fn position(number: u32) -> (usize, u64) {
    let place = number % WINDOW;
    ((place / WORD) as usize, 1 << (place % WORD))
}

/// What an update's sequence number is to the ones before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freshness {
    /// Beyond all before: it goes on.
    Fresh,
    /// Seen before: a repeat, or the network duplicated it. Drop it.
    Duplicate,
    /// A newer one was received: it is out of date. Drop it.
    Stale,
    /// Further ahead than one update alone shows: drop it. The next one there, or its repeat, is fresh.
    Implausible,
}

/// Lets updates through in strictly increasing sequence and counts what it stops.
///
/// Numbers never wrap. A sequence of 0, which no update has, is a duplicate.
#[derive(Clone, Debug, Default)]
pub struct SequenceWindow {
    window: Window,
    duplicate: u64,
    stale: u64,
    implausible: u64,
}

impl SequenceWindow {
    /// Judges an update's sequence number. Only [`Freshness::Fresh`] may go on, to be [accepted](Self::accept) or not.
    pub fn judge(&mut self, sequence: u32) -> Freshness {
        let window = &mut self.window;
        let ahead = sequence.saturating_sub(window.newest);
        if ahead > 0 {
            if ahead < WINDOW || window.is_second(sequence) {
                return Freshness::Fresh;
            }
            window.far = sequence;
            self.implausible += 1;
            return Freshness::Implausible;
        }
        match window.note(sequence) {
            WindowPosition::Taken => {
                self.duplicate += 1;
                Freshness::Duplicate
            }
            _ => {
                self.stale += 1;
                Freshness::Stale
            }
        }
    }

    /// Takes note of an update that was accepted: nothing up to its number is fresh any more.
    pub fn accept(&mut self, sequence: u32) {
        if sequence > self.window.newest {
            self.window.go_on(sequence);
        }
    }

    /// The greatest sequence number accepted, 0 before the first.
    pub fn newest(&self) -> u32 {
        self.window.newest()
    }

    /// How many were stopped as seen before.
    pub fn duplicate(&self) -> u64 {
        self.duplicate
    }

    /// How many were stopped as too far ahead.
    pub fn implausible(&self) -> u64 {
        self.implausible
    }

    /// How many were stopped as older than one seen.
    pub fn stale(&self) -> u64 {
        self.stale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    impl SequenceWindow {
        /// Judges, and accepts what is fresh.
        fn offer(&mut self, sequence: u32) -> Freshness {
            let freshness = self.judge(sequence);
            if freshness == Freshness::Fresh {
                self.accept(sequence);
            }
            freshness
        }
    }

    #[test]
    fn what_is_not_accepted_stays_fresh() {
        let mut window = SequenceWindow::default();
        window.accept(3);
        assert_eq!(window.judge(5), Freshness::Fresh);
        assert_eq!((window.judge(5), window.newest()), (Freshness::Fresh, 3));
        window.accept(5);
        assert_eq!(window.judge(5), Freshness::Duplicate);
    }

    #[test]
    fn a_window_forgets_exactly_after_its_length() {
        let mut window = Window::default();
        assert_eq!(window.note(2), WindowPosition::Ahead);
        assert_eq!(window.note(4), WindowPosition::Ahead);
        assert_eq!(window.note(1 + WINDOW), WindowPosition::Ahead);
        assert_eq!(window.note(2), WindowPosition::Taken, "{} back", WINDOW - 1);
        assert_eq!(window.note(1), WindowPosition::Behind, "{WINDOW} back");
        assert_eq!(window.note(3), WindowPosition::Gap);
        assert_eq!(window.note(2 + WINDOW), WindowPosition::Ahead);
        assert_eq!(window.note(2), WindowPosition::Behind);
    }

    #[test]
    fn a_sequence_far_ahead_is_fresh_when_a_second_update_is_there_too() {
        let mut window = SequenceWindow::default();
        assert_eq!(window.offer(WINDOW - 1), Freshness::Fresh);
        let far = u32::MAX - 7;
        assert_eq!(window.offer(far), Freshness::Implausible);
        assert_eq!(window.offer(WINDOW), Freshness::Fresh);
        assert_eq!((window.newest(), window.implausible()), (WINDOW, 1));
        assert_eq!(window.judge(far), Freshness::Fresh, "its repeat");
        assert_eq!(
            window.judge(WINDOW + 1),
            Freshness::Fresh,
            "it was not accepted"
        );
        assert_eq!(window.offer(far), Freshness::Fresh);
        assert_eq!(window.judge(WINDOW + 2), Freshness::Stale);
    }

    #[test]
    fn the_last_numbers_of_all_work_and_do_not_wrap() {
        let mut window = SequenceWindow::default();
        assert_eq!(window.offer(u32::MAX - 2), Freshness::Implausible);
        assert_eq!(window.offer(u32::MAX - 1), Freshness::Fresh);
        assert_eq!(window.offer(u32::MAX), Freshness::Fresh);
        assert_eq!(window.offer(0), Freshness::Stale);
        assert_eq!(window.offer(1), Freshness::Stale);
        assert_eq!(window.offer(u32::MAX), Freshness::Duplicate);
        assert_eq!(window.newest(), u32::MAX);
    }

    #[test]
    fn an_older_update_never_passes_and_is_counted_by_its_cause() {
        let mut window = SequenceWindow::default();
        assert_eq!(window.offer(0), Freshness::Duplicate);
        for (sequence, expected) in [
            (1, Freshness::Fresh),
            (4, Freshness::Fresh),
            (4, Freshness::Duplicate),
            (2, Freshness::Stale),
            (2, Freshness::Duplicate),
            (5, Freshness::Fresh),
        ] {
            assert_eq!(window.offer(sequence), expected, "{sequence}");
        }
        assert_eq!((window.duplicate(), window.stale()), (3, 1));
    }

    proptest! {
        #[test]
        fn one_hostile_sequence_makes_no_more_stale_than_a_window(
            before in 0_u32..3000,
            hostile in any::<u32>(),
            after in prop::collection::vec(1_u32..20, 1..200),
        ) {
            let mut window = SequenceWindow::default();
            (1..=before).for_each(|sequence| assert_eq!(window.offer(sequence), Freshness::Fresh));
            window.offer(hostile);
            let mut sequence = before;
            for step in after {
                sequence += step;
                let fresh = window.offer(sequence) == Freshness::Fresh;
                let in_reach = (before..before + WINDOW).contains(&hostile);
                prop_assert!(fresh || in_reach && sequence <= hostile, "{}", sequence);
            }
        }

        #[test]
        fn a_window_agrees_with_a_set_that_remembers_all(
            start in prop_oneof![Just(0_u32), Just(u32::MAX - 6000)],
            numbers in prop::collection::vec(1_u32..6000, 1..300),
        ) {
            let (mut window, mut all) = (Window::default(), BTreeSet::new());
            let (mut newest, mut far) = (0, 0);
            for number in numbers.into_iter().map(|n| start + n) {
                let place = window.note(number);
                let second = number != far && number.abs_diff(far) < WINDOW;
                let expected = if number > newest && number - newest >= WINDOW && !second {
                    far = number;
                    prop_assert_eq!(place, WindowPosition::Implausible, "{}", number);
                    continue;
                } else if number > newest {
                    WindowPosition::Ahead
                } else if newest - number >= WINDOW {
                    WindowPosition::Behind
                } else if all.contains(&number) {
                    WindowPosition::Taken
                } else {
                    WindowPosition::Gap
                };
                prop_assert_eq!(place, expected, "{}", number);
                all.insert(number);
                newest = newest.max(number);
            }
        }
    }
}
