//! A link in the words that parse back to the very same settings.

use std::fmt;
use std::time::Duration;

use crate::config::{Delay, LIMIT_DEFAULT, LinkConfig, Loss, Order, Probability};

impl From<LinkConfig> for String {
    fn from(config: LinkConfig) -> Self {
        config.to_string()
    }
}

impl fmt::Display for LinkConfig {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut sentences = Vec::new();
        if self.delay != Delay::default() {
            sentences.push(self.delay.to_string());
        }
        if let Loss::Independent { probability } = self.loss {
            sentences.push(format!("loss {probability}"));
        }
        if self.order == Order::Free {
            sentences.push("order free".to_owned());
        }
        if self.limit != LIMIT_DEFAULT {
            sentences.push(format!("limit {}", self.limit));
        }
        match sentences.is_empty() {
            true => f.write_str("none"),
            false => f.write_str(&sentences.join(" ")),
        }
    }
}

impl fmt::Display for Delay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (mean, jitter) = self.parts();
        write!(f, "delay {}", Exact(mean))?;
        match self {
            Self::Constant { .. } => Ok(()),
            Self::Uniform { .. } => write!(f, " {}", Exact(jitter)),
            Self::Normal { .. } => write!(f, " {} distribution normal", Exact(jitter)),
        }
    }
}

/// A percentage without rounding and without idle zeros.
impl fmt::Display for Probability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const PER_PERCENT: u32 = 10_000_000;
        let parts = self.parts_per_billion();
        let decimals = format!("{:07}", parts % PER_PERCENT);
        match decimals.trim_end_matches('0') {
            "" => write!(f, "{}%", parts / PER_PERCENT),
            decimals => write!(f, "{}.{decimals}%", parts / PER_PERCENT),
        }
    }
}

/// A time as a whole number of the largest unit that holds it exactly.
struct Exact(Duration);

impl fmt::Display for Exact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nanos = self.0.as_nanos();
        let units = [(1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "us")];
        let whole = units
            .iter()
            .find(|(size, _)| nanos > 0 && nanos.is_multiple_of(*size));
        let (size, unit) = whole.copied().unwrap_or((1, "ns"));
        write!(f, "{}{unit}", nanos / size)
    }
}
