//! The way after the bottleneck: propagation with jitter, order, slots.

use std::time::Duration;

use mmt_shared::time::duration_nanos;

use super::chances::Way;
use super::correlated::InTime;
use super::slots::Slots;
use super::streams::substream;
use crate::config::{Correlation, LinkConfig, Order};
use crate::direction::LinkId;

/// The state of these stages. Times are counted from the origin of the link.
#[derive(Clone, Debug)]
pub(super) struct Propagation {
    jitter_in_time: InTime,
    slots: Slots,
    /// The latest departure so far.
    latest: Duration,
}

impl Propagation {
    pub(super) fn new(seed: u64, id: LinkId) -> Self {
        let stream = |up, down| substream(id, seed, up, down);
        Self {
            jitter_in_time: InTime::new(stream("netem/up/jitter", "netem/down/jitter")),
            slots: Slots::new(stream("netem/up/slot", "netem/down/slot")),
            latest: Duration::ZERO,
        }
    }

    /// When a packet of so many bytes leaves the link that left the bottleneck at `sent`. `replayed`: the
    /// delay of the recorded path that it met at its offer.
    pub(super) fn leave(
        &mut self,
        config: &LinkConfig,
        sent: Duration,
        bytes: usize,
        replayed: Option<Duration>,
        way: Way,
    ) -> Duration {
        let leaves = match replayed {
            Some(delay) => self.in_order(config.order, sent.saturating_add(delay)),
            None if way.overtakes => sent,
            None => {
                let share = match config.correlation {
                    Correlation::InTime(tau) => self.jitter_in_time.uniform(tau, sent),
                    Correlation::None | Correlation::PerPacket(_) => way.share,
                };
                let own = sent.saturating_add(config.delay.quantile(share));
                self.in_order(config.order, own)
            }
        };
        match &config.slot {
            Some(slot) => self.slots.leave(slot, leaves, bytes),
            None => leaves,
        }
    }

    /// Before when nothing leaves that comes from `now` on.
    pub(super) fn earliest(&self, config: &LinkConfig, now: Duration) -> Duration {
        if config.reorder.is_some() {
            return now;
        }
        let own = match config.replay {
            Some(_) => now,
            None => now.saturating_add(config.delay.least()),
        };
        match config.order {
            Order::Fifo => self.latest.max(own),
            Order::Free => own,
        }
    }

    fn in_order(&mut self, order: Order, own: Duration) -> Duration {
        // the clock of the drivers ends where nanoseconds no longer fit
        let own = Duration::from_nanos(duration_nanos(own));
        self.latest = self.latest.max(own);
        match order {
            Order::Fifo => self.latest,
            Order::Free => own,
        }
    }
}
