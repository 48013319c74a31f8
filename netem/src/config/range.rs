//! Every setting of a link against its range.

use std::time::Duration;

use super::{
    DELAY_MAX, LIMIT_MAX, LIMIT_MAX_BYTES, LINKS_MAX, LinkConfig, Loss, RATE_MAX_BIT_S, STEPS_MAX,
    Service,
};

/// A setting of a link out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// The delay is longer than [`DELAY_MAX`].
    #[error("link delay is {delay:?}; it can be {DELAY_MAX:?} at most")]
    DelayTooLong {
        /// The delay given.
        delay: Duration,
    },
    /// The jitter is longer than [`DELAY_MAX`].
    #[error("link jitter is {jitter:?}; it can be {DELAY_MAX:?} at most")]
    JitterTooLong {
        /// The jitter given.
        jitter: Duration,
    },
    /// The limit is zero or above [`LIMIT_MAX`].
    #[error("link limit is {limit} packets in flight; it must be between 1 and {LIMIT_MAX}")]
    LimitOutOfRange {
        /// The limit given, packets.
        limit: u32,
    },
    /// The rate is zero or above [`RATE_MAX_BIT_S`].
    #[error("link rate is {bits_per_second} bit/s; it must be between 1 and {RATE_MAX_BIT_S}")]
    RateOutOfRange {
        /// The rate given.
        bits_per_second: u64,
    },
    /// Another setting is out of its range.
    #[error("{what} of a link must be {range}")]
    OutOfRange {
        /// The setting.
        what: &'static str,
        /// Its range.
        range: &'static str,
    },
}

impl LinkConfig {
    /// Checks every setting against its range.
    ///
    /// # Errors
    /// The first setting out of its range, with the range.
    pub fn check(&self) -> Result<(), ConfigError> {
        let links = self.links().count() <= LINKS_MAX;
        holds(links, "the links in a chain", "8 at most")?;
        self.links().try_for_each(Self::check_itself)
    }

    fn check_itself(&self) -> Result<(), ConfigError> {
        self.check_delay()?;
        let limit = self.limit.packets;
        if !(1..=LIMIT_MAX).contains(&limit) {
            return Err(ConfigError::LimitOutOfRange { limit });
        }
        let bytes = (1..=LIMIT_MAX_BYTES).contains(&self.limit.bytes);
        holds(bytes, "the limit in bytes", "between 1 and 1 TiB")?;
        self.check_loss()?;
        self.check_bottleneck()?;
        self.check_profile()
    }

    fn check_delay(&self) -> Result<(), ConfigError> {
        let (delay, jitter) = (self.delay.mean, self.delay.jitter);
        if delay > DELAY_MAX {
            return Err(ConfigError::DelayTooLong { delay });
        }
        if jitter > DELAY_MAX {
            return Err(ConfigError::JitterTooLong { jitter });
        }
        holds(
            self.correlation.in_range(),
            "the time constant of jitter",
            "1 ms to 1 h",
        )?;
        let slot = self.slot.as_ref().is_none_or(super::Slot::in_range);
        holds(
            slot,
            "a slot",
            "of gaps up to 1 h, the first no longer than the second, for 1 packet or byte at least",
        )?;
        let gap = self.reorder.is_none_or(|reorder| reorder.gap > 0);
        holds(gap, "the gap of reordering", "at least 1 packet")
    }

    fn check_loss(&self) -> Result<(), ConfigError> {
        let outages = self.outages.len() <= STEPS_MAX;
        holds(outages, "the outages", "1000 at most")?;
        match &self.loss {
            Loss::FourState(chain) => holds(
                chain.is_chain(),
                "the ways out of a loss state",
                "100 % together at most",
            ),
            Loss::Bursts(bursts) => holds(
                (super::BURST_MIN..=DELAY_MAX).contains(&bursts.mean),
                "the mean burst of loss",
                "1 ms to 1 h",
            ),
            Loss::Every(n) => holds(*n > 0, "the n of `loss every`", "at least 1"),
            _ => Ok(()),
        }
    }

    fn check_bottleneck(&self) -> Result<(), ConfigError> {
        holds(self.mtu != Some(0), "the MTU", "at least 1 byte")?;
        let cross = self.cross.is_none_or(|cross| cross.in_range());
        holds(
            cross,
            "the cross traffic",
            "of 1 to 65535 bytes a packet, at most 1000000 packets/s",
        )?;
        if let Some(codel) = self.queue.codel {
            let fits = !codel.target.is_zero() && !codel.interval.is_zero();
            holds(fits, "target and interval of CoDel", "above zero")?;
        }
        match self.rate.as_ref().map(|rate| &rate.service) {
            Some(Service::Constant { bits_per_second })
                if !(1..=RATE_MAX_BIT_S).contains(bits_per_second) =>
            {
                Err(ConfigError::RateOutOfRange {
                    bits_per_second: *bits_per_second,
                })
            }
            _ => Ok(()),
        }
    }

    fn check_profile(&self) -> Result<(), ConfigError> {
        let profile = &self.profile;
        holds(
            profile.steps.len() <= STEPS_MAX,
            "the steps of a profile",
            "1000 at most",
        )?;
        let mut free_from = Duration::ZERO;
        for step in &profile.steps {
            holds(
                step.at >= free_from,
                "the steps of a profile",
                "in order, each after the ramp before it",
            )?;
            holds(
                step.settings.profile.steps.is_empty(),
                "a step of a profile",
                "without steps of its own",
            )?;
            holds(
                step.settings.then.is_none(),
                "a step of a profile",
                "without a link behind it",
            )?;
            holds(
                step.settings.seed.is_none(),
                "a step of a profile",
                "without a seed of its own",
            )?;
            step.settings.check()?;
            free_from = step.at.saturating_add(step.ramp);
        }
        let long_enough = profile
            .repeat
            .is_none_or(|repeat| repeat > free_from && !profile.steps.is_empty());
        holds(
            long_enough,
            "the loop of a profile",
            "longer than its steps",
        )
    }
}

fn holds(fits: bool, what: &'static str, range: &'static str) -> Result<(), ConfigError> {
    if !fits {
        return Err(ConfigError::OutOfRange { what, range });
    }
    Ok(())
}
