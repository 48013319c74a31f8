//! The packets on a link, and the stages that they pass.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Duration;

use mmt_shared::time::Time;

use super::bottleneck::{Bottleneck, ROOM};
use super::by_time::{ByTime, Lineage, Lost};
use super::chances::{Chances, Coming, Lot, Way};
use super::cross::Arrivals;
use super::propagation::Propagation;
use super::streams::{Streams, substream};
use super::timeline::Timeline;
use crate::config::LinkConfig;
use crate::counters::LinkCounters;
use crate::direction::LinkId;
use crate::packet::{Departure, DropCause, Fate, Packet};

mod lost;
mod queueing;

/// The packets on a link, the states of its stages, and the counts.
#[derive(Clone, Debug)]
pub(super) struct Stages<T> {
    streams: Streams,
    /// The draws of copies that an earlier link made.
    streams_of_copies: Streams,
    chances: Chances,
    arrivals: Arrivals,
    bottleneck: Bottleneck<Before<T>>,
    /// Packets before it without the cross traffic.
    waiting: usize,
    propagation: Propagation,
    /// What leaves at a known time, and what was dropped.
    out: BinaryHeap<Reverse<ByTime<T>>>,
    /// What is lost, for the links behind this one, if there are any.
    lost: BinaryHeap<Reverse<Lost>>,
    pub(super) followed: bool,
    /// Packets that came, those among them that were lost before.
    came: u64,
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
    lineage: Lineage,
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

/// The draws of copies are those of a path of their own.
const COPIES_PATH: u64 = 1 << 48;

impl<T> Stages<T> {
    pub(super) fn new(seed: u64, id: LinkId, limit: u32) -> Self {
        let bursts = substream(id, seed, "netem/up/burst", "netem/down/burst");
        Self {
            streams: Streams::new(seed, id),
            streams_of_copies: Streams::new(
                seed,
                LinkId {
                    path: id.path.wrapping_add(COPIES_PATH),
                    ..id
                },
            ),
            chances: Chances::new(bursts),
            arrivals: Arrivals::new(seed, id),
            bottleneck: Bottleneck::new(limit),
            waiting: 0,
            propagation: Propagation::new(seed, id),
            out: BinaryHeap::with_capacity(ROOM.min(limit as usize)),
            lost: BinaryHeap::new(),
            followed: false,
            came: 0,
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
        self.take_in(timeline, departure, 0, packet.ecn_capable);
    }

    /// Takes in what left the link before this one. What that link dropped is only handed on.
    pub(super) fn follow(&mut self, timeline: &Timeline, before: ByTime<T>)
    where
        T: Clone,
    {
        match before.departure.fate {
            Fate::Dropped(cause) => self.report(timeline, before.place, before.departure, cause),
            Fate::Delivered { .. } => {
                let lineage = before.lineage << 1;
                self.take_in(timeline, before.departure, lineage, before.ecn_capable);
            }
        }
    }

    /// Takes in a packet at the time when it is due here.
    fn take_in(
        &mut self,
        timeline: &Timeline,
        departure: Departure<T>,
        lineage: Lineage,
        ecn_capable: bool,
    ) where
        T: Clone,
    {
        let (now, bytes) = (timeline.elapsed(departure.due), departure.bytes);
        while self.goes_on(timeline, now) {}
        let coming = Coming {
            number: departure.number,
            bytes,
            ecn_capable,
        };
        let (lot, of_copy) = self.draw(timeline.at(now), now, coming, lineage);
        let itself = Transit {
            departure,
            place: self.next_place(),
            lineage,
            ecn_capable,
            replayed: None,
            way: lot.way,
        };
        self.counters.offered.count(bytes);
        let copy = of_copy.map(|lot| (itself.clone(), lot));
        self.admit(timeline, now, itself, lot);
        if let Some((mut copy, lot)) = copy {
            copy.departure.copy = true;
            copy.lineage |= 1;
            self.counters.duplicated.count(bytes);
            self.admit(timeline, now, copy, lot);
        }
    }

    fn next_place(&mut self) -> u64 {
        let place = self.came;
        self.came = self.came.wrapping_add(1);
        place
    }

    /// What chance does to a packet that comes. A copy that an earlier link made meets the states as they are, has
    /// draws of its own, and leaves those of the packets alone.
    fn draw(
        &mut self,
        settings: &LinkConfig,
        now: Duration,
        packet: Coming,
        lineage: Lineage,
    ) -> (Lot, Option<Lot>) {
        if lineage == 0 {
            let draws = self.streams.draw(packet.number);
            return self.chances.draw(settings, now, packet, &draws);
        }
        let own = packet.number << Lineage::BITS | u64::from(lineage);
        let draws = self.streams_of_copies.draw(own);
        self.chances.clone().draw(settings, now, packet, &draws)
    }

    /// Puts a packet or a copy before the bottleneck, or drops it.
    fn admit(&mut self, timeline: &Timeline, now: Duration, mut packet: Transit<T>, lot: Lot) {
        let bytes = packet.departure.bytes;
        packet.way = lot.way;
        if let Fate::Delivered {
            corrupted_bit,
            marked,
        } = &mut packet.departure.fate
        {
            // one bit at most is turned over, by whichever link of a chain does so first
            *corrupted_bit = corrupted_bit.or(lot.corrupted_bit);
            *marked |= lot.marked;
        }
        let passes = self
            .survives(timeline, now, &mut packet, lot.lost)
            .and_then(|()| {
                let room = self.finds_room(timeline, now, bytes);
                if room.is_err() {
                    self.pass_on_lost(packet.as_lost(timeline.time(now), false));
                }
                room
            });
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
        timeline: &Timeline,
        now: Duration,
        packet: &mut Transit<T>,
        lost: bool,
    ) -> Result<(), DropCause> {
        let (settings, bytes) = (timeline.at(now), packet.departure.bytes);
        let replayed = settings.replay.as_ref().map(|replay| replay.path.at(now));
        packet.replayed = replayed.flatten();
        let dropped = if !settings.fits(bytes) {
            DropCause::Mtu
        } else if settings.outages.iter().any(|outage| outage.covers(now)) {
            DropCause::Outage
        } else if lost || replayed == Some(None) {
            DropCause::Loss
        } else {
            return Ok(());
        };
        let end = if replayed == Some(None) {
            None
        } else {
            self.end_of_way(settings, now, bytes, packet.replayed, packet.way)
        };
        let due = timeline.time(end.unwrap_or(now));
        self.pass_on_lost(packet.as_lost(due, end.is_some()));
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
                lineage: 0,
                ecn_capable: false,
            }));
        }
    }

    /// When the next packet leaves, or left, by `now`, or goes on as one that is lost.
    pub(super) fn next_due(&mut self, timeline: &Timeline, now: Time) -> Option<Time> {
        self.advance(timeline, timeline.elapsed(now));
        let out = self.out.peek().map(|Reverse(next)| next.departure.due);
        let lost = self.lost.peek().map(|Reverse(next)| next.due);
        let next = out.into_iter().chain(lost).min()?;
        Some(next).filter(|due| *due <= now)
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
        self.advance(timeline, timeline.elapsed(now));
        self.out
            .peek()
            .filter(|Reverse(next)| next.departure.due <= now)?;
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
