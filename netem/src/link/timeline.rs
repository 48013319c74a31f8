//! Which settings are in force when.

use std::time::Duration;

use mmt_shared::time::{Time, duration_nanos};

use crate::config::LinkConfig;

/// The settings of a link over time. Times are counted from the origin.
#[derive(Clone, Debug)]
pub(super) struct Timeline {
    pub(super) origin: Time,
    pub(super) config: LinkConfig,
    /// The stretches of constant settings, each with its beginning.
    stretches: Vec<(Duration, LinkConfig)>,
    /// Whether there is cross traffic at any time.
    pub(super) crossed: bool,
}

impl Timeline {
    pub(super) fn new(origin: Time, config: LinkConfig) -> Self {
        Self {
            origin,
            stretches: config.profile.stretches(&config),
            crossed: config.has_cross_traffic(),
            config,
        }
    }

    /// How long after the origin `time` is.
    pub(super) fn elapsed(&self, time: Time) -> Duration {
        time.saturating_since(self.origin)
    }

    /// The time `elapsed` after the origin.
    pub(super) fn time(&self, elapsed: Duration) -> Time {
        self.origin + elapsed
    }

    /// The settings in force `elapsed` after the origin.
    pub(super) fn at(&self, elapsed: Duration) -> &LinkConfig {
        // most links never change
        if self.stretches.len() <= 1 {
            return &self.config;
        }
        let (_, within) = self.round(elapsed);
        let begun = self.stretches.partition_point(|(at, _)| *at <= within);
        let stretch = self.stretches.get(begun.saturating_sub(1));
        stretch.map_or(&self.config, |(_, settings)| settings)
    }

    /// When the settings in force at `elapsed` change next.
    pub(super) fn next_change(&self, elapsed: Duration) -> Option<Duration> {
        if self.stretches.len() <= 1 {
            return None;
        }
        let (round, within) = self.round(elapsed);
        let begun = self.stretches.partition_point(|(at, _)| *at <= within);
        let next = self.stretches.get(begun).map(|(at, _)| *at);
        let next = next.or(self.config.profile.repeat)?;
        Some(round.saturating_add(next))
    }

    /// The beginning of the round of the loop that `elapsed` is in, and how far into it that is.
    fn round(&self, elapsed: Duration) -> (Duration, Duration) {
        let Some(repeat) = self.config.profile.repeat else {
            return (Duration::ZERO, elapsed);
        };
        let elapsed = duration_nanos(elapsed);
        let within = elapsed % duration_nanos(repeat).max(1);
        let begin = Duration::from_nanos(elapsed - within);
        (begin, Duration::from_nanos(within))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_change_is_that_of_the_steps_and_then_of_the_loop() {
        let next = |words: &str, ms| {
            let timeline = Timeline::new(Time::ZERO, words.parse().unwrap());
            let next = timeline.next_change(Duration::from_millis(ms));
            next.map(|next| next.as_millis())
        };
        let looped = "delay 20ms; at 1s delay 80ms; at 2s loss 100%; loop 3s";
        assert_eq!(next(looped, 100), Some(1000));
        assert_eq!(next(looped, 2100), Some(3000));
        assert_eq!(next(looped, 3500), Some(4000));
        assert_eq!(next("delay 20ms; at 3s none", 3100), None);
        assert_eq!(next("delay 20ms", 0), None);
    }
}
