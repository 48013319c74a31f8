//! Every architecture over one network with one operator: who is usable at which delay.
//!
//! Bilateral ones run in [`Bilateral`], the live system's own in [`World`]; [`run`] gives the same row for both. What the
//! columns mean: `docs/baselines.md`. A run must never depend on anything but its arguments.

mod aligned;
mod bilateral;
mod felt;

pub use bilateral::{Bilateral, BilateralOutcome};
pub use felt::{FeltMass, FeltMasses};

use std::time::Duration;

use crate::baselines::message::OVERHEAD_BYTES;
use crate::baselines::{Baseline, Tuning};
use mmt_client::device::DeviceProfile;
use mmt_client::operator::scripted::VisualFeedback;
use mmt_server::playout::PlayoutBuffer;
use mmt_shared::model::settings::{ModelSettings, PoseCorrection};
use serde::Serialize;

use crate::world::{World, WorldConfig, WorldError};
use aligned::AlignedError;
use bilateral::pushes;

/// What stands between the hand and the object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComparedArchitecture {
    /// Force crosses the network.
    Bilateral(Baseline),
    /// A model's parameters cross it; how the model's pose is corrected.
    Mediated(PoseCorrection),
}

impl ComparedArchitecture {
    /// Position–force with passivity control.
    pub const TDPA: Self = Self::Bilateral(Baseline::Tdpa);
    /// The live system's own.
    pub const REPLAY: Self = Self::Mediated(PoseCorrection::Replay);
    /// All that are compared, in the order of tables.
    pub const ALL: [Self; 9] = [
        Self::Bilateral(Baseline::PositionForce),
        Self::Bilateral(Baseline::DampedPositionForce),
        Self::Bilateral(Baseline::DeadbandForce),
        Self::Bilateral(Baseline::Tdpa),
        Self::Bilateral(Baseline::TdpaDeadband),
        Self::Bilateral(Baseline::Waves),
        Self::Mediated(PoseCorrection::Snap),
        Self::Mediated(PoseCorrection::MatchedStamps),
        Self::Mediated(PoseCorrection::Replay),
    ];

    /// Name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bilateral(baseline) => baseline.name(),
            Self::Mediated(PoseCorrection::Snap) => "mmt-snap",
            Self::Mediated(PoseCorrection::MatchedStamps) => "mmt-matched-stamps",
            Self::Mediated(PoseCorrection::Replay) => "mmt-replay",
        }
    }
}

/// What a run came to. A number that has no meaning in a run or an architecture is absent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DelayRow {
    /// Pushes that the operator completed.
    pub pushes: u64,
    /// Packets with a force, a wave or an update per second from slave to master.
    pub packet_rate_hz: f64,
    /// All packets per second from slave to master, heartbeats included.
    pub wire_rate_hz: f64,
    /// Bytes per second in both directions, all headers included.
    pub wire_bytes_per_s: f64,
    /// PMSE (15) of the force displayed against the force at the slave for the same HIP sample.
    pub pmse: Option<f64>,
    /// Relative vector error of the same forces.
    pub relative_error: Option<f64>,
    /// The same of the force displayed against the true force, each shifted by the delay that the architecture has.
    pub aligned_error: Option<f64>,
    /// Error of the model's position, mm; only where there is a model.
    pub pose_rms_mm: Option<f64>,
    /// Largest force on the hand, N.
    pub force_peak_n: Option<f64>,
    /// Breaks of contact per completed push: at the tool, or at the model where that is what the hand touches.
    pub breaks_per_push: Option<f64>,
    /// Energy that updates added to the model, J; only where there is a model.
    pub energy_injected_j: Option<f64>,
    /// The least that the passivity observer at the hand showed, J.
    pub observer_min_j: f64,
    /// The least of what the hand put in less what the tool put out, J; only where the two are coupled.
    pub network_min_j: Option<f64>,
    /// Median delay of the slave's play-out, ms.
    pub playout_delay_ms: Option<f64>,
    /// The mass that the hand felt over the one that the tool felt.
    pub apparent_mass_ratio: Option<f64>,
}

/// Runs an architecture over a network, as it is where nobody tunes it.
///
/// # Errors
/// As [`run_tuned`].
pub fn run(
    architecture: ComparedArchitecture,
    config: &WorldConfig,
    duration: Duration,
) -> Result<DelayRow, WorldError> {
    run_tuned(architecture, &Tuning::default(), config, duration)
}

/// Runs an architecture over a network. The tuning is that of the bilateral ones; the others have theirs in the configuration.
///
/// The operator looks at what there is to look at: the delayed picture where there is no model, else what the
/// configuration asks for.
///
/// # Errors
/// When a number of the configuration is not accepted.
pub fn run_tuned(
    architecture: ComparedArchitecture,
    tuning: &Tuning,
    config: &WorldConfig,
    duration: Duration,
) -> Result<DelayRow, WorldError> {
    match architecture {
        ComparedArchitecture::Bilateral(baseline) => {
            let mut world =
                Bilateral::try_new(config, (baseline, tuning), VisualFeedback::Delayed)?;
            world.run(duration);
            Ok(bilateral_row(&world, duration))
        }
        ComparedArchitecture::Mediated(correction) => {
            let device = DeviceProfile::default().used_with(config.stiffness_n_per_m, None)?;
            let settings = ModelSettings {
                correction,
                ..config.model_settings(device.coupling())
            };
            let config = WorldConfig {
                settings: Some(settings),
                ..config.clone()
            };
            Ok(world_row(World::try_new(&config)?, duration))
        }
    }
}

fn bilateral_row(world: &Bilateral, duration: Duration) -> DelayRow {
    let (outcome, force) = (&world.outcome, world.force());
    let pushes = world.operator.pushes_completed().unwrap_or(0);
    let seconds = duration.as_secs_f64();
    let [up, down] = world.sent();
    let rate_hz = down.packets as f64 / seconds;
    DelayRow {
        pushes,
        packet_rate_hz: rate_hz,
        wire_rate_hz: rate_hz,
        wire_bytes_per_s: (up.bytes + down.bytes) as f64 / seconds,
        pmse: force.pmse,
        relative_error: force.relative_error,
        aligned_error: outcome.aligned.relative(),
        pose_rms_mm: None,
        force_peak_n: outcome.on_hand.largest_n(),
        breaks_per_push: outcome.breaks.per_push(pushes),
        energy_injected_j: None,
        observer_min_j: outcome.hand_port.least_j(),
        network_min_j: Some(outcome.network_min_j),
        playout_delay_ms: playout_delay_ms(world.slave.playout()),
        apparent_mass_ratio: outcome.felt.ratio(),
    }
}

fn world_row(mut world: World, duration: Duration) -> DelayRow {
    let mut felt = FeltMasses::default();
    let mut aligned = AlignedError::default();
    let ticks = u64::try_from(duration.as_millis()).unwrap_or(u64::MAX);
    for _ in 0..ticks {
        let tick = world.step();
        let pushes = pushes(world.operator());
        let in_contact = world.master().view().in_contact;
        let hip = tick.master.sample.hip.metres();
        felt.push_hand(tick.now, hip, -tick.master.hand_force, pushes && in_contact);
        aligned.push_felt(tick.now, tick.master.displayed);
        if let Some(slave) = &tick.slave {
            aligned.push_met(slave.stamp, slave.true_force);
            felt.push_tool(slave.stamp, slave.tool, slave.f_s, slave.in_contact);
        }
    }
    let (outcome, force) = (world.outcome(), world.force());
    let pushes = world.operator().pushes_completed().unwrap_or(0);
    let seconds = duration.as_secs_f64();
    let [up, down] = world.sent();
    let headers = OVERHEAD_BYTES as u64 * (up.packets + down.packets);
    DelayRow {
        pushes,
        packet_rate_hz: (outcome.updates.total() + outcome.forces) as f64 / seconds,
        wire_rate_hz: down.packets as f64 / seconds,
        wire_bytes_per_s: (up.bytes + down.bytes + headers) as f64 / seconds,
        pmse: force.pmse,
        relative_error: force.relative_error,
        aligned_error: aligned.relative(),
        pose_rms_mm: outcome.pose.position_rms_m().map(|m| m * 1e3),
        force_peak_n: outcome.on_hand.largest_n(),
        breaks_per_push: outcome.breaks.per_push(pushes),
        energy_injected_j: Some(outcome.energy_injected_j),
        observer_min_j: outcome.observer_min_j,
        network_min_j: None,
        playout_delay_ms: playout_delay_ms(world.slave().playout()),
        apparent_mass_ratio: felt.ratio(),
    }
}

fn playout_delay_ms(playout: &PlayoutBuffer) -> Option<f64> {
    let median = playout.delays().quantile(0.5);
    median.map(|delay| delay.as_secs_f64() * 1e3)
}

#[cfg(test)]
mod tests;
