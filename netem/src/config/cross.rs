//! Cross traffic: packets of others that share the bottleneck.

use std::time::Duration;

/// The least time between two of its packets on average: a million packets a second.
const GAP_MIN: Duration = Duration::from_micros(1);

/// Packets of others that wait in the same queue: all of one size, coming as a Poisson process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cross {
    /// What comes on average, bits per second, counted without the framing of the rate.
    pub bits_per_second: u64,
    /// The size of each packet, bytes, 1 to 65 535.
    pub bytes: u32,
}

impl Cross {
    /// The mean time from one packet to the next, s.
    pub(crate) fn mean_gap_s(self) -> f64 {
        f64::from(self.bytes) * 8.0 / self.bits_per_second as f64
    }

    pub(crate) fn in_range(&self) -> bool {
        (1..=65_535).contains(&self.bytes)
            && self.bits_per_second > 0
            && self.mean_gap_s() >= GAP_MIN.as_secs_f64()
    }
}
