//! Round-trip time from echo stamps: latest, least and longest of the last seconds, quantiles over all.

use std::time::Duration;

use crate::stats::histogram::Histogram;
use crate::stats::recent::Recent;
use crate::time::Time;

/// Least and longest are over this many seconds, the running one included.
const WINDOW_S: usize = 10;

/// Round-trip times without the time that the other side held the answer.
///
/// They are exact on this side's clock, whatever the other's does, save for drift during the hold
/// (200 ppm of 50 ms is 10 µs).
#[derive(Clone, Debug)]
pub struct RoundTrip {
    latest: Option<Duration>,
    /// The least and the longest of each of the last seconds.
    ends: Recent<Option<(Duration, Duration)>, WINDOW_S>,
    histogram: Histogram,
}

impl Default for RoundTrip {
    fn default() -> Self {
        Self {
            latest: None,
            ends: Recent::new(None),
            histogram: Histogram::default(),
        }
    }
}

impl RoundTrip {
    pub(super) fn note(&mut self, now: Time, round_trip: Duration) {
        self.latest = Some(round_trip);
        self.histogram.record(round_trip);
        if let Some(slice) = self.ends.at(now) {
            let (least, most) = slice.unwrap_or((round_trip, round_trip));
            *slice = Some((least.min(round_trip), most.max(round_trip)));
        }
    }

    /// The last one measured.
    pub fn latest(&self) -> Option<Duration> {
        self.latest
    }

    /// The least of the last 9 to 10 s; the last one if nothing was measured in that time.
    pub fn least(&self, now: Time) -> Option<Duration> {
        let least = self.recent(now).map(|(least, _)| *least);
        least.min().or(self.latest)
    }

    /// The longest of the last 9 to 10 s; the last one if nothing was measured in that time.
    pub fn longest(&self, now: Time) -> Option<Duration> {
        let most = self.recent(now).map(|(_, most)| *most);
        most.max().or(self.latest)
    }

    fn recent(&self, now: Time) -> impl Iterator<Item = &(Duration, Duration)> {
        self.ends.iter_at(now).flatten()
    }

    /// All that have been measured.
    pub fn histogram(&self) -> &Histogram {
        &self.histogram
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn least_and_longest_are_of_the_last_ten_seconds_or_else_the_last_one() {
        let (ms, mut round_trip) = (Duration::from_millis, RoundTrip::default());
        let at = Time::from_millis;
        assert_eq!(round_trip.least(at(0)), None);
        round_trip.note(at(500), ms(20));
        round_trip.note(at(501), ms(80));
        assert_eq!(round_trip.latest(), Some(ms(80)));
        assert_eq!(round_trip.least(at(501)), Some(ms(20)));
        assert_eq!(round_trip.longest(at(501)), Some(ms(80)));
        for s in 1..10 {
            round_trip.note(at(s * 1000), ms(50));
        }
        assert_eq!(round_trip.least(at(9_999)), Some(ms(20)));
        assert_eq!(round_trip.least(at(10_000)), Some(ms(50)));
        assert_eq!(round_trip.longest(at(10_000)), Some(ms(50)));
        round_trip.note(at(10_000), ms(60));
        assert_eq!(round_trip.least(at(10_000)), Some(ms(50)));
        round_trip.note(at(10_001), ms(70));
        let late = at(30_000);
        assert_eq!(round_trip.least(late), Some(ms(70)), "nothing for 20 s");
        assert_eq!(round_trip.longest(late), Some(ms(70)));
        assert_eq!(round_trip.histogram().total(), 13);
    }
}
