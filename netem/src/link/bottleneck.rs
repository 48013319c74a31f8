//! The bottleneck: packets find room or not, wait their turn, and are sent at the rate of the moment.
//!
//! First in, first out. Nothing is decided before its time: each call carries the queue on to `now` under the
//! settings in force at each moment, so that a change of rate or trace applies to what waits.

use std::collections::VecDeque;
use std::time::Duration;

mod wire;

use super::codel::CodelState;
use super::timeline::Timeline;
use crate::config::{LinkConfig, Queue, Rate, Service};
use crate::packet::DropCause;
use crate::trace::mahimahi::OPPORTUNITY_BYTES;
use wire::{Opportunity, TimeLeft, mtu_time, sending_time};

/// Packets made room for at the start; more take memory as they come, up to the limit.
pub(super) const ROOM: usize = 1024;

/// The state of the bottleneck. Times are counted from the origin of the link.
#[derive(Clone, Debug)]
pub(super) struct Bottleneck<P> {
    /// The packets that wait, the first perhaps being sent.
    waiting: VecDeque<Waiting<P>>,
    /// The weight of them all, bytes.
    bytes: u64,
    /// What is left to send of them, but for what is on the wire, bytes.
    bytes_left: u64,
    /// How long that takes at a constant rate.
    time_left: TimeLeft,
    /// The first packet is on the wire until then.
    sending_until: Option<Duration>,
    /// The wire sends nothing more before then.
    free_at: Duration,
    opportunity: Opportunity,
    codel: CodelState,
}

/// A packet before the bottleneck.
#[derive(Clone, Debug)]
struct Waiting<P> {
    packet: P,
    arrived: Duration,
    /// What it weighs on the wire, and what of that is left to send, bytes.
    weight: u64,
    left: u64,
    ecn_capable: bool,
    /// When its sending began, and whether `CoDel` marked it then.
    began: Option<Duration>,
    marked: bool,
}

/// A packet that left the bottleneck.
#[derive(Clone, Debug)]
pub(super) struct Sent<P> {
    pub(super) packet: P,
    /// When.
    pub(super) at: Duration,
    /// How long it waited until its sending began, or until it was dropped.
    pub(super) queued: Duration,
    /// Whether `CoDel` marked it.
    pub(super) marked: bool,
    /// Why it was dropped, if it was.
    pub(super) dropped: Option<DropCause>,
}

/// Who stands before a packet that comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ahead {
    /// All that wait.
    All,
    /// Only the one whose sending has begun.
    Begun,
}

/// What the bottleneck does next.
enum Next {
    /// Something at this time, under the settings then.
    At(Duration),
    /// The trace gives the next opportunity at `at`; the settings stay until then.
    Opportunity { at: Duration },
    /// The settings change first.
    Change(Duration),
}

impl<P> Bottleneck<P> {
    pub(super) fn new(limit: u32) -> Self {
        Self {
            waiting: VecDeque::with_capacity(ROOM.min(limit as usize)),
            bytes: 0,
            bytes_left: 0,
            time_left: TimeLeft::default(),
            sending_until: None,
            free_at: Duration::ZERO,
            opportunity: Opportunity::default(),
            codel: CodelState::default(),
        }
    }

    /// Packets waiting and being sent.
    pub(super) fn len(&self) -> usize {
        self.waiting.len()
    }

    /// From `now` on other settings are in force; carry the queue on to `now` first.
    pub(super) fn change_at(&mut self, now: Duration) {
        self.free_at = self.free_at.max(now);
    }

    /// Whether a packet that weighs `weight` finds no room at `now` behind those `ahead`.
    pub(super) fn is_full(
        &mut self,
        rate: &Rate,
        queue: &Queue,
        now: Duration,
        weight: u64,
        ahead: Ahead,
    ) -> bool {
        let (packets, bytes) = match (ahead, self.begun()) {
            (Ahead::All, _) => (self.waiting.len(), self.bytes),
            (Ahead::Begun, Some(begun)) => (1, begun.weight),
            (Ahead::Begun, None) => (0, 0),
        };
        queue.packets.is_some_and(|limit| packets >= limit as usize)
            || queue
                .bytes
                .is_some_and(|limit| bytes.saturating_add(weight) > limit)
            || queue
                .wait
                .is_some_and(|limit| self.wait(&rate.service, now, ahead) > limit)
    }

    /// The packet whose sending has begun.
    fn begun(&self) -> Option<&Waiting<P>> {
        self.waiting.front().filter(|first| first.began.is_some())
    }

    /// How long a packet that comes at `now` behind those `ahead` waits until its sending begins, if the settings stay.
    fn wait(&mut self, service: &Service, now: Duration, ahead: Ahead) -> Duration {
        let bytes_left = match ahead {
            Ahead::All => self.bytes_left,
            Ahead::Begun => self.begun().map_or(0, |begun| begun.left),
        };
        let free_at = self.sending_until.unwrap_or(self.free_at);
        match service {
            Service::Constant { bits_per_second } => {
                if self.time_left.bits_per_second != *bits_per_second {
                    self.count_time_left(*bits_per_second);
                }
                let on_the_wire = free_at.saturating_sub(now);
                on_the_wire.saturating_add(match ahead {
                    Ahead::All => self.time_left.total,
                    Ahead::Begun => sending_time(*bits_per_second, bytes_left),
                })
            }
            Service::Opportunities(trace) => {
                let (mut number, left) = self.opportunity.at(trace, free_at.max(now));
                if let Some(beyond) = bytes_left.checked_sub(left) {
                    number = number.saturating_add(1 + beyond / OPPORTUNITY_BYTES);
                }
                trace.time(number).saturating_sub(now)
            }
        }
    }

    fn count_time_left(&mut self, bits_per_second: u64) {
        let times = self.waiting.iter();
        let times = times.map(|waiting| sending_time(bits_per_second, waiting.left));
        self.time_left = TimeLeft {
            bits_per_second,
            total: times.fold(Duration::ZERO, Duration::saturating_add),
        };
    }

    /// Puts a packet at the end of the queue.
    pub(super) fn push(&mut self, packet: P, weight: u64, ecn_capable: bool, now: Duration) {
        self.bytes = self.bytes.saturating_add(weight);
        self.bytes_left = self.bytes_left.saturating_add(weight);
        self.time_left.add(weight);
        self.waiting.push_back(Waiting {
            packet,
            arrived: now,
            weight,
            left: weight,
            ecn_capable,
            began: None,
            marked: false,
        });
    }

    /// Drops the packet that has waited longest, but for one whose sending has begun.
    pub(super) fn drop_head(&mut self, now: Duration) -> Option<Sent<P>> {
        let begun = usize::from(self.begun().is_some());
        self.take(begun, now, Some(DropCause::Queue))
    }

    /// The next packet that has left the bottleneck by `now`.
    pub(super) fn poll(&mut self, timeline: &Timeline, now: Duration) -> Option<Sent<P>> {
        loop {
            match self.next(timeline)? {
                Next::At(at) if at <= now => {
                    if let Some(sent) = self.serve(timeline.at(at), at) {
                        return Some(sent);
                    }
                }
                Next::Opportunity { at } if at <= now => {
                    if let Some(sent) = self.use_opportunity(timeline.at(at), at) {
                        return Some(sent);
                    }
                }
                Next::Change(at) if at <= now => self.change_at(at),
                _ => return None,
            }
        }
    }

    /// When to poll next.
    pub(super) fn next_event(&self, timeline: &Timeline) -> Option<Duration> {
        self.next(timeline).map(|next| match next {
            Next::At(at) | Next::Opportunity { at } | Next::Change(at) => at,
        })
    }

    fn next(&self, timeline: &Timeline) -> Option<Next> {
        let first = self.waiting.front()?;
        if let Some(until) = self.sending_until {
            return Some(Next::At(until));
        }
        let ready = self.free_at.max(first.arrived);
        let Some(Service::Opportunities(trace)) = service(timeline.at(ready)) else {
            return Some(Next::At(ready));
        };
        let (number, _) = self.opportunity.at(trace, ready);
        let at = trace.time(number);
        let change = timeline.next_change(ready).filter(|change| *change <= at);
        Some(change.map_or(Next::Opportunity { at }, Next::Change))
    }

    /// At a constant rate, or at none: ends the sending of the first packet, or begins it.
    fn serve(&mut self, settings: &LinkConfig, now: Duration) -> Option<Sent<P>> {
        if self.sending_until.take().is_some() {
            self.free_at = now;
            return self.take(0, now, None);
        }
        let Some(Service::Constant { bits_per_second }) = service(settings) else {
            self.begin(now);
            return self.take(0, now, None);
        };
        if self.codel_drops(settings, now) {
            return self.take(0, now, Some(DropCause::Codel));
        }
        self.begin(now);
        let first = self.waiting.front_mut()?;
        let left = std::mem::take(&mut first.left);
        self.bytes_left = self.bytes_left.saturating_sub(left);
        self.time_left.remove(left);
        self.sending_until = Some(now.saturating_add(sending_time(*bits_per_second, left)));
        None
    }

    /// Sends of the first packet what the opportunity at `now` carries.
    fn use_opportunity(&mut self, settings: &LinkConfig, now: Duration) -> Option<Sent<P>> {
        let Some(Service::Opportunities(trace)) = service(settings) else {
            return None;
        };
        let ready = self.free_at.max(self.waiting.front()?.arrived);
        if self.codel_drops(settings, now) {
            return self.take(0, now, Some(DropCause::Codel));
        }
        self.begin(now);
        let first = self.waiting.front_mut()?;
        let sent = self.opportunity.send(trace, ready, first.left);
        first.left = first.left.saturating_sub(sent);
        let done = first.left == 0;
        self.bytes_left = self.bytes_left.saturating_sub(sent);
        self.time_left = TimeLeft::default();
        self.free_at = now;
        if done { self.take(0, now, None) } else { None }
    }

    fn begin(&mut self, now: Duration) {
        if let Some(first) = self.waiting.front_mut() {
            first.began.get_or_insert(now);
        }
    }

    /// Whether `CoDel` drops the first packet, whose sending would begin now; one that understands is marked
    /// instead.
    fn codel_drops(&mut self, settings: &LinkConfig, now: Duration) -> bool {
        let (Some(first), Some(codel), Some(rate)) = (
            self.waiting
                .front_mut()
                .filter(|first| first.began.is_none()),
            settings.queue.codel,
            &settings.rate,
        ) else {
            return false;
        };
        let target = codel.target.max(mtu_time(&rate.service));
        let wait = now.saturating_sub(first.arrived);
        let hit = self.codel.drops(target, codel.interval, now, wait);
        first.marked = hit && settings.ecn && first.ecn_capable;
        hit && !first.marked
    }

    /// Takes a packet out of the queue.
    fn take(&mut self, at: usize, now: Duration, dropped: Option<DropCause>) -> Option<Sent<P>> {
        let out = self.waiting.remove(at)?;
        self.bytes = self.bytes.saturating_sub(out.weight);
        self.bytes_left = self.bytes_left.saturating_sub(out.left);
        self.time_left.remove(out.left);
        if self.waiting.is_empty() {
            self.codel.idle();
        }
        Some(Sent {
            packet: out.packet,
            at: now,
            queued: out.began.unwrap_or(now).saturating_sub(out.arrived),
            marked: out.marked,
            dropped,
        })
    }
}

fn service(settings: &LinkConfig) -> Option<&Service> {
    settings.rate.as_ref().map(|rate| &rate.service)
}
