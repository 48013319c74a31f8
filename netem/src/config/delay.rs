//! The settings of propagation: delay distribution, correlation, order.

use std::sync::Arc;
use std::time::Duration;

use mmt_shared::time::duration_nanos;

use super::Probability;
use crate::distribution::{Cdf, Table, gamma, lognormal, pareto, pareto_normal};
use crate::quantile;

/// The shortest time constant of jitter: below it, neighbouring packets of 1 kHz are independent.
pub const TAU_MIN: Duration = Duration::from_millis(1);

/// The distribution of the propagation delay. Every distribution is cut at zero: what would leave
/// before it came leaves at once, so a jitter near the delay raises the mean.
#[derive(Clone, Debug, PartialEq)]
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
    /// Pareto of exponent 3 as in iproute2's table: mean + J (4/3) ((1 - u)^(-1/3) - 3/2), cut at
    /// mean + 4 J as that table is.
    Pareto {
        /// The mean before the cuts.
        mean: Duration,
        /// J: the scale; the standard deviation before the cuts is 1.15 J.
        scale: Duration,
    },
    /// A quarter normal, three quarters Pareto, as in iproute2's table.
    ParetoNormal {
        /// The mean before the cuts.
        mean: Duration,
        /// J: the scale.
        scale: Duration,
    },
    /// Log-normal from zero on.
    LogNormal {
        /// The mean.
        mean: Duration,
        /// J: the standard deviation.
        sigma: Duration,
    },
    /// Gamma from zero on: log-normal's lighter tail.
    Gamma {
        /// The mean.
        mean: Duration,
        /// J: the standard deviation.
        sigma: Duration,
    },
    /// Drawn from a table of iproute2's kind: mean + J x / 8192.
    Table {
        /// The delay at x = 0.
        mean: Duration,
        /// J: the delay added at x = 8192.
        scale: Duration,
        /// The table.
        table: Arc<Table>,
    },
    /// Drawn from a measured distribution.
    Empirical(Arc<Cdf>),
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
            Self::Pareto { .. } => mean + jitter * pareto(p),
            Self::ParetoNormal { .. } => mean + jitter * pareto_normal(p),
            Self::LogNormal { .. } => lognormal(mean, jitter, p),
            Self::Gamma { .. } => gamma(mean, jitter, p),
            Self::Table { table, .. } => mean + jitter * table.quantile(p),
            Self::Empirical(cdf) => cdf.quantile_nanos(p),
        };
        // The cast saturates, and takes what is below zero to zero.
        Duration::from_nanos((nanos + 0.5) as u64)
    }

    /// The delay (its middle) and the jitter J; of a measured distribution its median and zero.
    #[must_use]
    pub fn parts(&self) -> (Duration, Duration) {
        match self {
            Self::Constant { delay } => (*delay, Duration::ZERO),
            Self::Uniform { mean, half_width } => (*mean, *half_width),
            Self::Normal { mean, sigma }
            | Self::LogNormal { mean, sigma }
            | Self::Gamma { mean, sigma } => (*mean, *sigma),
            Self::Pareto { mean, scale }
            | Self::ParetoNormal { mean, scale }
            | Self::Table { mean, scale, .. } => (*mean, *scale),
            Self::Empirical(cdf) => {
                let median = cdf.quantile_nanos(0.5);
                (Duration::from_nanos(median as u64), Duration::ZERO)
            }
        }
    }

    pub(super) fn is_zero(&self) -> bool {
        let (mean, jitter) = self.parts();
        match self {
            Self::Empirical(_) => self.quantile(1.0) == Duration::ZERO,
            _ => mean.saturating_add(jitter) == Duration::ZERO,
        }
    }

    pub(super) fn span(&self) -> Duration {
        match self {
            Self::Uniform { half_width, .. } => half_width.saturating_mul(2),
            // 99 % of a normal is within 2.58 sigma either way
            Self::Normal { sigma, .. } => sigma.saturating_mul(5),
            _ => self.quantile(0.995).saturating_sub(self.quantile(0.005)),
        }
    }

    /// The same distribution with other numbers; `None` if its kind has no mean and jitter to set.
    pub(super) fn with_parts(&self, new_mean: Duration, jitter: Duration) -> Option<Self> {
        let mut changed = self.clone();
        match &mut changed {
            Self::Constant { delay } => *delay = new_mean,
            Self::Uniform { mean, half_width } => (*mean, *half_width) = (new_mean, jitter),
            Self::Normal { mean, sigma }
            | Self::LogNormal { mean, sigma }
            | Self::Gamma { mean, sigma } => (*mean, *sigma) = (new_mean, jitter),
            Self::Pareto { mean, scale }
            | Self::ParetoNormal { mean, scale }
            | Self::Table { mean, scale, .. } => (*mean, *scale) = (new_mean, jitter),
            Self::Empirical(_) => return None,
        }
        Some(changed)
    }
}

/// How the jitter of one packet hangs together with that of the next. The distribution of the delays
/// stays what it is: the numbers behind them are Gaussian and correlated (a copula).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Correlation {
    /// Each packet by itself.
    #[default]
    None,
    /// From packet to packet, whatever the time between them.
    PerPacket(Probability),
    /// In time: two packets t apart have exp(-t / tau), [`TAU_MIN`] to 1 h, so two streams of
    /// different rates meet the same delays at the same times.
    InTime(Duration),
}

impl Correlation {
    pub(super) fn in_range(self) -> bool {
        match self {
            Self::InTime(tau) => (TAU_MIN..=super::DELAY_MAX).contains(&tau),
            Self::None | Self::PerPacket(_) => true,
        }
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

/// Packets that skip the propagation delay and so overtake those before them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reorder {
    /// Which of the candidates overtake.
    pub chance: super::Chance,
    /// Every `gap`-th packet since the last that overtook is a candidate; 1: every packet.
    pub gap: u32,
}

/// Between two times, `share` of the way, both in nanoseconds.
pub(super) fn between(from: Duration, to: Duration, share: f64) -> Duration {
    let (from, to) = (duration_nanos(from) as f64, duration_nanos(to) as f64);
    Duration::from_nanos((from + (to - from) * share + 0.5) as u64)
}
