//! How late samples are: what the play-out delay has to be for 99 of 100 of them to be in time.
//!
//! A sample's lateness is its transit less the quickest of the last seconds: jitter, and the time that it
//! waited for its packet to be full. It must never make the delay jump: who uses the quantile slews to it.

use std::time::Duration;

use mmt_shared::stats::recent::Recent;
use mmt_shared::time::{Time, duration_nanos};

/// Width of a bin, ns.
const BIN_NS: u64 = 1_000_000;
/// Bins; the last takes all that is later.
const BINS: usize = 256;
/// The window, seconds: it forgets a spell of jitter after five.
const WINDOW_S: usize = 5;
/// Samples from which on there is a quantile: half a second of them.
const SAMPLES_MIN: u32 = 500;
/// One sample in this many may be too late.
const LATE_ONE_IN: u32 = 100;

/// Histogram of lateness over the last seconds.
#[derive(Clone, Debug)]
pub(super) struct Lateness(Recent<[u32; BINS], WINDOW_S>);

impl Lateness {
    pub(super) fn new() -> Self {
        Self(Recent::new([0; BINS]))
    }

    /// Takes one sample that came `late` after the quickest would have, at `now`.
    pub(super) fn observe(&mut self, now: Time, late: Duration) {
        let bin = usize::try_from(duration_nanos(late) / BIN_NS).unwrap_or(BINS - 1);
        let slice = self.0.at(now);
        if let Some(count) = slice.and_then(|slice| slice.get_mut(bin.min(BINS - 1))) {
            *count = count.saturating_add(1);
        }
    }

    /// The lateness that 99 of 100 samples did not exceed, rounded up to whole bins; none before there
    /// have been enough of them.
    pub(super) fn p99(&self) -> Option<Duration> {
        let in_bin = |bin: usize| -> u32 { self.0.iter().filter_map(|s| s.get(bin)).sum() };
        let total: u32 = (0..BINS).map(in_bin).sum();
        if total < SAMPLES_MIN {
            return None;
        }
        let mut later = total;
        for bin in 0..BINS {
            later -= in_bin(bin);
            if later <= total / LATE_ONE_IN {
                return Some(Duration::from_nanos((bin as u64 + 1) * BIN_NS));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quantile_leaves_one_in_a_hundred_out_and_forgets() {
        let mut lateness = Lateness::new();
        let at = Time::from_millis;
        for n in 0..1000 {
            assert_eq!(lateness.p99().is_some(), n >= 500);
            // ten in a thousand are 40 ms late, the others up to 9.5 ms
            let late = if n % 100 == 0 { 40_000 } else { n % 20 * 500 };
            lateness.observe(at(n), Duration::from_micros(late));
        }
        assert_eq!(lateness.p99(), Some(Duration::from_millis(10)));
        lateness.observe(at(1000), Duration::from_millis(40));
        assert_eq!(lateness.p99(), Some(Duration::from_millis(41)));
        for n in 1001..=1010 {
            lateness.observe(at(n), Duration::from_secs(9));
        }
        assert_eq!(lateness.p99(), Some(Duration::from_millis(41)));
        for n in 6000..6999 {
            lateness.observe(at(n), Duration::ZERO);
        }
        assert_eq!(lateness.p99(), Some(Duration::from_millis(1)));
    }
}
