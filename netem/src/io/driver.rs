//! What the drivers in real time share, one direction of it: the link, its record, its lateness, its counts.
//!
//! It keeps no time and owns no socket: whoever drives it offers, polls, sends, and reports what came of it.

use std::sync::Arc;

use mmt_shared::time::Time;
use quinn::udp::EcnCodepoint;
use serde::Serialize;

use super::capture_file::CaptureWriter;
use super::lateness::Recorder;
use super::record_file::RecordWriter;
use crate::capture::{Event, Sides};
use crate::config::{ConfigError, LinkConfig};
use crate::counters::{LinkCounters, Tally};
use crate::direction::LinkId;
use crate::link::Link;
use crate::packet::{Departure, Fate, Packet, flip_bit};
use crate::record::{End, Entry};

/// One direction in real time. Bytes are UDP payload.
///
/// `link.offered + link.duplicated = link.dropped + in_flight + sent + blocked + failed + abandoned`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct DirectionCounters {
    /// What the link decided.
    pub link: LinkCounters,
    /// Packets on the link now.
    pub in_flight: u64,
    /// Packets that the real socket took: what a capture on the wire shows.
    pub sent: Tally,
    /// Packets dropped because the real socket stayed full.
    pub blocked: Tally,
    /// Packets that the real socket refused with an error.
    pub failed: Tally,
    /// Packets in flight when the socket was dropped, or when the relay forgot their client.
    pub abandoned: Tally,
}

impl DirectionCounters {
    /// Packets dropped since `before`, by the names that reports give them.
    #[must_use]
    pub fn drops_since(&self, before: &Self) -> [(&'static str, u64); 9] {
        let names = |of: &Self| {
            [
                ("netem_loss", of.link.dropped.loss),
                ("netem_outage", of.link.dropped.outage),
                ("netem_mtu", of.link.dropped.mtu),
                ("netem_queue", of.link.dropped.queue),
                ("netem_codel", of.link.dropped.codel),
                ("netem_limit", of.link.dropped.limit),
                ("netem_abandoned", of.abandoned),
                ("socket_blocked", of.blocked),
                ("socket_failed", of.failed),
            ]
        };
        let mut before = names(before).into_iter();
        names(self).map(|(name, now)| {
            let then = before.next().map_or(0, |(_, then)| then.packets);
            (name, now.packets.saturating_sub(then))
        })
    }
}

/// What became of a packet that the link delivered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    Sent,
    Blocked,
    Failed,
    Abandoned,
}

/// A datagram on a link; `A` is where it goes.
#[derive(Clone, Debug)]
pub(super) struct Datagram<A> {
    pub(super) address: A,
    pub(super) ecn: Option<EcnCodepoint>,
    pub(super) contents: Vec<u8>,
}

/// The addresses on both sides of the link of a datagram with this address; none: it has its IP header itself.
pub(super) type SidesOf<A> = fn(&A) -> Option<Sides>;

/// The link of one direction with all that is kept of it.
#[derive(Debug)]
pub(super) struct Driver<A> {
    link: Link<Datagram<A>>,
    id: LinkId,
    record: Option<RecordWriter>,
    lateness: Arc<Recorder>,
    /// From offer to sending, if anybody wants to know.
    delays: Option<Arc<Recorder>>,
    /// Where every packet is kept, and how its addresses are known.
    capture: Option<(CaptureWriter, SidesOf<A>)>,
    /// What became of what the link delivered; `link` and `in_flight` are not kept here.
    counters: DirectionCounters,
}

impl<A: Clone> Driver<A> {
    /// A link whose time begins at `origin`.
    ///
    /// # Errors
    /// A setting out of its range.
    pub(super) fn try_new(
        config: LinkConfig,
        seed: u64,
        id: LinkId,
        origin: Time,
        record: Option<RecordWriter>,
        lateness: Arc<Recorder>,
    ) -> Result<Self, ConfigError> {
        let mut link = Link::try_new(config, seed, id)?;
        link.set_origin(origin);
        Ok(Self {
            link,
            id,
            record,
            lateness,
            delays: None,
            capture: None,
            counters: DirectionCounters::default(),
        })
    }

    /// The same with a record of how long what is sent took.
    pub(super) fn timed(mut self, delays: Arc<Recorder>) -> Self {
        self.delays = Some(delays);
        self
    }

    /// The same with a capture of every packet.
    pub(super) fn captured(mut self, capture: Option<CaptureWriter>, sides: SidesOf<A>) -> Self {
        self.capture = capture.map(|capture| (capture, sides));
        self
    }

    /// Puts a datagram on the link.
    pub(super) fn offer(&mut self, now: Time, datagram: Datagram<A>) {
        let packet = Packet {
            bytes: datagram.contents.len(),
            ecn_capable: datagram.ecn.is_some(),
            payload: datagram,
        };
        self.link.offer(now, packet);
    }

    /// The next packet to send at `now`, with its impairments applied; what was dropped goes on record.
    pub(super) fn poll(&mut self, now: Time) -> Option<Departure<Datagram<A>>> {
        while let Some(mut departure) = self.link.poll(now) {
            if departure.is_delivered() {
                apply_impairments(&mut departure);
                return Some(departure);
            }
            let dropped = Entry::of(self.id.direction, &departure);
            self.put_on_record(dropped, &departure);
        }
        None
    }

    /// When to poll next.
    pub(super) fn poll_timeout(&self) -> Option<Time> {
        self.link.poll_timeout()
    }

    /// Nothing that is offered from `now` on leaves before this.
    pub(super) fn earliest_of_later(&self, now: Time) -> Time {
        self.link.earliest_of_later(now)
    }

    /// Takes note of what became of a packet that was polled, whose sending began at `moment`.
    pub(super) fn finish(
        &mut self,
        departure: &Departure<Datagram<A>>,
        outcome: Outcome,
        moment: Time,
    ) {
        self.lateness.record(departure.due, moment);
        if let Some(delays) = self.delays.as_ref().filter(|_| outcome == Outcome::Sent) {
            delays.record(departure.offered_at, moment);
        }
        let counter = match outcome {
            Outcome::Sent => &mut self.counters.sent,
            Outcome::Blocked => &mut self.counters.blocked,
            Outcome::Failed => &mut self.counters.failed,
            Outcome::Abandoned => &mut self.counters.abandoned,
        };
        counter.count(departure.bytes);
        let mut entry = Entry::of(self.id.direction, departure);
        match &mut entry.end {
            End::Sent { sent, .. } if outcome == Outcome::Sent => *sent = moment,
            end => *end = End::Unsent,
        }
        self.put_on_record(entry, departure);
    }

    fn put_on_record(&self, entry: Entry, departure: &Departure<Datagram<A>>) {
        if let Some(writer) = &self.record {
            writer.push(entry);
        }
        if let Some((capture, sides)) = &self.capture {
            let (corrupted_bit, marked) = match departure.fate {
                Fate::Delivered {
                    corrupted_bit,
                    marked,
                } => (corrupted_bit, marked),
                Fate::Dropped(_) => (None, false),
            };
            capture.push(Event {
                entry,
                corrupted_bit,
                marked,
                sides: sides(&departure.payload.address),
                contents: departure.payload.contents.clone(),
            });
        }
    }

    /// Gives up what is in flight.
    pub(super) fn abandon(&mut self) {
        while let Some(departure) = self.link.poll_delivered(Time::MAX) {
            self.counters.abandoned.count(departure.bytes);
        }
    }

    /// New settings, see [`Link::reconfigure`].
    ///
    /// # Errors
    /// A setting out of its range; the old settings stay.
    pub(super) fn reconfigure(&mut self, now: Time, config: LinkConfig) -> Result<(), ConfigError> {
        self.link.reconfigure(now, config)
    }

    pub(super) fn counters(&self) -> DirectionCounters {
        DirectionCounters {
            link: self.link.counters(),
            in_flight: self.link.in_flight() as u64,
            ..self.counters
        }
    }
}

/// Flips the bit that the link corrupted, and marks what met congestion.
fn apply_impairments<A>(departure: &mut Departure<Datagram<A>>) {
    let Fate::Delivered {
        corrupted_bit,
        marked,
    } = departure.fate
    else {
        return;
    };
    if marked {
        departure.payload.ecn = Some(EcnCodepoint::Ce);
    }
    if let Some(bit) = corrupted_bit {
        flip_bit(&mut departure.payload.contents, bit);
    }
}
