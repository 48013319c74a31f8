//! The queue in the round trips of one round, apart from jitter and from the length of the path.
//!
//! Jitter spreads the round trips and lifts even the quickest of a few above the shortest of thousands, by less than
//! it lies below their mean; a queue lifts all alike (cf. the delay of LEDBAT, RFC 6817, section 3.4).

use std::time::Duration;

/// The round trips of a round.
#[derive(Clone, Copy, Debug)]
pub struct RoundTrips {
    count: u32,
    quickest: Duration,
    sum: Duration,
}

impl RoundTrips {
    /// A round without any.
    pub const NONE: Self = Self {
        count: 0,
        quickest: Duration::MAX,
        sum: Duration::ZERO,
    };

    /// Adds one.
    pub fn add(&mut self, round_trip: Duration) {
        self.count = self.count.saturating_add(1);
        self.quickest = self.quickest.min(round_trip);
        self.sum = self.sum.saturating_add(round_trip);
    }

    /// How many there are.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// How much longer than the path's shortest round trip, `base`, the quickest took.
    pub fn excess(&self, base: Duration) -> Duration {
        self.quickest.saturating_sub(base)
    }

    /// The queue that there is for certain: the excess less the jitter.
    pub fn queue(&self, base: Duration) -> Duration {
        // jitter: how much longer than the quickest they took on average
        let mean = self.sum.checked_div(self.count).unwrap_or_default();
        let jitter = mean.saturating_sub(self.quickest);
        self.excess(base).saturating_sub(jitter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(millis: u64) -> Duration {
        Duration::from_millis(millis)
    }

    #[test]
    fn a_queue_lifts_all_round_trips_and_jitter_only_some() {
        let of = |all: [u64; 4]| {
            let mut round = RoundTrips::NONE;
            all.into_iter().for_each(|millis| round.add(ms(millis)));
            (round.excess(ms(100)), round.queue(ms(100)))
        };
        assert_eq!(of([100; 4]), (ms(0), ms(0)));
        assert_eq!(of([150; 4]), (ms(50), ms(50)));
        assert_eq!(of([110, 130, 150, 170]), (ms(10), ms(0)));
        assert_eq!(of([150, 160, 170, 160]), (ms(50), ms(40)));
    }

    #[test]
    fn without_round_trips_and_at_the_end_of_time_nothing_panics() {
        let mut round = RoundTrips::NONE;
        assert_eq!(round.queue(Duration::MAX), Duration::ZERO);
        round.add(Duration::MAX);
        round.add(Duration::MAX);
        assert_eq!(round.count(), 2);
        assert!(round.queue(Duration::ZERO) > Duration::ZERO);
    }
}
