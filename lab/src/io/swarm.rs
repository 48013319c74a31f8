//! The swarm on threads: every tenth run is done twice and must give one digest.

use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use super::runner::Progress;
use super::threads::on_threads;
use crate::swarm::{SwarmError, Swarmed, swarm};

/// A run of this many is done twice.
const TWICE: u64 = 10;

/// A seed's run, and whether a second one gave the same bits; none where there was no second one.
#[derive(Debug)]
pub struct Repeated {
    /// What the first run came to.
    pub swarmed: Swarmed,
    /// Whether the second gave the same.
    pub same: Option<bool>,
}

/// Runs these seeds on so many threads, all cores if none.
///
/// # Errors
/// A world of the generator is not accepted.
pub fn swarm_of(
    seeds: &[u64],
    duration: Duration,
    threads: Option<NonZero<usize>>,
    progress: Progress<'_>,
) -> Result<Vec<Repeated>, SwarmError> {
    let done = AtomicUsize::new(0);
    let work = |seed: &u64| {
        let swarmed = swarm(*seed, duration)?;
        let same = if seed.is_multiple_of(TWICE) {
            Some(swarm(*seed, duration)? == swarmed)
        } else {
            None
        };
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress("swarm", done, seeds.len());
        Ok(Repeated { swarmed, same })
    };
    on_threads(threads, seeds, work)
}
