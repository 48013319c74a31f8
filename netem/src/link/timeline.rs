//! Which settings are in force when.

use std::time::Duration;

use mmt_shared::time::duration_nanos;

use crate::config::LinkConfig;

/// The stretches of constant settings of a link, and the one in force.
#[derive(Clone, Debug)]
pub(super) struct Timeline {
    stretches: Vec<(Duration, LinkConfig)>,
    repeat: Option<Duration>,
}

impl Timeline {
    pub(super) fn new(config: &LinkConfig) -> Self {
        Self {
            stretches: config.profile.stretches(config),
            repeat: config.profile.repeat,
        }
    }

    /// The settings in force `elapsed` after the start.
    pub(super) fn at<'a>(&'a self, elapsed: Duration, base: &'a LinkConfig) -> &'a LinkConfig {
        // most links never change
        if self.stretches.len() <= 1 {
            return base;
        }
        let within = match self.repeat {
            Some(repeat) => {
                Duration::from_nanos(duration_nanos(elapsed) % duration_nanos(repeat).max(1))
            }
            None => elapsed,
        };
        let begun = self.stretches.partition_point(|(at, _)| *at <= within);
        let stretch = self.stretches.get(begun.saturating_sub(1));
        stretch.map_or(base, |(_, settings)| settings)
    }

    /// Every set of settings that ever is in force.
    pub(super) fn settings(&self) -> impl Iterator<Item = &LinkConfig> {
        self.stretches.iter().map(|(_, settings)| settings)
    }

    /// When the settings in force at `elapsed` change next.
    pub(super) fn next_change(&self, elapsed: Duration) -> Option<Duration> {
        let (rounds, within) = match self.repeat {
            Some(repeat) => {
                let repeat = duration_nanos(repeat).max(1);
                let elapsed = duration_nanos(elapsed);
                let within = Duration::from_nanos(elapsed % repeat);
                (Duration::from_nanos(elapsed - elapsed % repeat), within)
            }
            None => (Duration::ZERO, elapsed),
        };
        let next = self.stretches.iter().map(|(at, _)| *at);
        let next = next.filter(|at| *at > within).min().or(self.repeat)?;
        (self.stretches.len() > 1).then(|| rounds.saturating_add(next))
    }
}
