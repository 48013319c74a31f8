//! The packets on a link, and the stages that they pass.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use std::time::Duration;

use mmt_shared::time::Time;

use super::bottleneck::{Bottleneck, ROOM, Sent};
use super::correlated::ByPacket;
use super::loss_model::{LossDraw, LossModel};
use super::propagation::Propagation;
use super::streams::{Draws, Streams, substream};
use super::timeline::Timeline;
use crate::counters::LinkCounters;
use crate::direction::LinkId;
use crate::packet::{Departure, DropCause, Fate, Packet};

/// The packets on a link, the states of its stages, and the counts.
#[derive(Clone, Debug)]
pub(super) struct Stages<T> {
    streams: Streams,
    loss: LossModel,
    duplicating: ByPacket,
    corrupting: ByPacket,
    bottleneck: Bottleneck<Transit<T>>,
    propagation: Propagation,
    /// What leaves at a known time, and what was dropped.
    out: BinaryHeap<Reverse<ByTime<T>>>,
    pub(super) in_flight: usize,
    pub(super) counters: LinkCounters,
}

/// A packet on the link: its departure as far as it is known, and what the later stages need.
#[derive(Clone, Debug)]
struct Transit<T> {
    departure: Departure<T>,
    ecn_capable: bool,
    /// The delay of the recorded path.
    replayed: Option<Duration>,
    draws: Draws,
}

/// A packet that found no place on the link.
type Refused<T> = (Departure<T>, DropCause);

impl<T> Stages<T> {
    pub(super) fn new(seed: u64, id: LinkId, limit: u32) -> Self {
        let bursts = substream(id, seed, "netem/up/burst", "netem/down/burst");
        Self {
            streams: Streams::new(seed, id),
            loss: LossModel::new(bursts),
            duplicating: ByPacket::default(),
            corrupting: ByPacket::default(),
            bottleneck: Bottleneck::new(limit),
            propagation: Propagation::new(seed, id),
            out: BinaryHeap::with_capacity(ROOM.min(limit as usize)),
            in_flight: 0,
            counters: LinkCounters::default(),
        }
    }

    /// Takes in a packet, and perhaps makes a copy of it.
    pub(super) fn offer(&mut self, timeline: &Timeline, at: Time, packet: Packet<T>)
    where
        T: Clone,
    {
        let now = timeline.elapsed(at);
        self.advance(timeline, now);
        let (bytes, number) = (packet.bytes, self.counters.offered.packets);
        let itself = self.enter(at, packet);
        let settings = timeline.at(now);
        if settings.mtu.is_some_and(|mtu| bytes > mtu as usize) {
            self.counters.dropped.count(DropCause::Mtu, bytes);
            return self.report(timeline, itself.departure, DropCause::Mtu);
        }
        let draws = itself.draws;
        let doubled = self
            .duplicating
            .happens(settings.duplicate, draws.duplicate);
        let loss = self.loss.draw(&settings.loss, number, now, &draws);
        let copy = doubled.then(|| itself.clone());
        let refused = self.admit(timeline, now, itself, loss);
        let mut replaced = false;
        if let Some(mut copy) = copy {
            self.counters.duplicated.count(bytes);
            // a copy whose packet is gone stands in for it
            copy.departure.copy = refused.is_none();
            copy.draws.delay = draws.copy_delay;
            let draw = draws.copy_loss;
            let refused = self.admit(timeline, now, copy, LossDraw { draw, ..loss });
            replaced = refused.is_none();
        }
        if let Some((departure, cause)) = refused
            && !replaced
        {
            self.report(timeline, departure, cause);
        }
    }

    /// Counts a packet and takes its draws: one from every stream, whatever becomes of it.
    fn enter(&mut self, at: Time, packet: Packet<T>) -> Transit<T> {
        let departure = Departure {
            number: self.counters.offered.packets,
            offered_at: at,
            bytes: packet.bytes,
            backlog: u32::try_from(self.in_flight).unwrap_or(u32::MAX),
            copy: false,
            due: at,
            queued: Duration::ZERO,
            fate: Fate::Delivered {
                corrupted_bit: None,
                marked: false,
            },
            payload: packet.payload,
        };
        self.counters.offered.count(packet.bytes);
        Transit {
            departure,
            ecn_capable: packet.ecn_capable,
            replayed: None,
            draws: self.streams.draw(),
        }
    }

    /// Puts a packet or a copy before the bottleneck, or drops it.
    fn admit(
        &mut self,
        timeline: &Timeline,
        now: Duration,
        mut packet: Transit<T>,
        loss: LossDraw,
    ) -> Option<Refused<T>> {
        let bytes = packet.departure.bytes;
        let weight = match self.decide(timeline, now, &mut packet, loss) {
            Ok(weight) => weight,
            Err(cause) => {
                self.counters.dropped.count(cause, bytes);
                return Some((packet.departure, cause));
            }
        };
        self.in_flight = self.in_flight.saturating_add(1);
        let ecn_capable = packet.ecn_capable;
        self.bottleneck.push(packet, weight, ecn_capable, now);
        self.advance(timeline, now);
        None
    }

    /// What happens to a packet before it waits: returns its weight before the bottleneck, bytes.
    fn decide(
        &mut self,
        timeline: &Timeline,
        now: Duration,
        packet: &mut Transit<T>,
        loss: LossDraw,
    ) -> Result<u64, DropCause> {
        let settings = timeline.at(now);
        if settings.outages.iter().any(|outage| outage.covers(now)) {
            return Err(DropCause::Outage);
        }
        let replayed = settings.replay.as_ref().map(|replay| replay.path.at(now));
        let marked = loss.is_lost() && settings.ecn && packet.ecn_capable;
        if (loss.is_lost() && !marked) || replayed == Some(None) {
            return Err(DropCause::Loss);
        }
        packet.replayed = replayed.flatten();
        if self.in_flight >= settings.limit as usize {
            return Err(DropCause::Limit);
        }
        let (draws, bytes) = (&packet.draws, packet.departure.bytes);
        let corrupt = self.corrupting.happens(settings.corrupt, draws.corrupt) && bytes > 0;
        let bit = (draws.corrupted_bit * bytes as f64 * 8.0) as u64;
        packet.departure.fate = Fate::Delivered {
            corrupted_bit: corrupt.then_some(bit),
            marked,
        };
        let Some(rate) = &settings.rate else {
            return Ok(0);
        };
        let (queue, weight) = (&settings.queue, rate.framing.weight(bytes));
        while self.bottleneck.is_full(rate, queue, now, weight) {
            let victim = queue.drop_head.then(|| self.bottleneck.drop_head(now));
            let victim = victim.flatten().ok_or(DropCause::Queue)?;
            self.pass_on(timeline, victim);
        }
        Ok(weight)
    }

    /// Lets everything happen that happens by `now`.
    fn advance(&mut self, timeline: &Timeline, now: Duration) {
        while let Some(sent) = self.bottleneck.poll(timeline, now) {
            self.pass_on(timeline, sent);
        }
    }

    /// Sends on what left the bottleneck.
    fn pass_on(&mut self, timeline: &Timeline, sent: Sent<Transit<T>>) {
        let Transit {
            mut departure,
            replayed,
            draws,
            ..
        } = sent.packet;
        departure.queued = sent.queued;
        departure.due = timeline.time(sent.at);
        if let Some(cause) = sent.dropped {
            self.in_flight = self.in_flight.saturating_sub(1);
            self.counters.dropped.count(cause, departure.bytes);
            if !departure.copy {
                self.report(timeline, departure, cause);
            }
            return;
        }
        if let Fate::Delivered { marked, .. } = &mut departure.fate {
            *marked |= sent.marked;
        }
        let settings = timeline.at(sent.at);
        let leaves = self
            .propagation
            .leave(settings, sent.at, departure.bytes, replayed, &draws);
        departure.due = timeline.time(leaves);
        self.out.push(Reverse(ByTime(departure)));
    }

    /// Puts a drop among what is polled. Who never polls gets the first ones only, as many as the limit.
    fn report(&mut self, timeline: &Timeline, mut departure: Departure<T>, cause: DropCause) {
        departure.fate = Fate::Dropped(cause);
        let held = self.out.len().saturating_add(self.bottleneck.len());
        if held.saturating_sub(self.in_flight) < timeline.config.limit as usize {
            self.out.push(Reverse(ByTime(departure)));
        }
    }

    pub(super) fn poll(&mut self, timeline: &Timeline, now: Time) -> Option<Departure<T>> {
        self.advance(timeline, timeline.elapsed(now));
        let Reverse(next) = self.out.peek()?;
        if next.0.due > now {
            return None;
        }
        let Reverse(ByTime(departure)) = self.out.pop()?;
        if let Fate::Delivered { marked, .. } = departure.fate {
            self.in_flight = self.in_flight.saturating_sub(1);
            self.counters.delivered.count(departure.bytes);
            if departure.is_corrupted() {
                self.counters.corrupted.count(departure.bytes);
            }
            if marked {
                self.counters.marked.count(departure.bytes);
            }
        }
        Some(departure)
    }

    pub(super) fn next_event(&self, timeline: &Timeline) -> Option<Time> {
        let next = self.bottleneck.next_event(timeline);
        let next = next.map(|next| timeline.time(next));
        let out = self.out.peek().map(|Reverse(next)| next.0.due);
        next.into_iter().chain(out).min()
    }

    /// Carries everything on to `at`, from when on other settings are in force.
    pub(super) fn settle(&mut self, timeline: &Timeline, at: Time) {
        let now = timeline.elapsed(at);
        self.advance(timeline, now);
        self.bottleneck.change_at(now);
    }
}

/// A departure ordered by its time, then by number of offer, a copy last.
#[derive(Clone, Debug)]
struct ByTime<T>(Departure<T>);

impl<T> ByTime<T> {
    fn key(&self) -> (Time, u64, bool) {
        (self.0.due, self.0.number, self.0.copy)
    }
}

impl<T> PartialEq for ByTime<T> {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl<T> Eq for ByTime<T> {}

impl<T> PartialOrd for ByTime<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> Ord for ByTime<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key().cmp(&other.key())
    }
}
