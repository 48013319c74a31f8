//! The settings of slots: times at which a link lets packets go in batches. It holds settings only.

use std::time::Duration;

use super::delay::between;
use super::{DELAY_MAX, Delay};

/// Packets leave at certain times only, as many as a slot takes (`slot` of `tc netem`): a radio or a cable
/// modem that gets its turn. A slot opens one gap after the one before was used up, or one gap after the
/// packet that finds none open.
#[derive(Clone, Debug, PartialEq)]
pub struct Slot {
    /// The time from slot to slot.
    pub gap: SlotGap,
    /// Packets that leave in one slot at most, at least 1.
    pub packets: Option<u32>,
    /// Bytes after which a slot is used up, at least 1.
    pub bytes: Option<u64>,
}

/// The time from slot to slot.
#[derive(Clone, Debug, PartialEq)]
pub enum SlotGap {
    /// Uniform between two times.
    Uniform {
        /// The shortest.
        least: Duration,
        /// The longest.
        most: Duration,
    },
    /// Drawn from a distribution.
    Drawn(Delay),
}

impl Slot {
    /// The gap that a share `p` of the gaps does not exceed, `p` in [0, 1).
    #[must_use]
    pub fn gap(&self, p: f64) -> Duration {
        match &self.gap {
            SlotGap::Uniform { least, most } => between(*least, *most, p),
            SlotGap::Drawn(gap) => gap.quantile(p),
        }
    }

    pub(super) fn in_range(&self) -> bool {
        let times = match &self.gap {
            SlotGap::Uniform { least, most } => least <= most && *most <= DELAY_MAX,
            SlotGap::Drawn(gap) => gap.mean.max(gap.jitter) <= DELAY_MAX,
        };
        times && self.packets != Some(0) && self.bytes != Some(0)
    }
}
