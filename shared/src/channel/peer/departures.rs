//! When the last datagrams were sent: how long what was sent has been without an answer.

use std::collections::VecDeque;
use std::time::Duration;

use crate::time::Time;

/// Departures are remembered this far apart.
const STEP: Duration = Duration::from_millis(10);
/// And so many of them: 5 s, the longest round trip of 4 s and the second after which a link counts as dead.
const KEPT: usize = 512;

/// Numbers and times of departure, oldest first. Never allocates once made.
#[derive(Clone, Debug)]
pub(super) struct Departures(VecDeque<(u32, Time)>);

impl Default for Departures {
    fn default() -> Self {
        Self(VecDeque::with_capacity(KEPT))
    }
}

impl Departures {
    /// A datagram leaves at `now`.
    pub(super) fn note(&mut self, number: u32, now: Time) {
        if self.0.back().is_some_and(|(_, last)| now < *last + STEP) {
            return;
        }
        if self.0.len() == KEPT {
            self.0.pop_front();
        }
        self.0.push_back((number, now));
    }

    /// When the first that is remembered after the datagram of this number left.
    pub(super) fn first_after(&self, number: u32) -> Option<Time> {
        let index = self.0.partition_point(|(sent, _)| *sent <= number);
        self.0.get(index).map(|(_, at)| *at)
    }

    /// Number of the newest that is remembered from `until` or before; 0 before the first.
    pub(super) fn newest_by(&self, until: Time) -> u32 {
        let index = self.0.partition_point(|(_, at)| *at <= until);
        let newest = index.checked_sub(1).and_then(|index| self.0.get(index));
        newest.map_or(0, |(number, _)| *number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn departures_are_found_by_number_and_by_time_and_the_oldest_are_forgotten() {
        let mut departures = Departures::default();
        assert_eq!(departures.first_after(0), None);
        assert_eq!(departures.newest_by(Time::from_millis(9)), 0);
        for number in 1..=600 {
            departures.note(number, Time::from_millis(10 * u64::from(number)));
        }
        departures.note(601, Time::from_millis(6005));
        assert_eq!(departures.first_after(599), Some(Time::from_millis(6000)));
        assert_eq!(
            departures.first_after(600),
            None,
            "5 ms later: not remembered"
        );
        assert_eq!(departures.first_after(3), Some(Time::from_millis(890)));
        assert_eq!(departures.newest_by(Time::from_millis(5999)), 599);
        assert_eq!(departures.newest_by(Time::from_millis(889)), 0);
    }
}
