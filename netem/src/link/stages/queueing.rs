//! What happens before the bottleneck: who finds room, what cross traffic brings, and what is sent on.

use std::cmp::Reverse;
use std::time::Duration;

use super::{Before, Stages, Transit};
use crate::config::{Cross, Rate};
use crate::link::bottleneck::{Ahead, Sent};
use crate::link::by_time::ByTime;
use crate::link::timeline::Timeline;
use crate::packet::{DropCause, Fate};

impl<T> Stages<T> {
    /// Puts a packet of the cross traffic before the bottleneck, or drops it.
    fn admit_cross(&mut self, timeline: &Timeline, now: Duration, cross: Cross) {
        let (settings, bytes) = (timeline.at(now), cross.bytes as usize);
        let Some(rate) = &settings.rate else {
            return;
        };
        self.counters.cross.offered.count(bytes);
        let weight = rate.framing.weight(bytes);
        let most = settings.limit.packets as usize;
        let crowded = self.bottleneck.len().saturating_sub(self.waiting) >= most;
        if crowded || self.makes_room(timeline, now, rate, weight).is_err() {
            self.counters.cross.dropped.count(bytes);
        } else {
            self.bottleneck
                .push(Before::Cross(bytes), weight, false, now);
        }
    }

    /// The weight of a packet before the bottleneck, bytes, if it finds room on the link.
    pub(super) fn finds_room(
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
        let weight = rate.framing.weight(bytes);
        self.makes_room(timeline, now, rate, weight)?;
        Ok(weight)
    }

    /// Whether there is room before the bottleneck for `weight` bytes, once others are driven out.
    fn makes_room(
        &mut self,
        timeline: &Timeline,
        now: Duration,
        rate: &Rate,
        weight: u64,
    ) -> Result<(), DropCause> {
        let queue = &timeline.at(now).queue;
        // nobody is driven out for one that finds no room all the same
        let in_vain =
            queue.drop_head && (self.bottleneck).is_full(rate, queue, now, weight, Ahead::Begun);
        if in_vain {
            return Err(DropCause::Queue);
        }
        while (self.bottleneck).is_full(rate, queue, now, weight, Ahead::All) {
            let victim = queue.drop_head.then(|| self.bottleneck.drop_head(now));
            let victim = victim.flatten().ok_or(DropCause::Queue)?;
            self.pass_on(timeline, victim);
        }
        Ok(())
    }

    /// Lets everything happen that happens by `now` to the packets on the link. Cross traffic that none of them
    /// meets comes later, before the next packet does.
    pub(in crate::link) fn advance(&mut self, timeline: &Timeline, now: Duration) {
        while self.waiting > 0 && self.goes_on(timeline, now) {}
    }

    /// Lets the next thing happen that happens by `now`; whether there was one.
    pub(super) fn goes_on(&mut self, timeline: &Timeline, now: Duration) -> bool {
        let next = self.bottleneck.next_event(timeline);
        let next = next.filter(|at| *at <= now);
        if timeline.crossed {
            let until = next.unwrap_or(now);
            if let Some((at, cross)) = self.arrivals.next(timeline, until) {
                self.admit_cross(timeline, at, cross);
                return true;
            }
        }
        let Some(at) = next else {
            return false;
        };
        if let Some(sent) = self.bottleneck.poll(timeline, at) {
            self.pass_on(timeline, sent);
        }
        true
    }

    /// Sends on what left the bottleneck.
    fn pass_on(&mut self, timeline: &Timeline, sent: Sent<Before<T>>) {
        let packet = match sent.packet {
            Before::Packet(packet) => packet,
            Before::Cross(bytes) if sent.dropped.is_some() => {
                return self.counters.cross.dropped.count(bytes);
            }
            Before::Cross(bytes) => return self.counters.cross.sent.count(bytes),
        };
        if sent.dropped.is_some() {
            self.pass_on_lost(packet.as_lost(timeline.time(sent.at), false));
        }
        let Transit {
            mut departure,
            place,
            lineage,
            ecn_capable,
            replayed,
            way,
        } = packet;
        self.waiting = self.waiting.saturating_sub(1);
        departure.queued = departure.queued.saturating_add(sent.queued);
        departure.due = timeline.time(sent.at);
        if let Some(cause) = sent.dropped {
            self.forget(departure.bytes);
            self.counters.dropped.count(cause, departure.bytes);
            if !departure.copy {
                self.report(timeline, place, departure, cause);
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
        self.out.push(Reverse(ByTime {
            departure,
            place,
            lineage,
            ecn_capable,
        }));
    }
}
