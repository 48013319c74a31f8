//! The report of a run: one document, as JSON for machines and as a table for people.
//!
//! Every key is always there. One without meaning in a run is null, never 0 and never NaN. "Up" is
//! master to slave, "down" is slave to master. The keys in words: `docs/report.md`.

mod number;
mod table;
pub mod totals;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::metrics::{
    AgeOfInformation, ContactBreaks, ForcePeak, ForceSummary, PoseError, UpdateCounts,
};
use crate::stats::histogram::{Histogram, Quantiles};
use crate::stats::session::KindCounts;
use crate::wire::{Architecture, Ending};

pub use number::Number;

/// Counts by name; every known name is there, with 0 if it never happened.
pub type Counts = BTreeMap<String, u64>;

/// What happened in a run. `C` is the configuration that it ran with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunReport<C> {
    /// Version of the program.
    pub version: String,
    /// The command that made the run: `demo`, `master`, `slave`, `replay` …
    pub command: String,
    /// Seed of everything that was drawn.
    pub seed: Option<u64>,
    /// From the first to the last tick, s.
    pub duration_s: Number,
    /// How it ended: `finished`, `interrupted` or `failed`.
    pub ending: Option<String>,
    /// Whose force the hand felt.
    pub architecture: ArchitectureReport,
    /// The operator's work.
    pub pushes: PushesReport,
    /// Updates by the slave's trigger.
    pub updates: UpdatesReport,
    /// Application messages by kind.
    pub messages: UpDown<MessagesReport>,
    /// UDP datagrams.
    pub wire: UpDown<WireReport>,
    /// How near the model's force was to the measured one.
    pub force: ForceReport,
    /// What the estimator found.
    pub model: ModelReport,
    /// How near the model's pose was to the true one.
    pub pose: PoseReport,
    /// The slave's tool.
    pub tool: ToolReport,
    /// Energy at the hand.
    pub passivity: PassivityReport,
    /// The path between the two sides.
    pub link: LinkReport,
    /// How well this run's own emulation of the network kept its times.
    pub emulation: UpDown<EmulationReport>,
    /// The master's 1 kHz loop.
    pub haptic_loop: LoopReport,
    /// The slave's 1 kHz loop.
    pub slave_loop: LoopReport,
    /// Whatever else was dropped or refused, by name.
    pub drops: Option<Counts>,
    /// The whole configuration of the run.
    pub configuration: C,
}

impl<C> RunReport<C> {
    /// A report in which everything else is still absent.
    pub fn new(version: &str, command: &str, configuration: C) -> Self {
        Self {
            version: version.to_owned(),
            command: command.to_owned(),
            seed: None,
            duration_s: Number::ABSENT,
            ending: None,
            architecture: ArchitectureReport::default(),
            pushes: PushesReport::default(),
            updates: UpdatesReport::default(),
            messages: UpDown::default(),
            wire: UpDown::default(),
            force: ForceReport::default(),
            model: ModelReport::default(),
            pose: PoseReport::default(),
            tool: ToolReport::default(),
            passivity: PassivityReport::default(),
            link: LinkReport::default(),
            emulation: UpDown::default(),
            haptic_loop: LoopReport::default(),
            slave_loop: LoopReport::default(),
            drops: None,
            configuration,
        }
    }
}

/// The name of an ending in the report.
#[must_use]
pub fn ending_name(ending: Ending) -> &'static str {
    match ending {
        Ending::Finished => "finished",
        Ending::Interrupted => "interrupted",
        Ending::Failed => "failed",
    }
}

/// One of something per direction.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UpDown<T> {
    /// Master to slave.
    pub up: T,
    /// Slave to master.
    pub down: T,
}

/// Whose force the hand felt.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ArchitectureReport {
    /// `mmt` or `tdpa`.
    pub name: Option<String>,
    /// The round trip of the tool's force in the end, smoothed, play-out included, ms; null with `mmt`.
    pub round_trip_ms: Number,
}

impl ArchitectureReport {
    /// Its name, all else absent.
    #[must_use]
    pub fn named(architecture: Architecture) -> Self {
        Self {
            name: Some(architecture.name().to_owned()),
            ..Self::default()
        }
    }
}

/// What the operator did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PushesReport {
    /// Pushes that went over their whole length.
    pub completed: Option<u64>,
    /// Contact breaks per completed push, at the master.
    pub contact_breaks_per_push: Number,
}

impl PushesReport {
    /// From the pushes completed and the contact of the master's model.
    #[must_use]
    pub fn new(completed: u64, breaks: &ContactBreaks) -> Self {
        Self {
            completed: Some(completed),
            contact_breaks_per_push: breaks.per_push(completed).into(),
        }
    }
}

/// Updates: what the trigger sent and what became of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UpdatesReport {
    /// Updates that the slave sent.
    pub sent: Option<u64>,
    /// Per second of the run, 1/s.
    pub rate_hz: Number,
    /// All updates of the run per second of contact, 1/s.
    pub contact_rate_hz: Number,
    /// Sent, by cause.
    pub by_cause: Option<Counts>,
    /// Repeats of them that the slave sent.
    pub repeated: Option<u64>,
    /// Repeats, by the cause of what they repeat.
    pub repeated_by_cause: Option<Counts>,
    /// Updates that the master's model took.
    pub applied: Option<u64>,
    /// Updates that arrived and were not applied, by cause.
    pub dropped: Option<Counts>,
    /// Age of the news that the model rests on.
    pub age_ms: AgeReport,
}

impl UpdatesReport {
    /// Takes what the slave counted.
    pub fn set_sent(&mut self, counts: &UpdateCounts) {
        self.sent = Some(counts.total());
        self.rate_hz = counts.rate_hz().into();
        self.contact_rate_hz = counts.contact_rate_hz().into();
        self.by_cause = Some(named_causes(counts));
    }

    /// Takes what the slave repeated.
    pub fn set_repeated(&mut self, counts: &UpdateCounts) {
        self.repeated = Some(counts.total());
        self.repeated_by_cause = Some(named_causes(counts));
    }
}

/// Counts by name.
#[must_use]
pub fn named<'a>(counts: impl IntoIterator<Item = (&'a str, u64)>) -> Counts {
    let counts = counts.into_iter();
    counts.map(|(name, n)| (name.to_owned(), n)).collect()
}

fn named_causes(counts: &UpdateCounts) -> Counts {
    let named = counts.by_cause().map(|(cause, n)| (cause.name().into(), n));
    named.collect()
}

/// Age of information at the master, ms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AgeReport {
    /// Mean over the ticks.
    pub mean: Number,
    /// Largest.
    pub max: Number,
}

impl From<&AgeOfInformation> for AgeReport {
    fn from(age: &AgeOfInformation) -> Self {
        let ms = |age: std::time::Duration| age.as_secs_f64() * 1e3;
        Self {
            mean: age.mean().map(ms).into(),
            max: age.largest().map(ms).into(),
        }
    }
}

/// Application messages in one direction; a kind that does not go this way is null.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MessagesReport {
    /// Commands: packed HIP samples.
    pub commands: Option<u64>,
    /// Updates, repeats included.
    pub updates: Option<u64>,
    /// Repeats among them: where they are received, those that said what was known.
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
    #[must_use]
    pub fn up(counts: &KindCounts, duration_s: f64) -> Self {
        Self {
            commands: Some(counts.commands.into()),
            heartbeats: Some(counts.heartbeats.into()),
            rate_hz: Number::rate(counts.total() as f64, duration_s),
            ..Self::default()
        }
    }

    /// What goes from slave to master in `duration_s` (s), with so many repeats among the updates.
    #[must_use]
    pub fn down(counts: &KindCounts, repeats: u64, duration_s: f64) -> Self {
        Self {
            updates: Some(counts.updates.into()),
            repeats: Some(repeats),
            scenes: Some(counts.scenes.into()),
            tools: Some(counts.tools.into()),
            heartbeats: Some(counts.heartbeats.into()),
            rate_hz: Number::rate(counts.total() as f64, duration_s),
            ..Self::default()
        }
    }
}

/// UDP datagrams in one direction, as this process's socket counted them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    #[must_use]
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

/// The force metrics; each is defined in `docs/metrics.md` under its name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ForceReport {
    /// Pairs of f_s and f_m.
    pub samples: Option<u64>,
    /// Pairs with a force on either side.
    pub contact_samples: Option<u64>,
    /// (15).
    pub pmse: Number,
    /// (13).
    pub pmse_x: Number,
    /// (14).
    pub pmse_y: Number,
    /// (13) of the magnitudes.
    pub pmse_magnitude: Number,
    /// Relative vector error.
    pub relative_error: Number,
    /// Root mean square error, N.
    pub error_rms_n: Number,
    /// Share of contact outside the 7 % JND, 0 to 1.
    pub jnd7_share: Number,
    /// Share of contact outside the 10 % JND, 0 to 1.
    pub jnd10_share: Number,
    /// Largest force on the hand, N.
    pub largest_n: Number,
    /// Largest change of the force on the hand in one tick, N.
    pub largest_step_n: Number,
}

impl ForceReport {
    /// From the paired forces, and the force on the hand if this side has one.
    #[must_use]
    pub fn new(summary: &ForceSummary, on_hand: Option<&ForcePeak>) -> Self {
        Self {
            samples: Some(summary.samples),
            contact_samples: Some(summary.contact_samples),
            pmse: summary.pmse.into(),
            pmse_x: summary.pmse_x.into(),
            pmse_y: summary.pmse_y.into(),
            pmse_magnitude: summary.pmse_magnitude.into(),
            relative_error: summary.relative_error.into(),
            error_rms_n: summary.error_rms_n.into(),
            jnd7_share: summary.jnd7_share.into(),
            jnd10_share: summary.jnd10_share.into(),
            largest_n: on_hand.and_then(ForcePeak::largest_n).into(),
            largest_step_n: on_hand.and_then(ForcePeak::largest_step_n).into(),
        }
    }
}

/// What the estimator found, beside the truth where it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ModelReport {
    /// Mass m, kg.
    pub mass_kg: EstimateReport,
    /// Viscous damping b, N s/m.
    pub damping_ns_per_m: EstimateReport,
    /// Coulomb friction c, N.
    pub friction_n: EstimateReport,
}

/// An estimate and the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EstimateReport {
    /// The last estimate; absent if the data could not show it.
    pub estimate: Number,
    /// The truth; absent outside simulation.
    pub truth: Number,
}

impl EstimateReport {
    /// From numbers that may be absent.
    pub fn new(estimate: impl Into<Number>, truth: impl Into<Number>) -> Self {
        Self {
            estimate: estimate.into(),
            truth: truth.into(),
        }
    }

    /// (estimate − truth)/truth; absent when either is, or the truth is 0.
    #[must_use]
    pub fn relative_error(&self) -> Number {
        let ratio = |(estimate, truth): (f64, f64)| (estimate - truth) / truth;
        self.estimate.get().zip(self.truth.get()).map(ratio).into()
    }
}

/// Pose error of the master's model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseReport {
    /// Position, root mean square, m.
    pub position_rms_m: Number,
    /// Position, largest, m.
    pub position_max_m: Number,
    /// Orientation, root mean square, rad.
    pub angle_rms_rad: Number,
    /// Orientation, largest, rad.
    pub angle_max_rad: Number,
}

impl From<&PoseError> for PoseReport {
    fn from(error: &PoseError) -> Self {
        Self {
            position_rms_m: error.position_rms_m().into(),
            position_max_m: error.position_max_m().into(),
            angle_rms_rad: error.angle_rms_rad().into(),
            angle_max_rad: error.angle_max_rad().into(),
        }
    }
}

/// The slave's tool and the limit of its force.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToolReport {
    /// For how long the limit shortened its way, s.
    pub held_s: Number,
    /// Largest force that was measured between tool and object, N.
    pub force_peak_n: Number,
}

/// Energy at the hand; `docs/passivity.md` says what the two mean together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PassivityReport {
    /// Energy that updates added to the master's model beyond what its tank paid, J.
    pub energy_injected_j: Number,
    /// The least that the passivity observer at the hand ever showed, J.
    pub observer_min_j: Number,
}

/// The path between the two sides, as the application saw it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkReport {
    /// Round-trip time.
    pub rtt_ms: DelayReport,
    /// Share of the master's datagrams that never arrived, 0 to 1.
    pub loss_up: Number,
    /// Share of the slave's datagrams that never arrived, 0 to 1.
    pub loss_down: Number,
    /// Delay of the slave's play-out, over its ticks.
    pub playout_delay_ms: DelayReport,
}

/// Two quantiles of a delay, ms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DelayReport {
    /// Median.
    pub p50: Number,
    /// 99 % were at most this.
    pub p99: Number,
}

impl DelayReport {
    /// From all delays that were counted; absent if none was.
    #[must_use]
    pub fn of(delays: &Histogram) -> Self {
        let ms = |q| delays.quantile(q).map(|delay| delay.as_secs_f64() * 1e3);
        Self {
            p50: ms(0.5).into(),
            p99: ms(0.99).into(),
        }
    }
}

/// The emulated network in front of the socket that sends in a direction, in real time; null without one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EmulationReport {
    /// Datagrams that left it since the socket was made.
    pub released: Option<u64>,
    /// How long after their times they left, µs.
    pub late_us: LateReport,
    /// Whether the host was too slow for the run to be about this network: p99 above 250 µs, or anything
    /// above 1 ms.
    pub degraded: Option<bool>,
}

/// Release lateness, µs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// Whole periods skipped because a tick came too late.
    pub skipped: Option<u64>,
    /// Time a tick computed, µs.
    pub cpu_us: QuantilesReport,
    /// Time from a tick's deadline to its begin, µs.
    pub lateness_us: QuantilesReport,
}

impl LoopReport {
    /// From what the loop counted, and how long its ticks took and how late they began.
    #[must_use]
    pub fn new(ticks: u64, skipped: u64, cpu: &Quantiles, lateness: &Quantiles) -> Self {
        Self {
            ticks: Some(ticks),
            skipped: Some(skipped),
            cpu_us: cpu.into(),
            lateness_us: lateness.into(),
        }
    }
}

/// Quantiles of a distribution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct QuantilesReport {
    /// Median.
    pub p50: Number,
    /// 99 % were at most this.
    pub p99: Number,
    /// 99.9 % were at most this.
    pub p999: Number,
}

impl From<&Quantiles> for QuantilesReport {
    /// µs; absent if nothing was counted.
    fn from(of: &Quantiles) -> Self {
        let us =
            |time: std::time::Duration| (of.count > 0).then_some(time.as_secs_f64() * 1e6).into();
        Self {
            p50: us(of.p50),
            p99: us(of.p99),
            p999: us(of.p999),
        }
    }
}

#[cfg(test)]
mod tests;
