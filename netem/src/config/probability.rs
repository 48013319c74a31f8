//! A probability that prints as it was written, and what happens with one.

/// A probability between 0 and 1, held in parts per billion so that it prints as it was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Probability(u32);

impl Probability {
    /// Never.
    pub const ZERO: Self = Self(0);
    /// Always.
    pub const ONE: Self = Self(1_000_000_000);

    /// The probability of `parts` in a billion; `None` above one billion.
    #[cfg(test)]
    pub(crate) fn from_parts_per_billion(parts: u32) -> Option<Self> {
        (parts <= Self::ONE.0).then_some(Self(parts))
    }

    /// The nearest probability to a percentage; `None` unless it lies in 0 to 100 %.
    #[must_use]
    pub fn from_percent(percent: f64) -> Option<Self> {
        (0.0..=100.0)
            .contains(&percent)
            .then_some(Self((percent * 1e7 + 0.5) as u32))
    }

    /// The probability that it does not happen.
    #[must_use]
    pub fn complement(self) -> Self {
        Self(Self::ONE.0.saturating_sub(self.0))
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

/// An event that befalls packets with a probability, perhaps in runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Chance {
    /// The share of all packets.
    pub probability: Probability,
    /// Correlation of the Gaussian numbers behind neighbouring packets: runs, at the same share.
    pub correlation: Probability,
}
