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
pub(super) struct Departures {
    kept: VecDeque<(u32, Time)>,
    /// The newest, while it is too near to the one before to be kept: the last before a pause must not be forgotten.
    newest: Option<(u32, Time)>,
}

impl Default for Departures {
    fn default() -> Self {
        Self {
            kept: VecDeque::with_capacity(KEPT),
            newest: None,
        }
    }
}

impl Departures {
    /// A datagram leaves at `now`.
    pub(super) fn note(&mut self, number: u32, now: Time) {
        if self.kept.back().is_some_and(|(_, last)| now < *last + STEP) {
            self.newest = Some((number, now));
            return;
        }
        let before_a_pause = self.newest.take().filter(|(_, then)| now >= *then + STEP);
        for departure in before_a_pause.into_iter().chain([(number, now)]) {
            if self.kept.len() == KEPT {
                self.kept.pop_front();
            }
            self.kept.push_back(departure);
        }
    }

    /// When the first that is remembered after the datagram of this number left.
    pub(super) fn first_after(&self, number: u32) -> Option<Time> {
        let index = self.kept.partition_point(|(sent, _)| *sent <= number);
        let newest = self.newest.as_ref().filter(|(sent, _)| *sent > number);
        self.kept.get(index).or(newest).map(|(_, at)| *at)
    }

    /// Number of the newest that is remembered from `until` or before; 0 before the first.
    pub(super) fn newest_by(&self, until: Time) -> u32 {
        let index = self.kept.partition_point(|(_, at)| *at <= until);
        let kept = index.checked_sub(1).and_then(|index| self.kept.get(index));
        let newest = self.newest.as_ref().filter(|(_, at)| *at <= until);
        newest.or(kept).map_or(0, |(number, _)| *number)
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
        assert_eq!(departures.first_after(600), Some(Time::from_millis(6005)));
        assert_eq!(departures.first_after(3), Some(Time::from_millis(890)));
        assert_eq!(departures.newest_by(Time::from_millis(5999)), 599);
        assert_eq!(departures.newest_by(Time::from_millis(889)), 0);
        assert_eq!(departures.first_after(601), None);
        // 5 ms apart only each second one is kept, and the last before a pause
        departures.note(602, Time::from_millis(6010));
        departures.note(603, Time::from_millis(6015));
        departures.note(604, Time::from_millis(7000));
        assert_eq!(departures.first_after(601), Some(Time::from_millis(6010)));
        assert_eq!(departures.first_after(602), Some(Time::from_millis(6015)));
        assert_eq!(departures.first_after(603), Some(Time::from_millis(7000)));
        assert_eq!(departures.newest_by(Time::from_millis(6999)), 603);
    }
}
