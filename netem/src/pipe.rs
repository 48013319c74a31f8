//! A link together with the packets in flight on it: what all three drivers share.
//!
//! The *sim* driver is nothing but this, stepped in virtual time. Still pure: time is an argument.
//!
//! The law that holds at any moment: offered + duplicated = dropped + in flight + released.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use mmt_shared::time::Time;

use crate::config::{ConfigError, LinkConfig};
use crate::counters::{LinkCounters, Tally};
use crate::direction::LinkId;
use crate::fate::{Delivery, Fate};
use crate::link::{Link, PacketMeta};

/// One direction of a path in virtual time, as the lab drives it.
pub type SimPath<T> = Pipe<T>;

/// Packets made room for at the start; more take memory as they come, up to the limit.
const ROOM: usize = 1024;

/// A link and its packets in flight, each with a payload. Bounded by the limit of the settings.
#[derive(Clone, Debug)]
pub struct Pipe<T> {
    link: Link,
    in_flight: BinaryHeap<Reverse<InFlight<T>>>,
    offers: u64,
    released: Tally,
}

/// A packet that left the link.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Released<T> {
    /// Its theoretical time of departure: what a link behind this one takes as its `now`.
    pub due: Time,
    /// When it was offered.
    pub offered_at: Time,
    /// The how-manieth offer it was, from 0; dropped packets count too.
    pub number: u64,
    /// Its length, bytes.
    pub bytes: usize,
    /// Whether it is a copy.
    pub copy: bool,
    /// The bit that was turned over on the way: whoever knows the bytes of the payload turns it
    /// ([`crate::fate::turn_bit`]), or treats the packet as its checksum would.
    pub corrupted_bit: Option<u64>,
    /// Whether it met congestion on the way and is to be marked so, instead of having been lost.
    pub marked: bool,
    /// What it carries.
    pub payload: T,
}

impl<T: Clone> Pipe<T> {
    /// An empty pipe over a link with these settings.
    ///
    /// # Errors
    /// A setting out of its range.
    pub fn try_new(config: LinkConfig, seed: u64, id: LinkId) -> Result<Self, ConfigError> {
        Ok(Self {
            in_flight: BinaryHeap::with_capacity(ROOM.min(config.limit as usize)),
            link: Link::try_new(config, seed, id)?,
            offers: 0,
            released: Tally::default(),
        })
    }

    /// Offers a packet at `now`. Take out what is due first ([`Self::pop_due`]): what is still in the
    /// pipe counts against the limit.
    pub fn push(&mut self, now: Time, bytes: usize, payload: T) -> Fate {
        self.push_ecn(now, bytes, false, payload)
    }

    /// Offers a packet as [`Self::push`] does, and says whether its sender takes a mark for a loss.
    pub fn push_ecn(&mut self, now: Time, bytes: usize, ecn_capable: bool, payload: T) -> Fate {
        let meta = PacketMeta {
            bytes,
            in_flight: self.in_flight.len(),
            ecn_capable,
        };
        let number = self.offers;
        self.offers = self.offers.saturating_add(1);
        let fate = self.link.offer(now, meta);
        if let Fate::Deliver(deliveries) = &fate {
            let released = |delivery: Delivery, copy, payload| Released {
                due: delivery.due,
                offered_at: now,
                number,
                bytes,
                copy,
                corrupted_bit: delivery.corrupted_bit,
                marked: delivery.marked,
                payload,
            };
            for copy in deliveries.copies() {
                let copy = released(copy, true, payload.clone());
                self.in_flight.push(Reverse(InFlight(copy)));
            }
            let itself = released(deliveries.itself(), false, payload);
            self.in_flight.push(Reverse(InFlight(itself)));
        }
        fate
    }
}

impl<T> Pipe<T> {
    /// Takes out the next packet that is due at `now`: by departure, then by order of offer.
    pub fn pop_due(&mut self, now: Time) -> Option<Released<T>> {
        if self.next_due()? > now {
            return None;
        }
        let Reverse(InFlight(packet)) = self.in_flight.pop()?;
        self.released.count(packet.bytes);
        Some(packet)
    }

    /// When the next packet leaves; `None` when nothing is in flight.
    #[must_use]
    pub fn next_due(&self) -> Option<Time> {
        self.in_flight.peek().map(|Reverse(packet)| packet.0.due)
    }

    /// Packets in flight.
    #[must_use]
    pub fn in_flight(&self) -> usize {
        self.in_flight.len()
    }

    /// What the link decided so far.
    #[must_use]
    pub fn counters(&self) -> LinkCounters {
        self.link.counters()
    }

    /// Says when the time of the link begins, see [`Link::set_origin`].
    pub fn set_origin(&mut self, origin: Time) {
        self.link.set_origin(origin);
    }

    /// Packets taken out so far.
    #[must_use]
    pub fn released(&self) -> Tally {
        self.released
    }

    /// The settings in force.
    #[must_use]
    pub fn config(&self) -> &LinkConfig {
        self.link.config()
    }

    /// New settings for the packets to come, see [`Link::reconfigure`].
    ///
    /// # Errors
    /// A setting out of its range; the old settings stay.
    pub fn reconfigure(&mut self, config: LinkConfig) -> Result<(), ConfigError> {
        self.link.reconfigure(config)
    }
}

/// A packet in the heap: ordered by departure, then by number of offer, a copy last.
#[derive(Clone, Debug)]
struct InFlight<T>(Released<T>);

impl<T> InFlight<T> {
    fn key(&self) -> (Time, u64, bool) {
        (self.0.due, self.0.number, self.0.copy)
    }
}

impl<T> PartialEq for InFlight<T> {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl<T> Eq for InFlight<T> {}

impl<T> PartialOrd for InFlight<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> Ord for InFlight<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key().cmp(&other.key())
    }
}

#[cfg(test)]
mod tests;
