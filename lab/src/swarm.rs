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

use crate::worlds::RandomWorld;

pub use faults::{Fault, Scheduled, draw};
pub use run::Swarmed;
pub use session::SwarmError;

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
        // the gain of the sensor is found only where that stiffness is known
        world.config.slave.conditioning.find_gain = seed.is_multiple_of(4);
    }
    let faults = draw(seed, duration, &Fault::ALL);
    run::Run::try_new(seed, &world, faults)?.finish(duration)
}

#[cfg(test)]
mod tests;
