//! The bottleneck: packets wait their turn, are sent at a rate, or find no room.
//!
//! First in, first out: nothing that comes later changes what happens to a packet, so its departure is
//! known when it arrives.

use std::collections::VecDeque;
use std::time::Duration;

use super::codel::CodelState;
use crate::config::{LinkConfig, Queue, Rate, Service};
use crate::fate::DropCause;
use crate::trace::mahimahi::OPPORTUNITY_BYTES;

/// A packet that is heavier than this does not make `CoDel` wait longer: the usual MTU.
const MTU_BYTES: u64 = 1500;

/// The state of the bottleneck. Times are counted from the start of the link.
#[derive(Clone, Debug, Default)]
pub(super) struct Bottleneck {
    /// When it is done with all that it took.
    free_at: Duration,
    /// The opportunity in use, and the bytes left in it.
    opportunity: u64,
    left_bytes: u64,
    /// When each packet will be gone, and its weight.
    waiting: VecDeque<(Duration, u64)>,
    waiting_bytes: u64,
    room: usize,
    codel: CodelState,
}

impl Bottleneck {
    /// Makes room, so that no packet ever has to.
    pub(super) fn prepare<'a>(&mut self, settings: impl Iterator<Item = &'a LinkConfig>) {
        let limits = settings.filter(|config| config.rate.is_some());
        let room = limits.map(|config| config.limit as usize).max();
        self.room = room.unwrap_or(0).max(self.waiting.len());
        self.waiting
            .reserve(self.room.saturating_sub(self.waiting.len()));
    }

    /// Packets waiting and being sent.
    pub(super) fn backlog(&self) -> usize {
        self.waiting.len()
    }

    /// When the packet that arrives at `now` leaves the bottleneck, or why it does not; also whether `CoDel`
    /// marks it, which it does instead of dropping if `spared`.
    pub(super) fn pass(
        &mut self,
        rate: &Rate,
        queue: &Queue,
        now: Duration,
        bytes: usize,
        spared: bool,
    ) -> Result<(Duration, bool), DropCause> {
        self.forget(now);
        let weight = rate.framing.weight(bytes);
        let idle = self.free_at <= now;
        let begins = self.begin(&rate.service, now);
        let wait = begins.saturating_sub(now);
        if self.is_full(queue, weight, wait) {
            return Err(DropCause::Queue);
        }
        let mut marked = false;
        if let Some(codel) = queue.codel {
            let target = codel.target.max(sending_time(&rate.service, MTU_BYTES));
            let interval = codel.interval;
            let hit = self.codel.drops(target, interval, begins, wait, idle);
            if hit && !spared {
                self.wait(begins, weight);
                return Err(DropCause::Codel);
            }
            marked = hit;
        }
        let gone = self.send(&rate.service, begins, weight);
        self.wait(gone, weight);
        Ok((gone, marked))
    }

    fn forget(&mut self, now: Duration) {
        while let Some((_, weight)) = self.waiting.front().filter(|(gone, _)| *gone <= now) {
            self.waiting_bytes = self.waiting_bytes.saturating_sub(*weight);
            self.waiting.pop_front();
        }
    }

    fn wait(&mut self, gone: Duration, weight: u64) {
        self.waiting.push_back((gone, weight));
        self.waiting_bytes = self.waiting_bytes.saturating_add(weight);
    }

    fn is_full(&self, queue: &Queue, weight: u64, wait: Duration) -> bool {
        let packets = self.waiting.len();
        packets >= self.room
            || queue.wait.is_some_and(|limit| wait > limit)
            || queue.packets.is_some_and(|limit| packets >= limit as usize)
            || queue
                .bytes
                .is_some_and(|limit| self.waiting_bytes.saturating_add(weight) > limit)
    }

    /// When the sending of the next packet begins.
    fn begin(&mut self, service: &Service, now: Duration) -> Duration {
        match service {
            Service::Constant { .. } => self.free_at.max(now),
            Service::Opportunities(trace) => {
                let next = trace.first_from(now);
                if next > self.opportunity || self.left_bytes == 0 {
                    self.opportunity = next.max(self.opportunity);
                    self.left_bytes = OPPORTUNITY_BYTES;
                }
                trace.time(self.opportunity)
            }
        }
    }

    /// Sends a packet from `begins` on; returns when it is gone.
    fn send(&mut self, service: &Service, begins: Duration, weight: u64) -> Duration {
        let gone = match service {
            Service::Constant { .. } => begins.saturating_add(sending_time(service, weight)),
            Service::Opportunities(trace) => {
                let mut rest = weight;
                while rest > self.left_bytes {
                    rest -= self.left_bytes;
                    self.opportunity = self.opportunity.saturating_add(1);
                    self.left_bytes = OPPORTUNITY_BYTES;
                }
                self.left_bytes -= rest;
                let gone = trace.time(self.opportunity);
                if self.left_bytes == 0 {
                    self.opportunity = self.opportunity.saturating_add(1);
                }
                gone
            }
        };
        self.free_at = gone;
        gone
    }
}

/// How long `bytes` bytes take on the wire; on a trace, on average.
fn sending_time(service: &Service, bytes: u64) -> Duration {
    match service {
        Service::Constant { bits_per_second } => {
            let rate = u128::from((*bits_per_second).max(1));
            let nanos = (u128::from(bytes) * 8_000_000_000 + rate / 2) / rate;
            Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
        }
        Service::Opportunities(trace) => {
            let nanos = bytes as f64 * 8e9 / trace.mean_bit_s();
            Duration::from_nanos(nanos as u64)
        }
    }
}
