//! The packets on a link, and the stages that they pass.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Duration;

use mmt_shared::time::Time;

use super::bottleneck::{Bottleneck, ROOM};
use super::by_time::ByTime;
use super::correlated::ByPacket;
use super::cross::Arrivals;
use super::loss_model::LossModel;
use super::propagation::{Propagation, Way};
use super::streams::{Streams, substream};
use super::timeline::Timeline;
use crate::config::LinkConfig;
use crate::counters::LinkCounters;
use crate::direction::LinkId;
use crate::packet::{Departure, DropCause, Fate, Packet};

mod queueing;

/// The packets on a link, the states of its stages, and the counts.
#[derive(Clone, Debug)]
pub(super) struct Stages<T> {
    streams: Streams,
    loss: LossModel,
    duplicating: ByPacket,
    corrupting: ByPacket,
    arrivals: Arrivals,
    bottleneck: Bottleneck<Before<T>>,
    /// Packets before it without the cross traffic.
    waiting: usize,
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
    /// The how-manieth packet of this link it is; a link behind another one counts what comes to it.
    place: u64,
    ecn_capable: bool,
    /// The delay of the recorded path.
    replayed: Option<Duration>,
    way: Way,
}

/// What stands before the bottleneck.
#[derive(Clone, Debug)]
enum Before<T> {
    Packet(Transit<T>),
    /// A packet of the cross traffic, of so many bytes.
    Cross(usize),
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
            arrivals: Arrivals::new(seed, id),
            bottleneck: Bottleneck::new(limit),
            waiting: 0,
            propagation: Propagation::new(seed, id),
            out: BinaryHeap::with_capacity(ROOM.min(limit as usize)),
            in_flight: 0,
            bytes_in_flight: 0,
            counters: LinkCounters::default(),
        }
    }

    /// Takes in a packet that finds `backlog` others on the way, and perhaps makes a copy of it.
    pub(super) fn offer(&mut self, timeline: &Timeline, at: Time, packet: Packet<T>, backlog: usize)
    where
        T: Clone,
    {
        let departure = Departure {
            number: self.counters.offered.packets,
            offered_at: at,
            bytes: packet.bytes,
            backlog: u32::try_from(backlog).unwrap_or(u32::MAX),
            copy: false,
            due: at,
            queued: Duration::ZERO,
            fate: Fate::Delivered {
                corrupted_bit: None,
                marked: false,
            },
            payload: packet.payload,
        };
        self.take_in(timeline, departure, packet.ecn_capable);
    }

    /// Takes in what left the link before this one. What that link dropped is only handed on.
    pub(super) fn follow(&mut self, timeline: &Timeline, before: ByTime<T>)
    where
        T: Clone,
    {
        match before.departure.fate {
            Fate::Dropped(cause) => self.report(timeline, before.place, before.departure, cause),
            Fate::Delivered { .. } => self.take_in(timeline, before.departure, before.ecn_capable),
        }
    }

    /// Takes in a packet at the time when it is due here.
    fn take_in(&mut self, timeline: &Timeline, departure: Departure<T>, ecn_capable: bool)
    where
        T: Clone,
    {
        let (now, bytes) = (timeline.elapsed(departure.due), departure.bytes);
        while self.goes_on(timeline, now) {}
        let settings = timeline.at(now);
        let (chances, of_copy) = self.draw(settings, now, bytes, settings.ecn && ecn_capable);
        let itself = Transit {
            departure,
            place: self.counters.offered.packets,
            ecn_capable,
            replayed: None,
            way: chances.way,
        };
        self.counters.offered.count(bytes);
        let copy = of_copy.map(|chances| (itself.clone(), chances));
        self.admit(timeline, now, itself, chances);
        if let Some((mut copy, chances)) = copy {
            copy.departure.copy = true;
            self.counters.duplicated.count(bytes);
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
        if let Fate::Delivered {
            corrupted_bit,
            marked,
        } = &mut packet.departure.fate
        {
            // one bit at most is turned over, by whichever link of a chain does so first
            *corrupted_bit = corrupted_bit.or(chances.corrupted_bit);
            *marked |= chances.marked;
        }
        let passes = self
            .survives(settings, now, &mut packet, chances.lost)
            .and_then(|()| self.finds_room(timeline, now, bytes));
        match passes {
            Ok(weight) => {
                self.in_flight = self.in_flight.saturating_add(1);
                self.bytes_in_flight = self.bytes_in_flight.saturating_add(bytes as u64);
                let ecn_capable = packet.ecn_capable;
                self.waiting = self.waiting.saturating_add(1);
                self.bottleneck
                    .push(Before::Packet(packet), weight, ecn_capable, now);
                self.advance(timeline, now);
            }
            Err(cause) => {
                self.counters.dropped.count(cause, bytes);
                if !packet.departure.copy {
                    self.report(timeline, packet.place, packet.departure, cause);
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

    /// Puts a drop among what is polled. Who never polls gets the first ones only, as many as the limit.
    fn report(
        &mut self,
        timeline: &Timeline,
        place: u64,
        mut departure: Departure<T>,
        cause: DropCause,
    ) {
        departure.fate = Fate::Dropped(cause);
        let held = self.out.len().saturating_add(self.waiting);
        if held.saturating_sub(self.in_flight) < timeline.config.limit.packets as usize {
            self.out.push(Reverse(ByTime {
                departure,
                place,
                ecn_capable: false,
            }));
        }
    }

    /// When the next packet leaves, or left, by `now`.
    pub(super) fn next_due(&mut self, timeline: &Timeline, now: Time) -> Option<Time> {
        self.advance(timeline, timeline.elapsed(now));
        let Reverse(next) = self.out.peek()?;
        Some(next.departure.due).filter(|due| *due <= now)
    }

    /// Nothing that is taken in from `now` on leaves before this.
    pub(super) fn earliest_of_later(&self, timeline: &Timeline, now: Time) -> Time {
        let elapsed = timeline.elapsed(now);
        let leaves = self.propagation.earliest(timeline.at(elapsed), elapsed);
        // what the settings after these do is another matter
        let change = timeline.next_change(elapsed);
        timeline.time(change.map_or(leaves, |change| change.min(leaves)))
    }

    pub(super) fn poll(&mut self, timeline: &Timeline, now: Time) -> Option<ByTime<T>> {
        self.next_due(timeline, now)?;
        let Reverse(next) = self.out.pop()?;
        let departure = &next.departure;
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
        Some(next)
    }

    /// A packet is on the link no more.
    fn forget(&mut self, bytes: usize) {
        self.in_flight = self.in_flight.saturating_sub(1);
        self.bytes_in_flight = self.bytes_in_flight.saturating_sub(bytes as u64);
    }

    pub(super) fn next_event(&self, timeline: &Timeline) -> Option<Time> {
        let waits = (self.waiting > 0).then(|| self.bottleneck.next_event(timeline));
        let next = waits.flatten().map(|next| timeline.time(next));
        let out = self.out.peek().map(|Reverse(next)| next.departure.due);
        next.into_iter().chain(out).min()
    }

    /// Carries everything on to `at`, from when on other settings are in force.
    pub(super) fn settle(&mut self, timeline: &Timeline, at: Time) {
        let now = timeline.elapsed(at);
        while self.goes_on(timeline, now) {}
        self.arrivals.skip_to(now);
        self.bottleneck.change_at(now);
    }
}

/// Whether a packet is no larger than the MTU.
fn fits(settings: &LinkConfig, bytes: usize) -> bool {
    settings.mtu.is_none_or(|mtu| bytes <= mtu as usize)
}
