//! What the settings of a link really do to a stream of packets: measured, not read off the words.
//!
//! The link itself is run in virtual time on an even stream, with a seed of its own, so the answer holds
//! for what the emulator does, order, cut at zero and limit included. Pure.

use std::fmt;
use std::time::Duration;

use mmt_shared::time::Time;
use serde::Serialize;

use crate::config::{ConfigError, Correlation, LinkConfig, Loss, Order};
use crate::counters::Drops;
use crate::direction::LinkId;
use crate::link::Link;
use crate::packet::{DropCause, Fate, Packet};
use crate::record::summary::{mean_run, nearest_rank, runs};

/// Packets sampled. The mean of a delay is then known to 0.4 % of its standard deviation; where delays or
/// losses hang together in time, ten times as many are.
pub const PACKETS: u32 = 60_000;
/// The length of the packets sampled, bytes: that of a small update. It matters where there is a rate.
pub const BYTES: usize = 100;
/// The rates that can be asked for, packets per second; others are taken to the nearest.
pub const RATE_RANGE_HZ: (f64, f64) = (0.01, 1e6);

const SEED: u64 = 0x6d6d_745f_6e65_7465;

/// What a link does to an even stream of packets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Effect {
    /// The rate of the stream, packets per second.
    pub rate_hz: f64,
    /// Mean delay of what arrives, ms.
    pub mean_ms: f64,
    /// Standard deviation of the delay, ms.
    pub sd_ms: f64,
    /// The delay that 99 % of what arrives does not exceed, ms.
    pub p99_ms: f64,
    /// How much of the mean is waiting for predecessors (`order fifo`), ms.
    pub waiting_ms: f64,
    /// Share of packets lost on the way, 0 to 1: what the settings say in the long run; sampled where
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
    /// What these settings do to packets sent at `packet_rate_hz`.
    ///
    /// # Errors
    /// A setting out of its range.
    pub fn expected(&self, packet_rate_hz: f64) -> Result<Effect, ConfigError> {
        let (config, rate_hz) = (self, clamp_rate(packet_rate_hz));
        let stream = Stream::through(config, rate_hz)?;
        let unordered = LinkConfig {
            order: Order::Free,
            ..config.clone()
        };
        let mean_ms = mean(&stream.delays_ms);
        let free_mean_ms = match config.order {
            // a wait is only that of the order where nothing else waits
            Order::Fifo if config.profile.steps.is_empty() => {
                mean(&Stream::through(&unordered, rate_hz)?.delays_ms)
            }
            Order::Fifo | Order::Free => mean_ms,
        };
        let of_all = |packets: u64| packets as f64 / f64::from(sample_size(config));
        let only_the_model = config.outages.is_empty()
            && config.mtu.is_none()
            && config.replay.is_none()
            && !config.ecn
            && config.profile.steps.is_empty();
        let known = config.loss.share().filter(|_| only_the_model);
        let known_burst = config.loss.mean_burst(rate_hz).filter(|_| only_the_model);
        let drops = &stream.drops;
        let sampled = drops.loss.plus(drops.outage).plus(drops.mtu).packets;
        Ok(Effect {
            rate_hz,
            mean_ms,
            sd_ms: standard_deviation(&stream.delays_ms, mean_ms),
            p99_ms: p99(&stream.delays_ms),
            waiting_ms: (mean_ms - free_mean_ms).max(0.0),
            loss: known.unwrap_or(of_all(sampled)),
            burst_packets: known_burst
                .unwrap_or_else(|| mean_run(&runs(stream.lost.iter().copied()))),
            queue_drops: of_all(drops.queue.plus(drops.codel).packets),
            over_limit: of_all(drops.limit.packets),
            marked: of_all(stream.marked),
            reordered: stream.reordered as f64 / stream.delays_ms.len().max(1) as f64,
        })
    }
}

fn clamp_rate(rate_hz: f64) -> f64 {
    let (low, high) = RATE_RANGE_HZ;
    // NaN compares with nothing, and so becomes the lowest
    if rate_hz >= low {
        rate_hz.min(high)
    } else {
        low
    }
}

/// How many packets show what these settings do.
fn sample_size(config: &LinkConfig) -> u32 {
    let in_time = matches!(config.correlation, Correlation::InTime(_))
        || matches!(config.loss, Loss::Bursts(_))
        || !config.outages.is_empty()
        || !config.profile.steps.is_empty();
    if in_time { 10 * PACKETS } else { PACKETS }
}

/// An even stream after the link.
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
    fn through(config: &LinkConfig, rate_hz: f64) -> Result<Self, ConfigError> {
        let mut link = Link::try_new(config.clone(), SEED, LinkId::UP)?;
        let packets = sample_size(config);
        let mut stream = Self {
            delays_ms: Vec::with_capacity(PACKETS as usize),
            reordered: 0,
            drops: Drops::default(),
            marked: 0,
            lost: vec![false; packets as usize],
        };
        let mut newest = 0;
        let ecn_capable = config.ecn || config.profile.steps.iter().any(|step| step.settings.ecn);
        for packet in 0..packets {
            let now = Time::ZERO + Duration::from_secs_f64(f64::from(packet) / rate_hz);
            stream.collect(&mut link, now, &mut newest);
            let packet = Packet {
                ecn_capable,
                ..Packet::new(BYTES, ())
            };
            link.offer(now, packet);
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

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn standard_deviation(values: &[f64], mean: f64) -> f64 {
    let sum: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
    (sum / values.len().max(1) as f64).sqrt()
}

/// Nearest-rank 99th percentile; zero if nothing arrived.
fn p99(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    nearest_rank(&sorted, 0.99)
}

/// One line for a person.
impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "at {} packets/s: delay mean {:.2} ms, s.d. {:.2} ms, p99 {:.2} ms; loss {:.3} %",
            self.rate_hz,
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
