//! The deadband as a rate controller: by how much an end sends less while the path is congested.
//!
//! Pure and of fixed size. Both ends run it on their own round trips: the slave stretches Delta and T_update, the
//! master the time between samples. It must never act on loss, on jitter or on a path that is merely long.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::stats::queue::RoundTrips;
use crate::time::Time;

/// A round lasts at least this long.
const ROUND: Duration = Duration::from_millis(100);
/// A round has at least this many round trips, so that one of them is quick in spite of jitter: with heartbeats
/// alone a round lasts 0.2 s.
const ANSWERS: u32 = 5;
/// A queue longer than this is congestion. More than twice the queue that the transport's own controller aims at
/// (docs/transport.md), so that the two do not fight.
const QUEUE_MAX: Duration = Duration::from_millis(30);
/// A queue shorter than this is none.
const QUEUE_CLEAR: Duration = Duration::from_millis(10);
/// A queue that fell below this share of the last round's goes away by itself.
const DRAINING: f64 = 0.8;
/// Congested rounds in a row before anything is done: one may be a hiccup.
const ROUNDS: u32 = 2;
/// A queue longer than this is no hiccup: one round is enough.
const QUEUE_SURE: Duration = Duration::from_millis(90);
/// Each congested round multiplies the stretch by this.
const RISE: f64 = 2.0;
/// A second without a queue takes this off the stretch: from 3 to 1 in 8 s.
const RETURN_PER_S: f64 = 0.25;
/// Accepted greatest stretch: 1 is off, 8 is 80 % of error at a deadband of 10 %.
const STRETCH_MAX: (f64, f64) = (1.0, 8.0);

/// The greatest stretch that congestion may lead to, 1 to 8; 1: none. The bound of everything that is stretched:
/// Delta, T_update, the time between two samples of a command.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct StretchMax(f64);

/// Why a number is no greatest stretch.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("greatest stretch '{0}' is outside the accepted range {min} to {max}; 1 is off", min = STRETCH_MAX.0, max = STRETCH_MAX.1)]
pub struct StretchMaxError(String);

impl StretchMax {
    /// Nothing is stretched.
    pub const OFF: Self = Self(1.0);
    /// The default of recommended mode: Delta from 10 to 30 %, T_update from 150 to 450 ms, every third sample.
    pub const RECOMMENDED: Self = Self(3.0);

    /// The factor.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl TryFrom<f64> for StretchMax {
    type Error = StretchMaxError;

    fn try_from(factor: f64) -> Result<Self, StretchMaxError> {
        if (STRETCH_MAX.0..=STRETCH_MAX.1).contains(&factor) {
            Ok(Self(factor))
        } else {
            Err(StretchMaxError(factor.to_string()))
        }
    }
}

impl From<StretchMax> for f64 {
    fn from(max: StretchMax) -> Self {
        max.0
    }
}

impl FromStr for StretchMax {
    type Err = StretchMaxError;

    fn from_str(text: &str) -> Result<Self, StretchMaxError> {
        let factor = text.parse::<f64>();
        let factor = factor.map_err(|_| StretchMaxError(text.to_owned()))?;
        Self::try_from(factor)
    }
}

impl fmt::Display for StretchMax {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// Round trips of one round.
#[derive(Clone, Copy, Debug)]
struct Round {
    began: Time,
    round_trips: RoundTrips,
}

/// Finds congestion in round trips and reports by how much to stretch.
///
/// In rounds of 100 ms the quickest round trip is compared with the least of the last seconds ([`RoundTrips`]). A
/// queue in two rounds in a row, or a long one in one, stretches, multiplicatively, until it falls; without a queue
/// the stretch returns, additively in time.
#[derive(Clone, Debug)]
pub struct RateController {
    max: f64,
    stretch: f64,
    round: Option<Round>,
    congested: u32,
    queue: Duration,
}

impl RateController {
    /// A controller that stretches by at most `max`.
    pub fn new(max: StretchMax) -> Self {
        Self {
            max: max.get(),
            stretch: 1.0,
            round: None,
            congested: 0,
            queue: Duration::ZERO,
        }
    }

    /// By how much to stretch now: 1 without congestion, never above the greatest.
    pub fn stretch(&self) -> f64 {
        self.stretch
    }

    /// Takes a round trip that was measured at `now`, and the least one of the last seconds.
    pub fn observe(&mut self, now: Time, round_trip: Duration, least: Duration) {
        if self.max <= 1.0 {
            return;
        }
        let round = self.round.get_or_insert(Round {
            began: now,
            round_trips: RoundTrips::NONE,
        });
        round.round_trips.add(round_trip);
        if round.round_trips.count() < ANSWERS || now.saturating_since(round.began) < ROUND {
            return;
        }
        let queue = round.round_trips.queue(least);
        let lasted = now.saturating_since(round.began);
        self.round = None;
        self.judge(queue, lasted);
    }

    fn judge(&mut self, queue: Duration, lasted: Duration) {
        let draining = queue < self.queue.mul_f64(DRAINING);
        self.queue = queue;
        if queue > QUEUE_MAX {
            self.congested = self.congested.saturating_add(1);
            let sure = self.congested >= ROUNDS || queue > QUEUE_SURE;
            if sure && !draining {
                self.stretch = (self.stretch * RISE).min(self.max);
            }
            return;
        }
        self.congested = 0;
        if queue < QUEUE_CLEAR {
            // a round without answers shows nothing
            let seconds = lasted.as_secs_f64().min(1.0);
            self.stretch = (self.stretch - RETURN_PER_S * seconds).max(1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Substream;
    use proptest::prelude::*;

    const LEAST: Duration = Duration::from_millis(100);

    fn max(factor: f64) -> StretchMax {
        StretchMax::try_from(factor).unwrap()
    }

    /// Feeds a round trip every 10 ms from `from_ms` on, for `ms`; returns the stretch after each.
    fn fed(
        controller: &mut RateController,
        from_ms: u64,
        ms: u64,
        round_trip_ms: impl Fn(u64) -> u64,
    ) -> Vec<f64> {
        let times = (from_ms..from_ms + ms).step_by(10);
        let step = |now| {
            let round_trip = Duration::from_millis(round_trip_ms(now));
            controller.observe(Time::from_millis(now), round_trip, LEAST);
            controller.stretch()
        };
        times.map(step).collect()
    }

    #[test]
    fn a_queue_raises_the_stretch_multiplicatively_to_its_bound() {
        let mut controller = RateController::new(max(3.0));
        let rising = fed(&mut controller, 0, 1000, |now| 150 + now / 100);
        let mut steps = rising.clone();
        steps.dedup();
        assert_eq!(steps, [1.0, 2.0, 3.0]);
        // two rounds of 100 ms, which begin 10 ms apart
        assert!(rising[..21].iter().all(|stretch| *stretch == 1.0));
        assert_eq!(rising[21], 2.0);
        // a long queue needs one
        let mut controller = RateController::new(max(3.0));
        let rising = fed(&mut controller, 0, 120, |_| 250);
        assert_eq!((rising[9], rising[10]), (1.0, 2.0));
    }

    #[test]
    fn without_a_queue_it_returns_additively_and_to_exactly_one() {
        let mut controller = RateController::new(max(3.0));
        fed(&mut controller, 0, 1000, |_| 200);
        assert_eq!(controller.stretch(), 3.0);
        let mut returning = fed(&mut controller, 1000, 10_000, |_| 101);
        returning.dedup();
        let steps: Vec<f64> = returning.windows(2).map(|pair| pair[0] - pair[1]).collect();
        // rounds of 100 ms; what rounding leaves over goes with the last
        let (whole, rest) = steps.split_at(80);
        assert!(
            whole.iter().all(|step| (step - 0.025).abs() < 1e-9),
            "{steps:?}"
        );
        assert!(rest.iter().sum::<f64>() < 1e-9);
        assert_eq!(controller.stretch(), 1.0);
    }

    #[test]
    fn a_queue_that_falls_by_itself_is_left_alone_and_a_small_one_holds() {
        let mut controller = RateController::new(max(8.0));
        fed(&mut controller, 0, 110, |_| 600);
        assert_eq!(controller.stretch(), 2.0);
        // halves every round
        let falling = fed(&mut controller, 110, 550, |now| 100 + (500 >> (now / 110)));
        assert!(falling.iter().all(|stretch| *stretch == 2.0), "{falling:?}");
        let held = fed(&mut controller, 1000, 3000, |_| 120);
        assert!(held.iter().all(|stretch| *stretch == 2.0));
    }

    #[test]
    fn one_long_round_is_no_congestion() {
        let mut controller = RateController::new(max(3.0));
        let all = fed(&mut controller, 0, 5000, |now| {
            if now % 1000 < 110 { 180 } else { 100 }
        });
        assert!(all.iter().all(|stretch| *stretch == 1.0));
    }

    #[test]
    fn jitter_and_a_long_path_are_no_congestion() {
        for (jitter_ms, every_ms) in [(5, 10), (20, 10), (20, 50)] {
            let mut draws = Substream::new(7, "jitter", jitter_ms);
            let mut controller = RateController::new(max(3.0));
            for now in (0..60_000).step_by(every_ms) {
                // two directions, each up to 2 J
                let extra = 2e-3 * jitter_ms as f64 * (draws.uniform() + draws.uniform());
                let round_trip = Duration::from_secs(1) + Duration::from_secs_f64(extra);
                controller.observe(Time::from_millis(now), round_trip, Duration::from_secs(1));
                assert_eq!(controller.stretch(), 1.0, "{jitter_ms} ms at {now} ms");
            }
        }
    }

    #[test]
    fn switched_off_it_never_stretches() {
        let mut controller = RateController::new(StretchMax::OFF);
        let all = fed(&mut controller, 0, 5000, |now| 100 + now);
        assert!(all.iter().all(|stretch| *stretch == 1.0));
    }

    #[test]
    fn a_greatest_stretch_is_written_as_a_number_in_its_range() {
        assert_eq!("3".parse(), Ok(StretchMax::RECOMMENDED));
        assert_eq!("2.5".parse::<StretchMax>().unwrap().to_string(), "2.5");
        for wrong in ["0.9", "9", "nan", "inf", "three", ""] {
            let error = wrong.parse::<StretchMax>().unwrap_err().to_string();
            assert!(error.contains("1 to 8"), "{error}");
        }
    }

    proptest! {
        #[test]
        fn whatever_comes_it_stays_within_its_bounds(
            factor in 1.0_f64..8.0,
            round_trips in prop::collection::vec((0_u64..1_000, 0_u64..u64::MAX, 0_u64..u64::MAX), 1..300),
        ) {
            let mut controller = RateController::new(max(factor));
            let mut now = Time::ZERO;
            for (wait_ms, round_trip, least) in round_trips {
                now += Duration::from_millis(wait_ms);
                controller.observe(now, Duration::from_nanos(round_trip), Duration::from_nanos(least));
                prop_assert!((1.0..=factor).contains(&controller.stretch()));
            }
        }
    }
}
