//! What a link is set to do, checked before a link is made of it.
//!
//! The words in which people write it are in `words.rs`. It holds settings only: no state, no draws.

use std::time::Duration;

use serde::{Deserialize, Serialize};

mod delay;
mod loss;
mod probability;
mod profile;
mod queue;
mod range;
mod slot;
#[cfg(test)]
mod tests;

pub use delay::{Correlation, Delay, Order, Reorder, TAU_MIN};
pub use loss::{BURST_MIN, FourState, GilbertElliott, Loss, Outage, PacketList, TimedBursts};
pub use probability::Probability;
pub use profile::{Profile, STEPS_MAX, Step};
pub use queue::{Codel, Framing, Queue, RATE_MAX_BIT_S, Rate, Service};
pub use range::ConfigError;
pub use slot::{Slot, SlotGap};

use crate::trace::path::Replay;

/// The longest delay or jitter, 1 h: beyond any path on Earth, and far from overflow in nanoseconds.
pub const DELAY_MAX: Duration = Duration::from_secs(3600);
/// The default limit, packets in flight: 10 s at 1 kHz, 15 MB of full-sized packets. `tc` has 1000,
/// which is 1 s at 1 kHz and drops silently beyond it.
pub const LIMIT_DEFAULT: u32 = 10_000;
/// The largest limit, packets in flight: 1.5 GB of full-sized packets.
pub const LIMIT_MAX: u32 = 1_000_000;

/// The settings of one direction of a path.
///
/// Reads and prints as `tc netem` words: [`std::str::FromStr`] and [`std::fmt::Display`] are inverses,
/// but for settings that name a file ([`crate::words::parse`]). The default passes everything at once.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// ([`crate::PacketMeta::ecn_capable`]).
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
    /// Packets in flight at most, 1 to [`LIMIT_MAX`]; one more is dropped ([`crate::DropCause::Limit`]).
    pub limit: u32,
    /// A recorded path that stands in the place of `delay` and `loss`.
    pub replay: Option<Replay>,
    /// The seed of this link's draws, in the place of the one that the link is made with.
    pub seed: Option<u64>,
    /// What changes as time goes by.
    pub profile: Profile,
}

/// An event that befalls packets with a probability, perhaps in runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Chance {
    /// The share of all packets.
    pub probability: Probability,
    /// Correlation of the Gaussian numbers behind neighbouring packets: runs, at the same share.
    pub correlation: Probability,
}

impl Default for LinkConfig {
    fn default() -> Self {
        Self {
            delay: Delay::default(),
            correlation: Correlation::default(),
            order: Order::default(),
            reorder: None,
            slot: None,
            loss: Loss::default(),
            ecn: false,
            outages: Vec::new(),
            duplicate: Chance::default(),
            corrupt: Chance::default(),
            mtu: None,
            rate: None,
            queue: Queue::default(),
            limit: LIMIT_DEFAULT,
            replay: None,
            seed: None,
            profile: Profile::default(),
        }
    }
}

impl LinkConfig {
    /// Whether this link passes every packet at once, unchanged: there is nothing to emulate.
    ///
    /// The limit counts packets in flight; without delay there are none.
    #[must_use]
    pub fn is_transparent(&self) -> bool {
        self.delay.is_zero()
            && self.slot.is_none()
            && self.loss.never()
            && self.outages.is_empty()
            && self.duplicate.probability == Probability::ZERO
            && self.corrupt.probability == Probability::ZERO
            && self.mtu.is_none()
            && self.rate.is_none()
            && self.replay.is_none()
            && self.profile.is_empty()
    }

    /// How far apart the shortest and the longest delay are: all of it for a bounded jitter, 99 % of it
    /// for one with tails. What a play-out buffer has to take. The queue's wait is not in it.
    #[must_use]
    pub fn jitter_span(&self) -> Duration {
        let own = match &self.replay {
            Some(replay) => replay.path.span(),
            None => self.delay.span(),
        };
        let turn = self.slot.as_ref().map_or(Duration::ZERO, |s| s.gap(0.995));
        let own = own.saturating_add(turn);
        let later = self.profile.steps.iter();
        later
            .map(|step| step.settings.jitter_span())
            .fold(own, Duration::max)
    }
}
