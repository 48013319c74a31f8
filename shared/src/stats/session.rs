//! What each side counts and measures in a session, as its farewell reports it to the other.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::model::update::Cause;
use crate::wire::Kind;

/// The report of a farewell: JSON. A number that is not finite is null.
#[must_use]
pub fn to_report(totals: &impl Serialize) -> Vec<u8> {
    serde_json::to_vec(totals).unwrap_or_default()
}

/// What a farewell reports; none if it cannot be read. Keys that are not known are skipped, those that are missing are 0
/// or absent.
#[must_use]
pub fn of_report<T: DeserializeOwned>(report: &[u8]) -> Option<T> {
    serde_json::from_slice(report).ok()
}

/// Messages in datagrams, by type.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct KindCounts {
    /// Commands.
    pub commands: u32,
    /// Updates, repeats included.
    pub updates: u32,
    /// Scenes.
    pub scenes: u32,
    /// Heartbeats.
    pub heartbeats: u32,
    /// What the tool feels.
    pub tools: u32,
}

impl KindCounts {
    /// One more of this type; what is never in a datagram is not counted.
    pub fn count(&mut self, kind: Kind) {
        let count = match kind {
            Kind::Command => &mut self.commands,
            Kind::Update => &mut self.updates,
            Kind::Scene => &mut self.scenes,
            Kind::Heartbeat => &mut self.heartbeats,
            Kind::Tool => &mut self.tools,
            Kind::Hello | Kind::Welcome | Kind::Refused | Kind::Farewell => return,
        };
        *count = count.saturating_add(1);
    }

    /// All of them.
    #[must_use]
    pub fn total(&self) -> u64 {
        u64::from(self.commands)
            + u64::from(self.updates)
            + u64::from(self.scenes)
            + u64::from(self.heartbeats)
            + u64::from(self.tools)
    }
}

/// What a side sent and received. `received` counts each datagram once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Traffic {
    /// Messages sent in datagrams.
    pub sent: KindCounts,
    /// Messages received in datagrams, duplicates and too old ones left out.
    pub received: KindCounts,
    /// Datagrams dropped because their number had been received before.
    pub duplicates: u32,
    /// Datagrams dropped because their number was too old to tell.
    pub too_old: u32,
    /// Datagrams dropped because they did not decode.
    pub malformed: u32,
    /// The socket's UDP datagrams sent: QUIC's own packets included.
    pub udp_datagrams_sent: u64,
    /// Their payload, bytes, without UDP and IP headers.
    pub udp_bytes_sent: u64,
    /// The socket's UDP datagrams received.
    pub udp_datagrams_received: u64,
    /// Their payload, bytes, without UDP and IP headers.
    pub udp_bytes_received: u64,
}

/// The force metrics of a session (docs/metrics.md): each absent if there was nothing to judge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ForceTotals {
    /// PMSE (13)–(15), both axes.
    pub pmse: Option<f64>,
    /// PMSE of the x axis.
    pub pmse_x: Option<f64>,
    /// PMSE of the y axis.
    pub pmse_y: Option<f64>,
    /// PMSE of the magnitude |f|.
    pub pmse_magnitude: Option<f64>,
    /// Relative error of the force vector.
    pub relative_error: Option<f64>,
    /// Share of contact time with the force outside the 7 % JND, 0 to 1.
    pub jnd7_share: Option<f64>,
}

/// One parameter of the model: what the estimator found and what it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Identified {
    /// The last estimate; absent if it could not be seen.
    pub estimate: Option<f64>,
    /// The truth; absent if nobody knows it.
    pub truth: Option<f64>,
}

/// What the slave reports in its farewell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SlaveTotals {
    /// From the welcome to the farewell, ns.
    pub duration_ns: u64,
    /// Datagrams.
    pub traffic: Traffic,
    /// Updates sent for the first time, by cause, in the order of [`Cause::ALL`]; repeats are not here.
    pub updates_by_cause: [u32; Cause::ALL.len()],
    /// HIP samples taken into the play-out buffer.
    pub samples_received: u64,
    /// Force metrics over the samples for which both forces are known.
    pub force: ForceTotals,
    /// m, kg.
    pub mass_kg: Identified,
    /// b, N s/m.
    pub damping_ns_per_m: Identified,
    /// c, N.
    pub friction_n: Identified,
}

/// Updates that the master received and did not apply, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct UpdateDrops {
    /// Its sequence number had been seen: a repeat did its work, or the network duplicated.
    pub duplicate: u32,
    /// A newer one had been seen.
    pub stale: u32,
    /// Its numbers were not accepted.
    pub rejected: u32,
    /// A newer one took its place before a tick could apply it.
    pub superseded: u32,
    /// The session's state did not allow it.
    pub frozen: u32,
}

impl UpdateDrops {
    /// All of them.
    #[must_use]
    pub fn total(&self) -> u64 {
        let causes = [
            self.duplicate,
            self.stale,
            self.rejected,
            self.superseded,
            self.frozen,
        ];
        causes.into_iter().map(u64::from).sum()
    }
}

/// Three quantiles of a time, µs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Quantiles {
    /// Median.
    pub p50: f64,
    /// 99 %.
    pub p99: f64,
    /// 99.9 %.
    pub p999: f64,
}

/// How the master's 1 kHz loop kept its time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LoopTotals {
    /// Ticks run.
    pub ticks: u64,
    /// Whole periods skipped on overrun.
    pub skipped: u64,
    /// Computing time of a tick, µs; absent in virtual time.
    pub cpu_us: Option<Quantiles>,
    /// How late a tick began, µs; absent in virtual time.
    pub lateness_us: Option<Quantiles>,
}

/// What the master reports in its farewell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct MasterTotals {
    /// From the welcome to the farewell, ns.
    pub duration_ns: u64,
    /// Datagrams.
    pub traffic: Traffic,
    /// Updates that reached the model.
    pub updates_applied: u32,
    /// Updates that did not.
    pub updates_dropped: UpdateDrops,
    /// The haptic loop.
    pub haptic_loop: LoopTotals,
}
