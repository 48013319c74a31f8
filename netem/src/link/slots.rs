//! Slots: when a packet that is ready to leave finds the link's turn. It keeps the order of the offers.

use std::time::Duration;

use mmt_shared::rng::Substream;

use crate::config::Slot;

/// The state of the slots. Times are counted from the origin of the link.
#[derive(Clone, Debug)]
pub(super) struct Slots {
    /// A draw for each slot.
    stream: Substream,
    /// When the slot in use, or the next one, opens.
    opens: Duration,
    packets: u32,
    bytes: u64,
}

impl Slots {
    pub(super) fn new(stream: Substream) -> Self {
        Self {
            stream,
            opens: Duration::ZERO,
            packets: 0,
            bytes: 0,
        }
    }

    /// When a packet leaves that is ready at `ready`; as in the kernel's `netem_dequeue`.
    pub(super) fn leave(&mut self, slot: &Slot, ready: Duration, bytes: usize) -> Duration {
        if self.opens < ready {
            self.open_after(slot, ready);
        }
        let leaves = self.opens;
        self.packets = self.packets.saturating_add(1);
        self.bytes = self.bytes.saturating_add(bytes as u64);
        let full = slot.packets.is_some_and(|most| self.packets >= most)
            || slot.bytes.is_some_and(|most| self.bytes >= most);
        if full {
            self.open_after(slot, leaves);
        }
        leaves
    }

    fn open_after(&mut self, slot: &Slot, time: Duration) {
        self.opens = time.saturating_add(slot.gap(self.stream.uniform()));
        (self.packets, self.bytes) = (0, 0);
    }
}
