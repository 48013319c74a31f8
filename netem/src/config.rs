//! What a link is set to do: delay, order, loss, limit; checked before a link is made of it.
//!
//! The words in which people write it are in `words.rs`.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::quantile;

/// The longest delay or jitter, 1 h: beyond any path on Earth, and far from overflow in nanoseconds.
pub const DELAY_MAX: Duration = Duration::from_secs(3600);
/// The default limit, packets in flight: 10 s at 1 kHz, 15 MB of full-sized packets. `tc` has 1000,
/// which is 1 s at 1 kHz and drops silently beyond it.
pub const LIMIT_DEFAULT: u32 = 10_000;
/// The largest limit, packets in flight: 1.5 GB of full-sized packets.
pub const LIMIT_MAX: u32 = 1_000_000;

/// The settings of one direction of a path.
///
/// Reads and prints as `tc netem` words: [`std::str::FromStr`] and [`std::fmt::Display`] are inverses.
/// The default passes everything at once.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct LinkConfig {
    /// Propagation delay with its jitter.
    pub delay: Delay,
    /// Whether jitter may reorder packets.
    pub order: Order,
    /// Loss on the way.
    pub loss: Loss,
    /// Packets in flight at most, 1 to [`LIMIT_MAX`]; one more is dropped ([`crate::DropCause::Limit`]).
    pub limit: u32,
}

impl Default for LinkConfig {
    fn default() -> Self {
        Self {
            delay: Delay::default(),
            order: Order::default(),
            loss: Loss::default(),
            limit: LIMIT_DEFAULT,
        }
    }
}

impl LinkConfig {
    /// Whether this link passes every packet at once, unchanged: there is nothing to emulate.
    ///
    /// The limit counts packets in flight; without delay there are none.
    #[must_use]
    pub fn is_transparent(&self) -> bool {
        self.delay.longest() == Duration::ZERO && self.loss.probability() == Probability::ZERO
    }

    /// Checks every setting against its range.
    ///
    /// # Errors
    /// The first setting out of its range, with the range.
    pub fn check(&self) -> Result<(), ConfigError> {
        let (delay, jitter) = self.delay.parts();
        if delay > DELAY_MAX {
            return Err(ConfigError::DelayTooLong { delay });
        }
        if jitter > DELAY_MAX {
            return Err(ConfigError::JitterTooLong { jitter });
        }
        if !(1..=LIMIT_MAX).contains(&self.limit) {
            return Err(ConfigError::LimitOutOfRange { limit: self.limit });
        }
        Ok(())
    }
}

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
}

/// The distribution of the propagation delay. Every distribution is cut at zero: what would leave
/// before it came leaves at once, so a jitter near the delay raises the mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delay {
    /// The same for every packet.
    Constant {
        /// The delay.
        delay: Duration,
    },
    /// Uniform in `mean ± half_width`.
    Uniform {
        /// The middle.
        mean: Duration,
        /// J: half of the width.
        half_width: Duration,
    },
    /// Normal.
    Normal {
        /// The mean before the cut at zero.
        mean: Duration,
        /// J: the standard deviation before the cut at zero.
        sigma: Duration,
    },
}

impl Default for Delay {
    fn default() -> Self {
        Self::Constant {
            delay: Duration::ZERO,
        }
    }
}

impl Delay {
    /// The delay that a share `p` of all packets does not exceed, `p` in [0, 1).
    #[must_use]
    pub fn quantile(&self, p: f64) -> Duration {
        let (mean, jitter) = self.parts();
        let (mean, jitter) = (mean.as_nanos() as f64, jitter.as_nanos() as f64);
        let nanos = match self {
            Self::Constant { .. } => mean,
            Self::Uniform { .. } => mean + jitter * (2.0 * p - 1.0),
            Self::Normal { .. } => mean + jitter * quantile::standard_normal(p),
        };
        // The cast saturates, and takes what is below zero to zero.
        Duration::from_nanos((nanos + 0.5) as u64)
    }

    /// The delay (its middle) and the jitter J.
    #[must_use]
    pub fn parts(&self) -> (Duration, Duration) {
        match *self {
            Self::Constant { delay } => (delay, Duration::ZERO),
            Self::Uniform { mean, half_width } => (mean, half_width),
            Self::Normal { mean, sigma } => (mean, sigma),
        }
    }

    fn longest(&self) -> Duration {
        let (mean, jitter) = self.parts();
        mean.saturating_add(jitter)
    }
}

/// Whether jitter may reorder packets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// No packet leaves before one offered earlier: a packet with a short delay waits for its
    /// predecessor. Most real paths do this; it raises the mean delay.
    #[default]
    Fifo,
    /// Each packet leaves after its own delay, whatever the others do, as in `tc netem`.
    Free,
}

/// How packets are lost on the way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Loss {
    /// None.
    #[default]
    None,
    /// Each packet by itself with the same probability.
    Independent {
        /// The probability that a packet is lost.
        probability: Probability,
    },
}

impl Loss {
    /// The share of packets lost in the long run.
    #[must_use]
    pub fn probability(&self) -> Probability {
        match *self {
            Self::None => Probability::ZERO,
            Self::Independent { probability } => probability,
        }
    }
}

/// A probability between 0 and 1, held in parts per billion so that it prints as it was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Probability(u32);

impl Probability {
    /// Never.
    pub const ZERO: Self = Self(0);
    /// Always.
    pub const ONE: Self = Self(1_000_000_000);

    /// The probability of `parts` in a billion; `None` above one billion.
    #[must_use]
    pub fn from_parts_per_billion(parts: u32) -> Option<Self> {
        (parts <= Self::ONE.0).then_some(Self(parts))
    }

    /// The nearest probability to a percentage; `None` unless it lies in 0 to 100 %.
    #[must_use]
    pub fn from_percent(percent: f64) -> Option<Self> {
        (0.0..=100.0)
            .contains(&percent)
            .then_some(Self((percent * 1e7 + 0.5) as u32))
    }

    /// Parts per billion.
    #[must_use]
    pub fn parts_per_billion(self) -> u32 {
        self.0
    }

    /// The probability as a number from 0 to 1.
    #[must_use]
    pub fn get(self) -> f64 {
        f64::from(self.0) / 1e9
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn uniform_jitter_is_a_half_width_and_normal_jitter_a_standard_deviation() {
        let uniform = Delay::Uniform {
            mean: 50 * MS,
            half_width: 5 * MS,
        };
        assert_eq!(uniform.quantile(0.0), 45 * MS);
        assert_eq!(uniform.quantile(0.5), 50 * MS);
        assert_eq!(uniform.quantile(0.75), Duration::from_micros(52_500));

        let normal = Delay::Normal {
            mean: 50 * MS,
            sigma: 5 * MS,
        };
        assert_eq!(normal.quantile(0.5), 50 * MS);
        let one_sigma = normal.quantile(0.841_344_746_068_542_9).as_nanos();
        assert!(one_sigma.abs_diff(55_000_000) <= 1, "{one_sigma}");
    }

    #[test]
    fn a_delay_is_never_negative() {
        let wide = Delay::Normal {
            mean: MS,
            sigma: 10 * MS,
        };
        assert_eq!(wide.quantile(0.1), Duration::ZERO);
        assert!(wide.quantile(0.9) > MS);
    }

    #[test]
    fn settings_out_of_range_are_refused_with_their_value() {
        let delay = DELAY_MAX + MS;
        let config = LinkConfig {
            delay: Delay::Constant { delay },
            ..LinkConfig::default()
        };
        assert_eq!(config.check(), Err(ConfigError::DelayTooLong { delay }));
        for limit in [0, LIMIT_MAX + 1] {
            let config = LinkConfig {
                limit,
                ..LinkConfig::default()
            };
            assert_eq!(config.check(), Err(ConfigError::LimitOutOfRange { limit }));
        }
        assert_eq!(LinkConfig::default().check(), Ok(()));
    }

    #[test]
    fn a_probability_exists_from_zero_to_one_only() {
        assert_eq!(Probability::from_percent(100.0), Some(Probability::ONE));
        for percent in [-0.1, 100.1, f64::NAN, f64::INFINITY] {
            assert_eq!(Probability::from_percent(percent), None);
        }
        assert_eq!(Probability::from_parts_per_billion(1_000_000_001), None);
    }
}
