//! What the settings of a link really do to a stream of packets: measured, not read off the words.
//!
//! The link itself is run in virtual time, with a seed of its own, on an even stream or on packets that were
//! recorded, so the answer holds for what the emulator does, order, cut at zero and limit included. Pure.

use std::fmt;
use std::time::Duration;

use mmt_shared::stats::values::{mean, quantile, standard_deviation};
use mmt_shared::time::Time;
use serde::Serialize;

use crate::config::{ConfigError, LinkConfig, Order, Outage, Service};
use crate::counters::Drops;
use crate::direction::LinkId;
use crate::link::Link;
use crate::packet::{DropCause, Fate, Packet};
use crate::record::summary::mean_run;

/// The length of the packets that are taken if nobody gives one, bytes: that of a small update. It matters where
/// there is a rate.
pub const BYTES: usize = 100;
mod offers;

use offers::{Offers, SEED, clamp_rate};
pub use offers::{PACKETS, RATE_RANGE_HZ};

/// What a link does to a stream of packets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Effect {
    /// The rate of the stream, packets per second.
    pub rate_hz: f64,
    /// The mean length of its packets, bytes.
    pub bytes: f64,
    /// Mean delay of what arrives, ms.
    pub mean_ms: f64,
    /// Standard deviation of the delay, ms.
    pub sd_ms: f64,
    /// The delay that 99 % of what arrives does not exceed, ms.
    pub p99_ms: f64,
    /// How much of the mean is waiting for predecessors (`order fifo`), ms.
    pub waiting_ms: f64,
    /// Share of packets lost on the way, 0 to 1: what the settings give in the long run; sampled where
    /// it depends on the number or the time of a packet.
    pub loss: f64,
    /// Mean length of runs of lost packets, packets; 0 if none is lost. Sampled where the model has no
    /// formula for it.
    pub burst_packets: f64,
    /// Share of packets that the bottleneck dropped (queue full, `CoDel`), 0 to 1.
    pub queue_drops: f64,
    /// Share of packets dropped because of the limit, 0 to 1, in the stream sampled.
    pub over_limit: f64,
    /// Share of packets marked as having met congestion, 0 to 1: where the settings mark (`ecn`) the packets
    /// sampled understand it.
    pub marked: f64,
    /// Share of what arrives that arrives after a packet sent later (RFC 4737, section 3), 0 to 1.
    pub reordered: f64,
}

impl LinkConfig {
    /// What these settings do to packets of this length sent at `packet_rate_hz`, over the whole of what they
    /// name: traces, outages, profiles.
    ///
    /// # Errors
    /// A setting out of its range.
    pub fn expected(&self, packet_rate_hz: f64, bytes: usize) -> Result<Effect, ConfigError> {
        let rate_hz = clamp_rate(packet_rate_hz);
        self.effect(&Offers::even(self, rate_hz, bytes))
    }

    /// What these settings do to packets that were offered at these times, with these lengths in bytes; times
    /// count from the start of the link.
    ///
    /// # Errors
    /// A setting out of its range.
    pub fn expected_of(&self, packets: &[(Time, usize)]) -> Result<Effect, ConfigError> {
        self.effect(&Offers::recorded(packets))
    }

    fn effect(&self, offers: &Offers) -> Result<Effect, ConfigError> {
        let stream = Stream::through(self, offers)?;
        let mean_ms = stream.mean_ms();
        // a wait is only that of the order where nothing else waits
        let waits_in_order =
            |link: &Self| link.order == Order::Fifo && link.profile.steps.is_empty();
        let in_order = self.links().all(waits_in_order);
        let free_mean_ms = if in_order && self.jitter_span() > Duration::ZERO {
            Stream::through(&self.unordered(), offers)?.mean_ms()
        } else {
            mean_ms
        };
        let of_all = |packets: u64| packets as f64 / offers.packets.len().max(1) as f64;
        let known_burst = self.loss.mean_burst(offers.rate_hz);
        let known_burst = known_burst.filter(|_| self.only_the_model() && self.then.is_none());
        let drops = &stream.drops;
        let sampled = drops.loss.plus(drops.outage).plus(drops.mtu).packets;
        let lengths = offers.packets.iter().map(|(_, bytes)| *bytes as f64);
        Ok(Effect {
            rate_hz: offers.rate_hz,
            bytes: mean(lengths).unwrap_or_default(),
            mean_ms,
            sd_ms: standard_deviation(&stream.delays_ms).unwrap_or_default(),
            p99_ms: p99(&stream.delays_ms).unwrap_or_default(),
            waiting_ms: (mean_ms - free_mean_ms).max(0.0) + 0.0,
            loss: self.known_loss().unwrap_or(of_all(sampled)),
            burst_packets: known_burst.unwrap_or_else(|| mean_run(&offers.runs(&stream.lost))),
            queue_drops: of_all(drops.queue.plus(drops.codel).packets),
            over_limit: of_all(drops.limit.packets),
            marked: of_all(stream.marked),
            reordered: stream.reordered as f64 / stream.delays_ms.len().max(1) as f64,
        })
    }

    /// The share that is lost in the long run, 0 to 1, where the settings have a formula for it.
    fn known_loss(&self) -> Option<f64> {
        let own = self.loss.share().filter(|_| self.only_the_model())?;
        match &self.then {
            Some(then) => Some(1.0 - (1.0 - own) * (1.0 - then.known_loss()?)),
            None => Some(own),
        }
    }

    /// The same, but that jitter may reorder.
    fn unordered(&self) -> Self {
        Self {
            order: Order::Free,
            then: self.then.as_ref().map(|then| Box::new(then.unordered())),
            ..self.clone()
        }
    }

    /// Whether nothing but the loss model loses packets on this link.
    fn only_the_model(&self) -> bool {
        self.outages.is_empty()
            && self.mtu.is_none()
            && self.replay.is_none()
            && !self.ecn
            && self.profile.steps.is_empty()
    }

    /// After how long all that these settings name has come once; zero where nothing changes with time.
    fn period(&self) -> Duration {
        self.links().map(Self::own_period).max().unwrap_or_default()
    }

    fn own_period(&self) -> Duration {
        let outage = |outage: &Outage| {
            let once = outage.at.saturating_add(outage.length.saturating_mul(2));
            outage.every.map_or(once, |every| outage.at + every)
        };
        let trace = self.rate.as_ref().and_then(|rate| match &rate.service {
            Service::Opportunities(trace) => Some(trace.period()),
            Service::Constant { .. } => None,
        });
        let steps = &self.profile.steps;
        let end = steps.last().map(|step| (step.at + step.ramp) * 2);
        let own = [
            self.outages.iter().map(outage).max(),
            self.replay.as_ref().map(|replay| replay.path.period()),
            trace,
            self.profile.repeat.or(end),
        ];
        let of_steps = steps.iter().map(|step| step.settings.own_period());
        own.into_iter()
            .flatten()
            .chain(of_steps)
            .max()
            .unwrap_or_default()
    }
}

/// A stream after the link.
struct Stream {
    /// Delays of what arrived, ms, in order of arrival.
    delays_ms: Vec<f64>,
    reordered: u64,
    drops: Drops,
    marked: u64,
    /// Which packets were lost on the way, in order of sending.
    lost: Vec<bool>,
}

impl Stream {
    /// The mean delay; zero if nothing arrived.
    fn mean_ms(&self) -> f64 {
        mean(self.delays_ms.iter().copied()).unwrap_or_default()
    }

    fn through(config: &LinkConfig, offers: &Offers) -> Result<Self, ConfigError> {
        let mut link = Link::try_new(config.clone(), SEED, LinkId::UP)?;
        let mut stream = Self {
            delays_ms: Vec::with_capacity(offers.packets.len()),
            reordered: 0,
            drops: Drops::default(),
            marked: 0,
            lost: vec![false; offers.packets.len()],
        };
        let mut newest = 0;
        let marks =
            |link: &LinkConfig| link.ecn || link.profile.steps.iter().any(|step| step.settings.ecn);
        let ecn_capable = config.links().any(marks);
        for (now, bytes) in &offers.packets {
            stream.collect(&mut link, *now, &mut newest);
            let packet = Packet {
                ecn_capable,
                ..Packet::new(*bytes, ())
            };
            link.offer(*now, packet);
        }
        stream.collect(&mut link, Time::MAX, &mut newest);
        stream.drops = link.counters().dropped;
        stream.marked = link.counters().marked.packets;
        Ok(stream)
    }

    fn collect(&mut self, link: &mut Link<()>, now: Time, newest: &mut u64) {
        while let Some(packet) = link.poll(now) {
            match packet.fate {
                Fate::Delivered { .. } => {
                    let delay = packet.due.saturating_since(packet.offered_at);
                    self.delays_ms.push(delay.as_secs_f64() * 1e3);
                    self.reordered += u64::from(packet.number < *newest);
                    *newest = packet.number.max(*newest);
                }
                Fate::Dropped(DropCause::Loss | DropCause::Outage | DropCause::Mtu) => {
                    let number = usize::try_from(packet.number).ok();
                    if let Some(lost) = number.and_then(|number| self.lost.get_mut(number)) {
                        *lost = true;
                    }
                }
                Fate::Dropped(_) => {}
            }
        }
    }
}

/// The 99th percentile; none if nothing arrived.
fn p99(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    quantile(&sorted, 0.99)
}

/// One line for a person.
impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at {} packets/s", self.rate_hz)?;
        if self.bytes != BYTES as f64 {
            write!(f, " of {:.0} bytes", self.bytes)?;
        }
        write!(
            f,
            ": delay mean {:.2} ms, s.d. {:.2} ms, p99 {:.2} ms; loss {:.3} %",
            self.mean_ms,
            self.sd_ms,
            self.p99_ms,
            100.0 * self.loss,
        )?;
        if self.burst_packets > 0.0 {
            write!(f, " in bursts of {:.2} packets", self.burst_packets)?;
        }
        write!(f, "; reordered {:.1} %", 100.0 * self.reordered)?;
        if self.waiting_ms >= 0.005 {
            write!(
                f,
                "; keeping order adds {:.2} ms to the mean",
                self.waiting_ms
            )?;
        }
        if self.queue_drops > 0.0 {
            write!(
                f,
                "; {:.1} % dropped by the queue",
                100.0 * self.queue_drops
            )?;
        }
        if self.marked > 0.0 {
            write!(f, "; {:.3} % marked (ECN)", 100.0 * self.marked)?;
        }
        if self.over_limit > 0.0 {
            write!(
                f,
                "; {:.1} % dropped over the limit",
                100.0 * self.over_limit
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
