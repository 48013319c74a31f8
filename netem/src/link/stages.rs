//! The way of one packet through the stages of a link.

use std::time::Duration;

use mmt_shared::time::duration_nanos;

use super::bottleneck::Bottleneck;
use super::correlated::{ByPacket, InTime};
use super::losing::{Losing, Verdict};
use super::slots::Slots;
use super::streams::{Draws, substream};
use crate::config::{Correlation, LinkConfig, Order, Reorder};
use crate::direction::LinkId;
use crate::fate::DropCause;

/// What the stages know about the packet. Times are counted from the origin of the link.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passing {
    pub(super) number: u64,
    pub(super) elapsed: Duration,
    pub(super) bytes: usize,
    pub(super) in_flight: usize,
    pub(super) ecn_capable: bool,
}

/// The states of the stages.
#[derive(Clone, Debug)]
pub(super) struct Stages {
    losing: Losing,
    duplicating: ByPacket,
    corrupting: ByPacket,
    bottleneck: Bottleneck,
    jitter: ByPacket,
    jitter_in_time: InTime,
    reordering: ByPacket,
    since_overtaking: u32,
    slots: Slots,
    /// The latest departure promised so far.
    latest: Duration,
}

/// When a packet leaves, counted from the origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Departure {
    pub(super) after: Duration,
    pub(super) corrupted_bit: Option<u64>,
    pub(super) marked: bool,
}

type Outcome = Result<Departure, DropCause>;

impl Stages {
    pub(super) fn new(seed: u64, id: LinkId) -> Self {
        let stream = |up, down| substream(id, seed, up, down);
        Self {
            losing: Losing::new(stream("netem/up/burst", "netem/down/burst")),
            duplicating: ByPacket::default(),
            corrupting: ByPacket::default(),
            bottleneck: Bottleneck::default(),
            jitter: ByPacket::default(),
            jitter_in_time: InTime::new(stream("netem/up/jitter", "netem/down/jitter")),
            reordering: ByPacket::default(),
            since_overtaking: 0,
            slots: Slots::new(stream("netem/up/slot", "netem/down/slot")),
            latest: Duration::ZERO,
        }
    }

    /// Makes room for these settings.
    pub(super) fn prepare<'a>(&mut self, settings: impl Iterator<Item = &'a LinkConfig>) {
        self.bottleneck.prepare(settings);
    }

    pub(super) fn backlog(&self) -> usize {
        self.bottleneck.backlog()
    }

    /// What becomes of a packet and, if there is one, of its copy.
    pub(super) fn pass(
        &mut self,
        config: &LinkConfig,
        packet: Passing,
        draws: &Draws,
    ) -> (Outcome, Option<Outcome>) {
        if config.mtu.is_some_and(|mtu| packet.bytes > mtu as usize) {
            return (Err(DropCause::Mtu), None);
        }
        let doubled = self.duplicating.happens(config.duplicate, draws.duplicate);
        let verdict = self
            .losing
            .judge(&config.loss, packet.number, packet.elapsed, draws);
        let itself = self.carry(config, packet, verdict, draws);
        let copy = doubled.then(|| {
            let in_flight = packet.in_flight.saturating_add(usize::from(itself.is_ok()));
            let verdict = Verdict {
                draw: draws.copy_loss,
                ..verdict
            };
            let draws = Draws {
                delay: draws.copy_delay,
                ..*draws
            };
            self.carry(
                config,
                Passing {
                    in_flight,
                    ..packet
                },
                verdict,
                &draws,
            )
        });
        (itself, copy)
    }

    fn carry(
        &mut self,
        config: &LinkConfig,
        packet: Passing,
        verdict: Verdict,
        draws: &Draws,
    ) -> Outcome {
        let replayed = config
            .replay
            .as_ref()
            .map(|replay| replay.path.at(packet.elapsed));
        let out = |outage: &crate::config::Outage| outage.covers(packet.elapsed);
        if config.outages.iter().any(out) {
            return Err(DropCause::Outage);
        }
        let (hit, spared) = (
            verdict.draw < verdict.probability,
            config.ecn && packet.ecn_capable,
        );
        if (hit && !spared) || replayed == Some(None) {
            return Err(DropCause::Loss);
        }
        if packet.in_flight >= config.limit as usize {
            return Err(DropCause::Limit);
        }
        let corrupt = self.corrupting.happens(config.corrupt, draws.corrupt) && packet.bytes > 0;
        let corrupted_bit =
            corrupt.then_some((draws.corrupted_bit * packet.bytes as f64 * 8.0) as u64);
        let (sent, queue_marks) = match &config.rate {
            None => (packet.elapsed, false),
            Some(rate) => {
                let (now, bytes) = (packet.elapsed, packet.bytes);
                self.bottleneck
                    .pass(rate, &config.queue, now, bytes, spared)?
            }
        };
        let after = match replayed.flatten() {
            Some(delay) => self.in_order(config.order, sent.saturating_add(delay)),
            None => self.propagate(config, sent, draws),
        };
        let after = match &config.slot {
            Some(slot) => self.slots.leave(slot, after, packet.bytes),
            None => after,
        };
        Ok(Departure {
            after,
            corrupted_bit,
            marked: hit || queue_marks,
        })
    }

    /// When a packet arrives that went on its way at `sent`.
    fn propagate(&mut self, config: &LinkConfig, sent: Duration, draws: &Draws) -> Duration {
        if let Some(reorder) = &config.reorder
            && self.overtakes(reorder, draws.reorder)
        {
            return sent;
        }
        let share = match config.correlation {
            Correlation::None => draws.delay,
            Correlation::PerPacket(rho) => self.jitter.uniform(rho.get(), draws.delay),
            Correlation::InTime(tau) => self.jitter_in_time.uniform(tau, sent),
        };
        let own = sent.saturating_add(config.delay.quantile(share));
        self.in_order(config.order, own)
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
