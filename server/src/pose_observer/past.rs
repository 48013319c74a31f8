//! What the observer took for true in the last quarter of a second: vision is late.

use mmt_shared::model::geometry::Pose;
use mmt_shared::time::Time;

use super::contact_frame::ContactFrame;

/// Ticks that are kept: 256 ms.
const TICKS: usize = 256;

/// One tick.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Past {
    pub(super) time: Time,
    pub(super) pose: Pose,
    pub(super) contact: Option<ContactFrame>,
}

/// A ring of ticks.
#[derive(Clone, Debug)]
pub(super) struct PastPoses {
    ring: [Past; TICKS],
    next: usize,
}

impl Default for PastPoses {
    fn default() -> Self {
        Self {
            ring: [Past::default(); TICKS],
            next: 0,
        }
    }
}

impl PastPoses {
    pub(super) fn push(&mut self, past: Past) {
        if let Some(slot) = self.ring.get_mut(self.next) {
            *slot = past;
        }
        self.next = (self.next + 1) % TICKS;
    }

    /// The newest that is not later than `time`.
    pub(super) fn at(&self, time: Time) -> Option<Past> {
        // the ring is short and vision is slow: a search is cheap
        self.ring
            .iter()
            .filter(|past| past.time <= time && past.time > Time::ZERO)
            .max_by_key(|past| past.time)
            .copied()
    }
}
