//! What a link is set to do, checked before a link is made of it.
//!
//! The words in which people write it are in `words.rs`. It holds settings only: no state, no draws.

use std::time::Duration;

use serde::{Deserialize, Serialize};

mod cross;
mod delay;
mod loss;
mod probability;
mod profile;
mod queue;
mod range;
mod slot;
#[cfg(test)]
mod tests;

pub use cross::Cross;
pub use delay::{Correlation, Delay, Order, Reorder, Shape, TAU_MIN};
pub use loss::{BURST_MIN, FourState, GilbertElliott, Loss, Outage, PacketList, TimedBursts};
pub use probability::{Chance, Probability};
pub use queue::{Codel, Framing, Queue, RATE_MAX_BIT_S, Rate, Service};
pub use range::ConfigError;
pub use slot::{Slot, SlotGap};

pub use crate::distribution::DELAY_MAX;
use crate::trace::path::Replay;

/// The most steps of a profile, and the most outages of a link.
pub const STEPS_MAX: usize = 1000;
/// The most links in a chain.
pub const LINKS_MAX: usize = 8;
/// The largest limit in packets.
pub const LIMIT_MAX: u32 = 1_000_000;
/// The largest limit in bytes: 1 TiB.
pub const LIMIT_MAX_BYTES: u64 = 1 << 40;

/// The settings of one direction of a path.
///
/// Reads and prints as `tc netem` words: [`std::str::FromStr`] and [`std::fmt::Display`] are inverses,
/// but for settings that name a file ([`crate::words::parse`]). The default passes everything at once.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct LinkConfig {
    /// Propagation delay with its jitter.
    pub delay: Delay,
    /// How the jitter of one packet hangs together with that of the next.
    pub correlation: Correlation,
    /// Whether jitter may reorder packets.
    pub order: Order,
    /// Packets that overtake on purpose.
    pub reorder: Option<Reorder>,
    /// Times at which packets leave in batches.
    pub slot: Option<Slot>,
    /// Loss on the way.
    pub loss: Loss,
    /// What `loss` or `CoDel` would drop is marked instead if its sender understands that
    /// ([`crate::Packet::ecn_capable`]).
    pub ecn: bool,
    /// Times at which everything is lost, at most [`STEPS_MAX`].
    pub outages: Vec<Outage>,
    /// Packets of which a second one leaves.
    pub duplicate: Chance,
    /// Packets of which one bit is turned over.
    pub corrupt: Chance,
    /// The largest packet that passes, bytes.
    pub mtu: Option<u32>,
    /// How fast the bottleneck sends; none: infinitely fast.
    pub rate: Option<Rate>,
    /// What may wait before the bottleneck; without a rate nothing ever waits.
    pub queue: Queue,
    /// Packets of others before the same bottleneck.
    pub cross: Option<Cross>,
    /// What may be in flight; one packet more is dropped ([`crate::DropCause::Limit`]).
    pub limit: Limit,
    /// A recorded path that stands in the place of `delay` and `loss`.
    pub replay: Option<Replay>,
    /// The seed of this link's draws, in the place of the one that the link is made with.
    pub seed: Option<u64>,
    /// What changes as time goes by.
    pub profile: Profile,
    /// The link behind this one.
    pub then: Option<Box<LinkConfig>>,
}

/// What may be in flight on a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// Packets, 1 to [`LIMIT_MAX`].
    pub packets: u32,
    /// Bytes in them, 1 to [`LIMIT_MAX_BYTES`].
    pub bytes: u64,
}

impl Default for Limit {
    /// 10 s at 1 kHz, 15 MB of full-sized packets (`tc` has 1000, which is 1 s at 1 kHz and drops silently beyond
    /// it); and 64 MiB, whatever the sizes.
    fn default() -> Self {
        Self {
            packets: 10_000,
            bytes: 64 << 20,
        }
    }
}

/// What changes as time goes by, counted from the start of the link.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Profile {
    /// The changes in ascending order of time, at most [`STEPS_MAX`].
    pub steps: Vec<Step>,
    /// After how long it begins again; none: the last step stays.
    pub repeat: Option<Duration>,
}

/// From a time on the link has these settings, all of them: what a step does not name is not there.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// When.
    pub at: Duration,
    /// How long the way there takes from `at` on: delay, jitter, independent loss and constant rate go
    /// evenly, in 32 parts; everything else changes at its end. Zero: at once.
    pub ramp: Duration,
    /// The settings, without a profile and without a link behind them.
    pub settings: LinkConfig,
}

impl LinkConfig {
    /// Whether this link passes every packet at once, unchanged: there is nothing to emulate.
    ///
    /// The limit counts packets in flight; without delay there are none.
    #[must_use]
    pub fn is_transparent(&self) -> bool {
        self.links().all(Self::is_transparent_itself)
    }

    /// Whether a packet is no larger than the MTU.
    pub(crate) fn fits(&self, bytes: usize) -> bool {
        self.mtu.is_none_or(|mtu| bytes <= mtu as usize)
    }

    /// The links of the chain that begins here, in order; mostly one.
    pub fn links(&self) -> impl Iterator<Item = &Self> {
        std::iter::successors(Some(self), |link| link.then.as_deref())
    }

    /// Whether others send through this link, the first of its chain, at any time.
    pub(crate) fn has_cross_traffic(&self) -> bool {
        let steps = &mut self.profile.steps.iter();
        self.cross.is_some() || steps.any(|step| step.settings.cross.is_some())
    }

    fn is_transparent_itself(&self) -> bool {
        self.delay.is_zero()
            && self.slot.is_none()
            && self.loss.never()
            && self.outages.is_empty()
            && self.duplicate.probability == Probability::ZERO
            && self.corrupt.probability == Probability::ZERO
            && self.mtu.is_none()
            && self.rate.is_none()
            && self.replay.is_none()
            && self.profile.steps.is_empty()
    }

    /// How far apart the shortest and the longest delay are: all of it for a bounded jitter, 99 % of it
    /// for one with tails. What a play-out buffer has to take. The queue's wait is not in it.
    #[must_use]
    pub fn jitter_span(&self) -> Duration {
        self.links().map(Self::own_jitter_span).sum()
    }

    fn own_jitter_span(&self) -> Duration {
        let own = match &self.replay {
            Some(replay) => replay.path.span(),
            None => self.delay.span(),
        };
        let turn = self.slot.as_ref().map_or(Duration::ZERO, |s| s.gap(0.995));
        let own = own.saturating_add(turn);
        let later = self.profile.steps.iter();
        later
            .map(|step| step.settings.own_jitter_span())
            .fold(own, Duration::max)
    }
}
