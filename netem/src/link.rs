//! One direction of an emulated path, as a pure state machine.
//!
//! A packet is offered with the time of its arrival, and its fate is known at once: a drop with its
//! cause, or the times at which it leaves. The order of the stages is that of a real path: loss, limit,
//! propagation with jitter, order. The times are theoretical: whoever releases packets late must not
//! feed its lateness back, so it does not add up.
//!
//! It must never sleep, read a clock, touch a socket or allocate.

use mmt_shared::rng::Substream;
use mmt_shared::time::Time;
use serde::Serialize;

use crate::config::{ConfigError, LinkConfig, Loss, Order};
use crate::counters::LinkCounters;

/// The most deliveries one packet can have: itself and one copy.
pub const DELIVERIES_MAX: usize = 2;

/// Which way packets go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// From master to slave.
    Up,
    /// From slave to master.
    Down,
}

/// Which link this is among those of one seed: two links of one seed draw different numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LinkId {
    /// The number of the path.
    pub path: u64,
    /// The direction on it.
    pub direction: Direction,
}

impl LinkId {
    /// Master to slave on path 0.
    pub const UP: Self = Self::first(Direction::Up);
    /// Slave to master on path 0.
    pub const DOWN: Self = Self::first(Direction::Down);

    /// A direction of path 0.
    #[must_use]
    pub const fn first(direction: Direction) -> Self {
        Self { path: 0, direction }
    }

    /// The substream of one feature of this link.
    fn substream(self, seed: u64, up: &'static str, down: &'static str) -> Substream {
        let name = match self.direction {
            Direction::Up => up,
            Direction::Down => down,
        };
        Substream::new(seed, name, self.path)
    }
}

/// What a link must know about a packet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PacketMeta {
    /// Its length, bytes (UDP payload in the drivers of this crate).
    pub bytes: usize,
    /// Packets offered earlier that have not left yet; whoever holds them counts them.
    pub in_flight: usize,
}

/// What becomes of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It leaves, once or more.
    Deliver(Deliveries),
    /// It never leaves.
    Drop(DropCause),
}

impl Fate {
    /// The time at which the packet itself leaves, if it does.
    #[must_use]
    pub fn due(&self) -> Option<Time> {
        match self {
            Self::Deliver(deliveries) => Some(deliveries.itself().due),
            Self::Drop(_) => None,
        }
    }
}

/// Why a link dropped a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DropCause {
    /// Lost on the way by chance.
    Loss,
    /// As many packets in flight as the limit allows.
    Limit,
}

impl DropCause {
    /// The cause as reports spell it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Loss => "loss",
            Self::Limit => "limit",
        }
    }
}

/// One departure of a packet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Delivery {
    /// The theoretical time of departure, on the clock of the offers.
    pub due: Time,
}

/// The departures of one packet: at least one, at most [`DELIVERIES_MAX`], the packet itself first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Deliveries {
    itself: Delivery,
    copies: [Option<Delivery>; DELIVERIES_MAX - 1],
}

impl Deliveries {
    /// One departure, no copy.
    #[must_use]
    pub fn one(due: Time) -> Self {
        Self {
            itself: Delivery { due },
            copies: [None; DELIVERIES_MAX - 1],
        }
    }

    /// The departure of the packet itself.
    #[must_use]
    pub fn itself(&self) -> Delivery {
        self.itself
    }

    /// The departures of its copies.
    pub fn copies(&self) -> impl Iterator<Item = Delivery> + '_ {
        self.copies.iter().copied().flatten()
    }
}

/// The random substreams of a link, one for each feature.
///
/// Each packet takes one draw from every stream, whatever the settings and whatever its fate, so that
/// the n-th packet meets the same numbers under all settings of one seed.
#[derive(Clone, Debug)]
struct Streams {
    loss: Substream,
    delay: Substream,
}

/// The draws of one packet, uniform in [0, 1).
struct Draws {
    loss: f64,
    delay: f64,
}

impl Streams {
    fn new(seed: u64, id: LinkId) -> Self {
        Self {
            loss: id.substream(seed, "netem/up/loss", "netem/down/loss"),
            delay: id.substream(seed, "netem/up/delay", "netem/down/delay"),
        }
    }

    fn draw(&mut self) -> Draws {
        Draws {
            loss: self.loss.uniform(),
            delay: self.delay.uniform(),
        }
    }
}

/// One direction of an emulated path. A pure function of its settings, its seed and its offers.
#[derive(Clone, Debug)]
pub struct Link {
    config: LinkConfig,
    streams: Streams,
    /// The latest departure promised so far.
    latest_due: Time,
    counters: LinkCounters,
}

impl Link {
    /// A link with these settings. The draws depend on `seed` and `id` alone.
    ///
    /// # Errors
    /// A setting out of its range.
    pub fn try_new(config: LinkConfig, seed: u64, id: LinkId) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self {
            config,
            streams: Streams::new(seed, id),
            latest_due: Time::ZERO,
            counters: LinkCounters::default(),
        })
    }

    /// Decides what becomes of the packet that arrives at `now`.
    ///
    /// `now` is the theoretical time of arrival: for a link behind another one, the time at which the
    /// packet was due to leave that one.
    pub fn offer(&mut self, now: Time, meta: PacketMeta) -> Fate {
        self.counters.offered.count(meta.bytes);
        let draws = self.streams.draw();
        if let Some(cause) = self.drop_cause(&draws, meta) {
            self.counters.dropped.count(cause, meta.bytes);
            return Fate::Drop(cause);
        }
        self.counters.delivered.count(meta.bytes);
        Fate::Deliver(Deliveries::one(self.departure(now, &draws)))
    }

    /// Takes new settings for the packets offered from now on. Packets in flight keep their times, the
    /// counters and the random streams go on, and under [`Order::Fifo`] no packet overtakes an earlier
    /// one, not even one of the old settings.
    ///
    /// # Errors
    /// A setting out of its range; the old settings stay.
    pub fn reconfigure(&mut self, config: LinkConfig) -> Result<(), ConfigError> {
        config.check()?;
        self.config = config;
        Ok(())
    }

    /// The settings in force.
    #[must_use]
    pub fn config(&self) -> &LinkConfig {
        &self.config
    }

    /// What the link decided so far.
    #[must_use]
    pub fn counters(&self) -> LinkCounters {
        self.counters
    }

    fn drop_cause(&self, draws: &Draws, meta: PacketMeta) -> Option<DropCause> {
        let lost = match self.config.loss {
            Loss::None => false,
            Loss::Independent { probability } => draws.loss < probability.get(),
        };
        if lost {
            return Some(DropCause::Loss);
        }
        (meta.in_flight >= self.config.limit as usize).then_some(DropCause::Limit)
    }

    fn departure(&mut self, now: Time, draws: &Draws) -> Time {
        let own = now + self.config.delay.quantile(draws.delay);
        let latest = own.max(self.latest_due);
        self.latest_due = latest;
        match self.config.order {
            Order::Fifo => latest,
            Order::Free => own,
        }
    }
}

#[cfg(test)]
mod tests;
