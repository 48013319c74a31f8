//! Which datagrams an end takes, by their numbers.

use std::collections::BTreeSet;

/// Numbers so far behind the newest are not judged by an end, and one so far ahead waits for a second.
pub(super) const WINDOW: u32 = 1024;

/// Which numbers an end takes: each once, none from long ago, and one far ahead only when another confirms it.
#[derive(Default)]
pub(super) struct Intake {
    seen: BTreeSet<u32>,
    /// The last number that was too far ahead.
    far: u32,
    /// The newest that it took.
    pub(super) newest: u32,
}

impl Intake {
    /// Whether it takes the next that arrives.
    pub(super) fn takes(&mut self, number: u32) -> bool {
        let newest = self.newest;
        let too_far = number.saturating_sub(newest) >= WINDOW;
        if too_far && (number == self.far || number.abs_diff(self.far) >= WINDOW) {
            self.far = number;
            return false;
        }
        if number == 0 || newest.saturating_sub(number) >= WINDOW || !self.seen.insert(number) {
            return false;
        }
        while self
            .seen
            .first()
            .is_some_and(|first| newest.saturating_sub(*first) > 2 * WINDOW)
        {
            self.seen.pop_first();
        }
        self.newest = newest.max(number);
        true
    }
}
