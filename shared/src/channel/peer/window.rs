//! Which of the last numbers have been seen.

/// How many of the last numbers are remembered: 10 s at 100 datagrams a second, 1 s at 1 kHz.
pub const WINDOW: u32 = 1024;

const WORD: u32 = u64::BITS;
const WORDS: usize = (WINDOW / WORD) as usize;

/// Where a number lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// Beyond the newest.
    Ahead,
    /// Below the newest, never seen.
    Gap,
    /// Seen before.
    Taken,
    /// Below all that is remembered.
    Behind,
}

/// The newest number and one bit for each of the [`WINDOW`] last ones, at the number's remainder.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    newest: u32,
    seen: [u64; WORDS],
}

impl Default for Window {
    /// The number 0, which nothing has, counts as the newest at first.
    fn default() -> Self {
        let mut window = Self {
            newest: 0,
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

    /// Where `number` lies; from now on it has been seen.
    pub(super) fn note(&mut self, number: u32) -> Place {
        let place = match number.checked_sub(self.newest) {
            Some(0) => Place::Taken,
            Some(ahead) => {
                self.forget(ahead);
                self.newest = number;
                Place::Ahead
            }
            None if self.newest - number >= WINDOW => Place::Behind,
            None if self.bit(number) => Place::Taken,
            None => Place::Gap,
        };
        if place != Place::Behind {
            self.set(number, true);
        }
        place
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
}

/// Lets updates through in strictly increasing sequence and counts what it stops.
///
/// Numbers never wrap. A sequence of 0, which no update has, is a duplicate.
#[derive(Clone, Debug, Default)]
pub struct SequenceWindow {
    window: Window,
    duplicate: u64,
    stale: u64,
}

impl SequenceWindow {
    /// Judges an update's sequence number. Only [`Freshness::Fresh`] may go on, to be [accepted](Self::accept) or not.
    pub fn judge(&mut self, sequence: u32) -> Freshness {
        if sequence > self.window.newest() {
            return Freshness::Fresh;
        }
        match self.window.note(sequence) {
            Place::Ahead => Freshness::Fresh,
            Place::Taken => {
                self.duplicate += 1;
                Freshness::Duplicate
            }
            Place::Gap | Place::Behind => {
                self.stale += 1;
                Freshness::Stale
            }
        }
    }

    /// Takes note of an update that was accepted: nothing up to its number is fresh any more.
    pub fn accept(&mut self, sequence: u32) {
        self.window.note(sequence);
    }

    /// The greatest sequence number accepted, 0 before the first.
    pub fn newest(&self) -> u32 {
        self.window.newest()
    }

    /// How many were stopped as seen before.
    pub fn duplicate(&self) -> u64 {
        self.duplicate
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
        assert_eq!(window.note(2), Place::Ahead);
        assert_eq!(window.note(1 + WINDOW), Place::Ahead);
        assert_eq!(window.note(2), Place::Taken, "{} back", WINDOW - 1);
        assert_eq!(window.note(1), Place::Behind, "{WINDOW} back");
        assert_eq!(window.note(3), Place::Gap);
        assert_eq!(window.note(2 + WINDOW), Place::Ahead);
        assert_eq!(window.note(2), Place::Behind);
    }

    #[test]
    fn the_last_numbers_of_all_work_and_do_not_wrap() {
        let mut window = SequenceWindow::default();
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
        fn a_window_agrees_with_a_set_that_remembers_all(
            start in prop_oneof![Just(0_u32), Just(u32::MAX - 6000)],
            numbers in prop::collection::vec(1_u32..6000, 1..300),
        ) {
            let (mut window, mut all) = (Window::default(), BTreeSet::new());
            let mut newest = 0;
            for number in numbers.into_iter().map(|n| start + n) {
                let place = window.note(number);
                let expected = if number > newest {
                    Place::Ahead
                } else if newest - number >= WINDOW {
                    Place::Behind
                } else if all.contains(&number) {
                    Place::Taken
                } else {
                    Place::Gap
                };
                prop_assert_eq!(place, expected, "{}", number);
                all.insert(number);
                newest = newest.max(number);
            }
        }
    }
}
