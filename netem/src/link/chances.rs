//! What chance does to a packet that comes to a link: loss, copies, corruption, its way.

use std::time::Duration;

use mmt_shared::rng::Substream;

use super::correlated::ByPacket;
use super::loss_model::LossModel;
use super::streams::Draws;
use crate::config::{Correlation, LinkConfig, Reorder};

/// The states of all that goes by packet.
#[derive(Clone, Debug)]
pub(super) struct Chances {
    loss: LossModel,
    duplicating: ByPacket,
    corrupting: ByPacket,
    jitter: ByPacket,
    reordering: ByPacket,
    since_overtaking: u32,
}

/// A packet that comes to a link, as far as chance has to know it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coming {
    pub(super) number: u64,
    pub(super) bytes: usize,
    pub(super) ecn_capable: bool,
}

/// What chance does to a packet, or to its copy.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lot {
    pub(super) lost: bool,
    pub(super) marked: bool,
    pub(super) corrupted_bit: Option<u64>,
    pub(super) way: Way,
}

/// What is decided about the way of a packet when it comes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    /// The share of all delays that the packet's delay is not below, unless jitter lives in time.
    pub(super) share: f64,
    /// Whether it skips the delay.
    pub(super) overtakes: bool,
}

impl Chances {
    pub(super) fn new(bursts: Substream) -> Self {
        Self {
            loss: LossModel::new(bursts),
            duplicating: ByPacket::default(),
            corrupting: ByPacket::default(),
            jitter: ByPacket::default(),
            reordering: ByPacket::default(),
            since_overtaking: 0,
        }
    }

    /// What chance does to a packet that comes, and to its copy if it gets one. Every effect draws for every
    /// packet, whatever becomes of it, so that no effect moves the draws of another.
    pub(super) fn draw(
        &mut self,
        settings: &LinkConfig,
        now: Duration,
        packet: Coming,
        draws: &Draws,
    ) -> (Lot, Option<Lot>) {
        let bytes = packet.bytes;
        let marks = settings.ecn && packet.ecn_capable;
        let loss = self.loss.draw(&settings.loss, packet.number, now, draws);
        let way = self.way(settings, draws);
        let hit = loss.is_lost();
        let bit = |draw: f64| (draw * bytes as f64 * 8.0) as u64;
        let corrupt = self.corrupting.happens(settings.corrupt, draws.corrupt) && bytes > 0;
        let mut lot = Lot {
            lost: hit && !marks,
            marked: hit && marks,
            corrupted_bit: corrupt.then(|| bit(draws.corrupted_bit)),
            way,
        };
        let doubled = self
            .duplicating
            .happens(settings.duplicate, draws.duplicate);
        if !doubled || !settings.fits(bytes) {
            return (lot, None);
        }
        let hit = draws.copy_loss < loss.probability;
        let corrupt = draws.copy_corrupt < settings.corrupt.probability.get() && bytes > 0;
        let copy = Lot {
            // as in tc, a packet that is both lost and copied passes once
            lost: lot.lost || hit && !marks,
            marked: lot.marked || hit && marks,
            corrupted_bit: corrupt.then(|| bit(draws.copy_bit)),
            way: Way {
                share: draws.copy_delay,
                ..way
            },
        };
        lot.lost = false;
        (lot, Some(copy))
    }

    fn way(&mut self, settings: &LinkConfig, draws: &Draws) -> Way {
        let overtakes = settings.reorder.as_ref();
        let overtakes = overtakes.is_some_and(|reorder| self.overtakes(reorder, draws.reorder));
        let share = match settings.correlation {
            Correlation::PerPacket(rho) => self.jitter.uniform(rho.get(), draws.delay),
            Correlation::None | Correlation::InTime(_) => draws.delay,
        };
        Way { share, overtakes }
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
