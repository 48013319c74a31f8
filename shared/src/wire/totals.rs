//! What each side counted and measured in a session, as its farewell tells the other.

use serde::{Deserialize, Serialize};

use super::error::{FieldError, finite};
use crate::model::update::Cause;

/// Messages in datagrams, by type.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KindCounts {
    /// Commands, with and without the hand's port.
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
pub struct Identified {
    /// The last estimate; absent if it could not be seen.
    pub estimate: Option<f64>,
    /// The truth; absent if nobody knows it.
    pub truth: Option<f64>,
}

/// What the slave tells in its farewell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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

/// What the master tells in its farewell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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

impl SlaveTotals {
    pub(super) fn check(&self) -> Result<(), FieldError> {
        let (force, m) = (&self.force, &self.mass_kg);
        let (b, c) = (&self.damping_ns_per_m, &self.friction_n);
        for (field, value) in [
            ("pmse", force.pmse),
            ("pmse_x", force.pmse_x),
            ("pmse_y", force.pmse_y),
            ("pmse_magnitude", force.pmse_magnitude),
            ("relative_error", force.relative_error),
            ("jnd7_share", force.jnd7_share),
            ("mass_kg.estimate", m.estimate),
            ("mass_kg.truth", m.truth),
            ("damping_ns_per_m.estimate", b.estimate),
            ("damping_ns_per_m.truth", b.truth),
            ("friction_n.estimate", c.estimate),
            ("friction_n.truth", c.truth),
        ] {
            finite(field, value.unwrap_or_default())?;
        }
        Ok(())
    }
}

impl MasterTotals {
    pub(super) fn check(&self) -> Result<(), FieldError> {
        let quantiles = |name, quantiles: Option<Quantiles>| {
            let Quantiles { p50, p99, p999 } = quantiles.unwrap_or_default();
            [p50, p99, p999]
                .into_iter()
                .try_for_each(|value| finite(name, value))
        };
        quantiles("cpu_us", self.haptic_loop.cpu_us)?;
        quantiles("lateness_us", self.haptic_loop.lateness_us)
    }
}
