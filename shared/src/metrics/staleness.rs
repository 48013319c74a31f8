//! Staleness: how long an update takes to become known at the master.
//!
//! Only where both ends' clock is one: in virtual time. It must never count an update that is still on its way.

use std::collections::VecDeque;
use std::time::Duration;

use crate::time::Time;

/// Updates that may be on their way; the oldest beyond are not counted.
const WAITING_MAX: usize = 4096;

/// Accumulates, update by update, the time from its being sent until the master knows it or a newer one.
///
/// Unlike the age of information it does not grow while nothing new is sent: it is what loss costs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Staleness {
    waiting: VecDeque<(u32, Time)>,
    known: Vec<Duration>,
}

impl Staleness {
    /// An update was sent for the first time; sequences increase.
    pub fn sent(&mut self, now: Time, sequence: u32) {
        if self.waiting.len() == WAITING_MAX {
            self.waiting.pop_front();
        }
        self.waiting.push_back((sequence, now));
    }

    /// The master knows update `sequence`, and with it all that were sent before.
    pub fn known(&mut self, now: Time, sequence: u32) {
        while let Some((_, sent)) = self.waiting.front().filter(|(of, _)| *of <= sequence) {
            self.known.push(now.saturating_since(*sent));
            self.waiting.pop_front();
        }
    }

    /// The time of each update that became known, in the order in which they were sent.
    pub fn times(&self) -> &[Duration] {
        &self.known
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_update_counts_until_it_or_a_newer_one_is_known() {
        let at = Time::from_millis;
        let mut staleness = Staleness::default();
        staleness.sent(at(0), 1);
        staleness.sent(at(10), 2);
        staleness.sent(at(20), 3);
        staleness.known(at(50), 1);
        assert_eq!(staleness.times(), [Duration::from_millis(50)]);
        // the second was lost, the third carries it as well
        staleness.known(at(70), 3);
        staleness.known(at(80), 3);
        assert_eq!(staleness.times(), [50, 60, 50].map(Duration::from_millis));
    }
}
