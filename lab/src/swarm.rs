//! The swarm: a minute of sessions in a random world, with random faults of link, time, data, sensors, people and processes.
//!
//! Everything that decides anything is the live system's own core; what the shells decide (when a session ends, when the next one
//! begins, what a process that stood still finds in its queues) is written here once more, briefly. A run is a
//! function of its seed.

mod faults;
mod hostile;
mod run;
mod session;
mod way;

use std::time::Duration;

use mmt_client::device::DeviceError;
use mmt_client::operator::scripted::ScriptedConfig;
use mmt_netem::config::ConfigError;
use mmt_server::slave::SlaveError;
use mmt_shared::range::OutOfRange;

use crate::check::Verdict;
use crate::worlds::RandomWorld;

pub use faults::{Fault, Scheduled, draw};

/// What a run of the swarm came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Swarmed {
    /// Its seed.
    pub seed: u64,
    /// How many sessions there were.
    pub sessions: u64,
    /// The faults, in the order of their beginnings.
    pub faults: Vec<Scheduled>,
    /// What was found of all sessions.
    pub verdict: Verdict,
    /// Digest of what both ends gave: equal for equal seeds.
    pub digest: u64,
}

/// Why a run could not be made: the generator is wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SwarmError {
    /// The slave's numbers are not accepted.
    #[error("slave: {0}")]
    Slave(#[from] SlaveError),
    /// The device's numbers are not accepted.
    #[error("device: {0}")]
    Device(#[from] DeviceError),
    /// A number is out of its range.
    #[error(transparent)]
    Number(#[from] OutOfRange),
    /// The network is none.
    #[error("network: {0}")]
    Network(#[from] ConfigError),
}

/// Runs the swarm's `seed` for as long as that.
///
/// # Errors
/// A world of the generator is not accepted.
pub fn swarm(seed: u64, duration: Duration) -> Result<Swarmed, SwarmError> {
    let mut world = RandomWorld::new(seed);
    // the limit of the tool's force is a promise for contacts that are as stiff as the session knows, and a sensor
    // that does not lag
    if seed.is_multiple_of(2) {
        world.config.slave.environment.contact = None;
        world.config.slave.tool_compliance = None;
        world.config.slave.sensing.force_lag_ms = 0.0;
    }
    let faults = draw(seed, duration, &Fault::ALL);
    run::Run::try_new(seed, &world, faults)?.finish(duration)
}

/// The hand of session `session`: another one each time.
fn hand(world: &RandomWorld, session: u64) -> ScriptedConfig {
    ScriptedConfig {
        seed: world.number.wrapping_mul(1000).wrapping_add(session),
        ..world.config.operator
    }
}

#[cfg(test)]
mod tests;
