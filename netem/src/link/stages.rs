//! The packets on a link, and the stages that they pass.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Duration;

use mmt_shared::time::Time;

use super::bottleneck::{Bottleneck, ROOM, Sent};
use super::by_time::ByTime;
use super::correlated::ByPacket;
use super::loss_model::LossModel;
use super::propagation::{Propagation, Way};
use super::streams::{Streams, substream};
use super::timeline::Timeline;
use crate::config::LinkConfig;
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
    bytes_in_flight: u64,
    pub(super) counters: LinkCounters,
}

/// A packet on the link: its departure as far as it is known, and what the later stages need.
#[derive(Clone, Debug)]
struct Transit<T> {
    departure: Departure<T>,
    ecn_capable: bool,
    /// The delay of the recorded path.
    replayed: Option<Duration>,
    way: Way,
}

/// What chance does to a packet, or to its copy.
#[derive(Clone, Copy, Debug)]
struct Chances {
    lost: bool,
    marked: bool,
    corrupted_bit: Option<u64>,
    way: Way,
}

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
            bytes_in_flight: 0,
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
        let settings = timeline.at(now);
        let marks = settings.ecn && packet.ecn_capable;
        let (chances, of_copy) = self.draw(settings, now, packet.bytes, marks);
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
        let itself = Transit {
            departure,
            ecn_capable: packet.ecn_capable,
            replayed: None,
            way: chances.way,
        };
        let copy = of_copy.map(|chances| (itself.clone(), chances));
        self.admit(timeline, now, itself, chances);
        if let Some((mut copy, chances)) = copy {
            copy.departure.copy = true;
            self.counters.duplicated.count(packet.bytes);
            self.admit(timeline, now, copy, chances);
        }
    }

    /// What chance does to a packet that is offered, and to its copy if it has one. Every effect draws for
    /// every packet, whatever becomes of it, so that no effect moves the draws of another.
    fn draw(
        &mut self,
        settings: &LinkConfig,
        now: Duration,
        bytes: usize,
        marks: bool,
    ) -> (Chances, Option<Chances>) {
        let (draws, number) = (self.streams.draw(), self.counters.offered.packets);
        let loss = self.loss.draw(&settings.loss, number, now, &draws);
        let way = self.propagation.draw(settings, &draws);
        let hit = loss.is_lost();
        let bit = |draw: f64| (draw * bytes as f64 * 8.0) as u64;
        let corrupt = self.corrupting.happens(settings.corrupt, draws.corrupt) && bytes > 0;
        let mut chances = Chances {
            lost: hit && !marks,
            marked: hit && marks,
            corrupted_bit: corrupt.then(|| bit(draws.corrupted_bit)),
            way,
        };
        let doubled = self
            .duplicating
            .happens(settings.duplicate, draws.duplicate);
        if !doubled || !fits(settings, bytes) {
            return (chances, None);
        }
        let hit = draws.copy_loss < loss.probability;
        let corrupt = draws.copy_corrupt < settings.corrupt.probability.get() && bytes > 0;
        let copy = Chances {
            // as in tc, a packet that is both lost and copied passes once
            lost: chances.lost || hit && !marks,
            marked: chances.marked || hit && marks,
            corrupted_bit: corrupt.then(|| bit(draws.copy_bit)),
            way: Way {
                share: draws.copy_delay,
                ..way
            },
        };
        chances.lost = false;
        (chances, Some(copy))
    }

    /// Puts a packet or a copy before the bottleneck, or drops it.
    fn admit(
        &mut self,
        timeline: &Timeline,
        now: Duration,
        mut packet: Transit<T>,
        chances: Chances,
    ) {
        let (settings, bytes) = (timeline.at(now), packet.departure.bytes);
        packet.way = chances.way;
        packet.departure.fate = Fate::Delivered {
            corrupted_bit: chances.corrupted_bit,
            marked: chances.marked,
        };
        let passes = self
            .survives(settings, now, &mut packet, chances.lost)
            .and_then(|()| self.finds_room(timeline, now, bytes));
        match passes {
            Ok(weight) => {
                self.in_flight = self.in_flight.saturating_add(1);
                self.bytes_in_flight = self.bytes_in_flight.saturating_add(bytes as u64);
                let ecn_capable = packet.ecn_capable;
                self.bottleneck.push(packet, weight, ecn_capable, now);
                self.advance(timeline, now);
            }
            Err(cause) => {
                self.counters.dropped.count(cause, bytes);
                if !packet.departure.copy {
                    self.report(timeline, packet.departure, cause);
                }
            }
        }
    }

    /// What happens to a packet on the way, whatever else is on the link.
    fn survives(
        &mut self,
        settings: &LinkConfig,
        now: Duration,
        packet: &mut Transit<T>,
        lost: bool,
    ) -> Result<(), DropCause> {
        let bytes = packet.departure.bytes;
        let replayed = settings.replay.as_ref().map(|replay| replay.path.at(now));
        packet.replayed = replayed.flatten();
        let dropped = if !fits(settings, bytes) {
            DropCause::Mtu
        } else if settings.outages.iter().any(|outage| outage.covers(now)) {
            DropCause::Outage
        } else if lost || replayed == Some(None) {
            DropCause::Loss
        } else {
            return Ok(());
        };
        // Without a bottleneck it is lost at the end of its way, where it keeps its place in the order: a loss
        // moves no other packet.
        if settings.rate.is_none() && self.bottleneck.len() == 0 && replayed != Some(None) {
            self.propagation
                .leave(settings, now, bytes, packet.replayed, packet.way);
        }
        Err(dropped)
    }

    /// The weight of a packet before the bottleneck, bytes, if it finds room on the link.
    fn finds_room(
        &mut self,
        timeline: &Timeline,
        now: Duration,
        bytes: usize,
    ) -> Result<u64, DropCause> {
        let settings = timeline.at(now);
        let held = self.bytes_in_flight.saturating_add(bytes as u64);
        if self.in_flight >= settings.limit.packets as usize || held > settings.limit.bytes {
            return Err(DropCause::Limit);
        }
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
            way,
            ..
        } = sent.packet;
        departure.queued = sent.queued;
        departure.due = timeline.time(sent.at);
        if let Some(cause) = sent.dropped {
            self.forget(departure.bytes);
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
            .leave(settings, sent.at, departure.bytes, replayed, way);
        departure.due = timeline.time(leaves);
        self.out.push(Reverse(ByTime(departure)));
    }

    /// Puts a drop among what is polled. Who never polls gets the first ones only, as many as the limit.
    fn report(&mut self, timeline: &Timeline, mut departure: Departure<T>, cause: DropCause) {
        departure.fate = Fate::Dropped(cause);
        let held = self.out.len().saturating_add(self.bottleneck.len());
        if held.saturating_sub(self.in_flight) < timeline.config.limit.packets as usize {
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
            self.forget(departure.bytes);
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

    /// A packet is on the link no more.
    fn forget(&mut self, bytes: usize) {
        self.in_flight = self.in_flight.saturating_sub(1);
        self.bytes_in_flight = self.bytes_in_flight.saturating_sub(bytes as u64);
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

/// Whether a packet is no larger than the MTU.
fn fits(settings: &LinkConfig, bytes: usize) -> bool {
    settings.mtu.is_none_or(|mtu| bytes <= mtu as usize)
}
