//! The way after the bottleneck: propagation with jitter, order, slots.

use std::time::Duration;

use mmt_shared::time::duration_nanos;

use super::correlated::{ByPacket, InTime};
use super::slots::Slots;
use super::streams::{Draws, substream};
use crate::config::{Correlation, LinkConfig, Order, Reorder};
use crate::direction::LinkId;

/// What is decided about the way of a packet at its offer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    /// The share of all delays that the packet's delay is not below, unless jitter lives in time.
    pub(super) share: f64,
    /// Whether it skips the delay.
    pub(super) overtakes: bool,
}

/// The state of these stages. Times are counted from the origin of the link.
#[derive(Clone, Debug)]
pub(super) struct Propagation {
    jitter: ByPacket,
    jitter_in_time: InTime,
    reordering: ByPacket,
    since_overtaking: u32,
    slots: Slots,
    /// The latest departure so far.
    latest: Duration,
}

impl Propagation {
    pub(super) fn new(seed: u64, id: LinkId) -> Self {
        let stream = |up, down| substream(id, seed, up, down);
        Self {
            jitter: ByPacket::default(),
            jitter_in_time: InTime::new(stream("netem/up/jitter", "netem/down/jitter")),
            reordering: ByPacket::default(),
            since_overtaking: 0,
            slots: Slots::new(stream("netem/up/slot", "netem/down/slot")),
            latest: Duration::ZERO,
        }
    }

    /// What is decided about the way of a packet at its offer, for every packet offered.
    pub(super) fn draw(&mut self, config: &LinkConfig, draws: &Draws) -> Way {
        let overtakes = config.reorder.as_ref();
        let overtakes = overtakes.is_some_and(|reorder| self.overtakes(reorder, draws.reorder));
        let share = match config.correlation {
            Correlation::PerPacket(rho) => self.jitter.uniform(rho.get(), draws.delay),
            Correlation::None | Correlation::InTime(_) => draws.delay,
        };
        Way { share, overtakes }
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

    /// As in the kernel: candidates are counted from the last packet that overtook.
    fn overtakes(&mut self, reorder: &Reorder, draw: f64) -> bool {
        let chosen = self.reordering.happens(reorder.chance, draw);
        let candidate = self.since_overtaking >= reorder.gap.saturating_sub(1);
        if chosen && candidate {
            self.since_overtaking = 0;
            return true;
        }
        self.since_overtaking = self.since_overtaking.saturating_add(1);
        false
    }
}
