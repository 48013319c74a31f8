//! What each end of a session counts and measures, whichever end it is.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::number::{Counts, Number, named};
use crate::channel::datagram_channel::DatagramChannel;
use crate::channel::peer::Loss;
use crate::model::architecture::Architecture;
use crate::stats::histogram::{Histogram, Quantiles};
use crate::stats::session::KindCounts;
use crate::wire::Side;

/// What one end counted and measured of a session. Its farewell carries it, its report prints it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SessionStats {
    /// Whose force the hand felt.
    pub architecture: ArchitectureReport,
    /// Messages that this end sent.
    pub sent: MessagesReport,
    /// Messages that this end received, each once.
    pub received: MessagesReport,
    /// UDP datagrams that left this end's socket.
    pub wire_sent: WireReport,
    /// UDP datagrams that reached it.
    pub wire_received: WireReport,
    /// Round-trip time.
    pub rtt_ms: DelayReport,
    /// What became of this end's datagrams, by the other's echoes.
    pub outgoing: Loss,
    /// What became of the other's datagrams.
    pub incoming: Loss,
    /// Datagrams that this end overtook or could not send while the connection was up: they are in `outgoing`, and the
    /// path did not lose them.
    pub unsent: Option<u64>,
    /// Datagrams that reached this end's host and not its loop: they are in `incoming`.
    pub unread: Option<u64>,
    /// The emulated network on what this end sends.
    pub emulation: EmulationReport,
    /// The 1 kHz loop.
    pub timing: LoopReport,
    /// What this end dropped or refused, by name.
    pub drops: Counts,
}

impl SessionStats {
    /// What the channel of an end counted in `duration_s` (s), with so many repeats among the updates.
    pub fn new(side: Side, channel: &DatagramChannel, repeats: u64, duration_s: f64) -> Self {
        let (counts, peer) = (channel.counts(), channel.peer());
        let up = |counts| MessagesReport::up(counts, duration_s);
        let down = |counts| MessagesReport::down(counts, repeats, duration_s);
        let (sent, received) = match side {
            Side::Master => (up(&counts.sent), down(&counts.received)),
            Side::Slave => (down(&counts.sent), up(&counts.received)),
        };
        Self {
            sent,
            received,
            rtt_ms: peer.round_trip().histogram().into(),
            outgoing: peer.outgoing(),
            incoming: peer.incoming(),
            drops: named([
                ("datagrams_duplicate", counts.datagrams_duplicate),
                ("datagrams_implausible", counts.datagrams_implausible),
                ("datagrams_malformed", counts.datagrams_malformed),
                ("datagrams_too_old", counts.datagrams_too_old),
                ("echoes_implausible", peer.echoes_implausible()),
                ("messages_unsendable", counts.messages_unsendable),
            ]),
            ..Self::default()
        }
    }

    /// Shares that the path lost of what this end sent and of what it received, without what either host dropped. Without
    /// the farewell of the other end nobody knows what became of the last datagrams: none.
    pub(super) fn losses(&self, other: Option<&Self>) -> (Number, Number) {
        let Some(other) = other else {
            return (Number::ABSENT, Number::ABSENT);
        };
        let on_the_path = |counted: Loss, from: &Self, to: &Self| {
            let path = counted.on_the_path(from.unsent.unwrap_or(0), to.unread.unwrap_or(0));
            Number::from(path.share())
        };
        (
            on_the_path(self.outgoing, self, other),
            on_the_path(self.incoming, other, self),
        )
    }

    /// Adds drops by name.
    pub fn add_drops<'a>(&mut self, drops: impl IntoIterator<Item = (&'a str, u64)>) {
        self.drops.extend(named(drops));
    }
}

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// Whose force the hand felt.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ArchitectureReport {
    /// `mmt` or `tdpa`.
    pub name: Option<String>,
    /// The round trip of the tool's force in the end, smoothed, play-out included, ms; null with `mmt`.
    pub round_trip_ms: Number,
}

impl ArchitectureReport {
    /// Its name, and the round trip (s) of the tool's force at the end that measures it.
    pub fn new(architecture: Architecture, round_trip_s: Option<f64>) -> Self {
        Self {
            name: Some(architecture.name().to_owned()),
            round_trip_ms: round_trip_s.map(|s| s * 1e3).into(),
        }
    }
}

/// Application messages in one direction; a kind that does not go this way is null.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct MessagesReport {
    /// Commands: packed HIP samples.
    pub commands: Option<u64>,
    /// Updates, repeats included.
    pub updates: Option<u64>,
    /// Repeats among them: where they are received, those that repeat a known update.
    pub repeats: Option<u64>,
    /// Scenes.
    pub scenes: Option<u64>,
    /// What the tool feels, where the hand may feel it too.
    pub tools: Option<u64>,
    /// Heartbeats.
    pub heartbeats: Option<u64>,
    /// Messages of all kinds per second, 1/s.
    pub rate_hz: Number,
}

impl MessagesReport {
    /// What goes from master to slave in `duration_s` (s).
    pub fn up(counts: &KindCounts, duration_s: f64) -> Self {
        Self {
            commands: Some(counts.commands),
            heartbeats: Some(counts.heartbeats),
            rate_hz: Number::rate(counts.total() as f64, duration_s),
            ..Self::default()
        }
    }

    /// What goes from slave to master in `duration_s` (s), with so many repeats among the updates.
    pub fn down(counts: &KindCounts, repeats: u64, duration_s: f64) -> Self {
        Self {
            updates: Some(counts.updates),
            repeats: Some(repeats),
            scenes: Some(counts.scenes),
            tools: Some(counts.tools),
            heartbeats: Some(counts.heartbeats),
            rate_hz: Number::rate(counts.total() as f64, duration_s),
            ..Self::default()
        }
    }
}

/// UDP datagrams in one direction, as one end's socket counted them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WireReport {
    /// Datagrams.
    pub datagrams: Option<u64>,
    /// Bytes of UDP payload.
    pub bytes: Option<u64>,
    /// Datagrams per second, 1/s.
    pub rate_hz: Number,
    /// Bits per second with IP and UDP headers, bit/s.
    pub bits_per_s: Number,
    /// IP and UDP headers of one datagram, bytes: 28 for IPv4, 48 for IPv6.
    pub header_bytes: Option<u64>,
}

impl WireReport {
    /// From a socket's own counts over a duration (s).
    pub fn new(datagrams: u64, bytes: u64, header_bytes: u64, duration_s: f64) -> Self {
        let all_bytes = bytes as f64 + header_bytes as f64 * datagrams as f64;
        Self {
            datagrams: Some(datagrams),
            bytes: Some(bytes),
            rate_hz: Number::rate(datagrams as f64, duration_s),
            bits_per_s: Number::rate(8.0 * all_bytes, duration_s),
            header_bytes: Some(header_bytes),
        }
    }
}

/// Two quantiles of a delay, ms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DelayReport {
    /// Median.
    pub p50: Number,
    /// 99 % were at most this.
    pub p99: Number,
}

impl From<&Histogram> for DelayReport {
    /// Absent if no delay was counted.
    fn from(delays: &Histogram) -> Self {
        let quantile = |q| delays.quantile(q).map(ms).into();
        Self {
            p50: quantile(0.5),
            p99: quantile(0.99),
        }
    }
}

/// The emulated network in front of the socket that sends in a direction, in real time; null without one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EmulationReport {
    /// Datagrams that left it since the socket was made.
    pub released: Option<u64>,
    /// How long after their times they left, µs.
    pub late_us: LateReport,
    /// Whether the host was too slow for the run to be about this network: p99.9 above 1 ms.
    pub degraded: Option<bool>,
}

/// Release lateness, µs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LateReport {
    /// Median.
    pub p50: Number,
    /// 99 % were at most this.
    pub p99: Number,
    /// Largest.
    pub max: Number,
}

/// A 1 kHz loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LoopReport {
    /// Ticks run.
    pub ticks: Option<u64>,
    /// Whole periods skipped on overrun.
    pub skipped: Option<u64>,
    /// Computing time of a tick, µs.
    pub cpu_us: QuantilesReport,
    /// How late a tick began, µs.
    pub lateness_us: QuantilesReport,
}

/// Quantiles of a distribution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct QuantilesReport {
    /// Median.
    pub p50: Number,
    /// 99 %.
    pub p99: Number,
    /// 99.9 %.
    pub p999: Number,
}

impl From<&Quantiles> for QuantilesReport {
    /// µs; absent if nothing was counted.
    fn from(of: &Quantiles) -> Self {
        let us = |time: Duration| (of.count > 0).then_some(time.as_secs_f64() * 1e6).into();
        Self {
            p50: us(of.p50),
            p99: us(of.p99),
            p999: us(of.p999),
        }
    }
}
