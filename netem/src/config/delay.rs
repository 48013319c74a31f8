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
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Delay {
    /// The mean before the cut at zero; of a table the delay at x = 0. A measured distribution has its own.
    pub mean: Duration,
    /// J, what the shape makes of it.
    pub jitter: Duration,
    /// The distribution around the mean.
    pub shape: Shape,
}

/// The distribution of a delay around its mean.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Shape {
    /// The same for every packet.
    #[default]
    Constant,
    /// Uniform in mean ± J.
    Uniform,
    /// Normal: J is the standard deviation before the cut at zero.
    Normal,
    /// Pareto of exponent 3 as in iproute2's table: mean + J (4/3) ((1 - u)^(-1/3) - 3/2), cut at
    /// mean + 4 J as that table is. Before the cuts the standard deviation is 1.15 J.
    Pareto,
    /// A quarter normal, three quarters Pareto, as in iproute2's table.
    ParetoNormal,
    /// Log-normal from zero on: J is the standard deviation.
    LogNormal,
    /// Gamma from zero on, log-normal's lighter tail: J is the standard deviation.
    Gamma,
    /// Drawn from a table of iproute2's kind: mean + J x / 8192.
    Table(Arc<Table>),
    /// Drawn from a measured distribution, whatever mean and J.
    Empirical(Arc<Cdf>),
}

impl Delay {
    /// The same for every packet.
    #[must_use]
    pub fn constant(delay: Duration) -> Self {
        Self {
            mean: delay,
            ..Self::default()
        }
    }

    /// Uniform in `mean ± half_width`.
    #[must_use]
    pub fn uniform(mean: Duration, half_width: Duration) -> Self {
        Self {
            mean,
            jitter: half_width,
            shape: Shape::Uniform,
        }
    }

    /// The delay that a share `p` of all packets does not exceed, `p` in [0, 1).
    #[must_use]
    pub fn quantile(&self, p: f64) -> Duration {
        let (mean, jitter) = (self.mean.as_nanos() as f64, self.jitter.as_nanos() as f64);
        let nanos = match &self.shape {
            Shape::Constant => mean,
            Shape::Uniform => mean + jitter * (2.0 * p - 1.0),
            Shape::Normal => mean + jitter * quantile::standard_normal(p),
            Shape::Pareto => mean + jitter * pareto(p),
            Shape::ParetoNormal => mean + jitter * pareto_normal(p),
            Shape::LogNormal => lognormal(mean, jitter, p),
            Shape::Gamma => gamma(mean, jitter, p),
            Shape::Table(table) => mean + jitter * table.quantile(p),
            Shape::Empirical(cdf) => cdf.quantile_nanos(p),
        };
        // The cast saturates, and takes what is below zero to zero.
        Duration::from_nanos((nanos + 0.5) as u64)
    }

    /// What no packet's delay is below; zero where that takes more than a subtraction to know.
    pub(crate) fn least(&self) -> Duration {
        match self.shape {
            Shape::Constant => self.mean,
            Shape::Uniform => self.mean.saturating_sub(self.jitter),
            _ => Duration::ZERO,
        }
    }

    /// The mean, or the median of a measured distribution.
    #[must_use]
    pub fn middle(&self) -> Duration {
        match &self.shape {
            Shape::Empirical(cdf) => Duration::from_nanos(cdf.quantile_nanos(0.5) as u64),
            _ => self.mean,
        }
    }

    pub(super) fn is_zero(&self) -> bool {
        match self.shape {
            Shape::Empirical(_) => self.quantile(1.0) == Duration::ZERO,
            _ => self.mean.saturating_add(self.jitter) == Duration::ZERO,
        }
    }

    pub(super) fn span(&self) -> Duration {
        match self.shape {
            Shape::Uniform => self.jitter.saturating_mul(2),
            // 99 % of a normal is within 2.58 sigma either way
            Shape::Normal => self.jitter.saturating_mul(5),
            _ => self.quantile(0.995).saturating_sub(self.quantile(0.005)),
        }
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
