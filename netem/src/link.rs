//! One direction of an emulated path, as a pure state machine.
//!
//! A packet is offered with the time of its arrival, and its fate is known at once: a drop with its
//! cause, or the times at which it leaves. The order of the stages is that of a real path: MTU, copy,
//! loss, limit, corruption, bottleneck with its queue, propagation with jitter, order. The times are
//! theoretical: whoever releases packets late must not feed its lateness back, so it does not add up.
//!
//! It must never sleep, read a clock, touch a socket or allocate.

use mmt_shared::time::Time;

use crate::config::{ConfigError, LinkConfig};
use crate::counters::LinkCounters;
use crate::fate::{Deliveries, Delivery, DropCause, Fate};

mod bottleneck;
mod catch_up;
mod codel;
mod correlated;
mod losing;
mod slots;
mod stages;
mod streams;
mod timeline;

pub use crate::direction::{Direction, LinkId};

use stages::{Departure, Passing, Stages};
use streams::Streams;
use timeline::Timeline;

/// What a link must know about a packet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PacketMeta {
    /// Its length, bytes (UDP payload in the drivers of this crate).
    pub bytes: usize,
    /// Packets offered earlier that have not left yet; whoever holds them counts them.
    pub in_flight: usize,
    /// Whether its sender takes a mark for a loss (ECN, RFC 3168).
    pub ecn_capable: bool,
}

/// One direction of an emulated path. A pure function of its settings, its seed and its offers.
#[derive(Clone, Debug)]
pub struct Link {
    config: LinkConfig,
    timeline: Timeline,
    streams: Streams,
    stages: Stages,
    origin: Time,
    offers: u64,
    counters: LinkCounters,
}

impl Link {
    /// A link with these settings. The draws depend on the seed (`seed`, or that of the settings if they have
    /// one) and `id` alone. Its time begins at
    /// [`Time::ZERO`]; see [`Self::set_origin`].
    ///
    /// # Errors
    /// A setting out of its range.
    pub fn try_new(config: LinkConfig, seed: u64, id: LinkId) -> Result<Self, ConfigError> {
        config.check()?;
        let seed = config.seed.unwrap_or(seed);
        let timeline = Timeline::new(&config);
        let mut stages = Stages::new(seed, id);
        stages.prepare(timeline.settings());
        Ok(Self {
            config,
            timeline,
            streams: Streams::new(seed, id),
            stages,
            origin: Time::ZERO,
            offers: 0,
            counters: LinkCounters::default(),
        })
    }

    /// Says when the time of the link begins, before the first offer: profiles, outages, replays and all
    /// that is correlated in time count from there.
    pub fn set_origin(&mut self, origin: Time) {
        self.origin = origin;
    }

    /// Decides what becomes of the packet that arrives at `now`.
    ///
    /// `now` is the theoretical time of arrival: for a link behind another one, the time at which the
    /// packet was due to leave that one.
    pub fn offer(&mut self, now: Time, meta: PacketMeta) -> Fate {
        self.counters.offered.count(meta.bytes);
        let draws = self.streams.draw();
        let elapsed = now.saturating_since(self.origin);
        let config = self.timeline.at(elapsed, &self.config);
        let passing = Passing {
            number: self.offers,
            elapsed,
            bytes: meta.bytes,
            in_flight: meta.in_flight,
            ecn_capable: meta.ecn_capable,
        };
        self.offers = self.offers.saturating_add(1);
        let (itself, copy) = self.stages.pass(config, passing, &draws);
        self.settle(meta.bytes, itself, copy)
    }

    /// Counts the packet and its copy, and joins their fates.
    fn settle(
        &mut self,
        bytes: usize,
        itself: Result<Departure, DropCause>,
        copy: Option<Result<Departure, DropCause>>,
    ) -> Fate {
        if copy.is_some() {
            self.counters.duplicated.count(bytes);
        }
        for result in [Some(itself), copy].into_iter().flatten() {
            match result {
                Ok(departure) => {
                    self.counters.delivered.count(bytes);
                    if departure.corrupted_bit.is_some() {
                        self.counters.corrupted.count(bytes);
                    }
                    if departure.marked {
                        self.counters.marked.count(bytes);
                    }
                }
                Err(cause) => self.counters.dropped.count(cause, bytes),
            }
        }
        let delivery = |departure: Departure| Delivery {
            due: self.origin + departure.after,
            corrupted_bit: departure.corrupted_bit,
            marked: departure.marked,
        };
        let copy = copy.and_then(Result::ok).map(delivery);
        match (itself.map(delivery), copy) {
            (Ok(itself), copy) => Fate::Deliver(Deliveries::of(itself, copy)),
            // the copy stands in for the packet
            (Err(_), Some(copy)) => Fate::Deliver(Deliveries::of(copy, None)),
            (Err(cause), None) => Fate::Drop(cause),
        }
    }

    /// Takes new settings for the packets offered from now on. Packets in flight keep their times, the
    /// counters and the random streams go on, and under [`crate::Order::Fifo`] no packet overtakes an
    /// earlier one, not even one of the old settings. Time is still counted from the origin, and a seed
    /// among the new settings changes nothing.
    ///
    /// # Errors
    /// A setting out of its range; the old settings stay.
    pub fn reconfigure(&mut self, config: LinkConfig) -> Result<(), ConfigError> {
        config.check()?;
        self.timeline = Timeline::new(&config);
        self.stages.prepare(self.timeline.settings());
        self.config = config;
        Ok(())
    }

    /// The settings, with all that they say about later.
    #[must_use]
    pub fn config(&self) -> &LinkConfig {
        &self.config
    }

    /// When the settings in force at `now` change next because of their profile; the fates of packets
    /// need no call at that time, only who shows settings does.
    #[must_use]
    pub fn next_change(&self, now: Time) -> Option<Time> {
        let elapsed = now.saturating_since(self.origin);
        let next = self.timeline.next_change(elapsed)?;
        Some(self.origin + next)
    }

    /// Packets before the bottleneck and being sent, as of the last offer.
    #[must_use]
    pub fn backlog(&self) -> usize {
        self.stages.backlog()
    }

    /// What the link decided so far.
    #[must_use]
    pub fn counters(&self) -> LinkCounters {
        self.counters
    }
}

#[cfg(test)]
mod tests;
