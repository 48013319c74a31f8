//! The drivers in real time: [`socket`] wraps a QUIC socket, [`relay`] stands between two hosts, [`tunnel`] between
//! two network interfaces.
//!
//! All let the pure [`crate::Link`] decide and only keep its times ([`driver`]), each on one thread of its
//! own that waits for absolute deadlines. How late it was is measured ([`lateness`]) and never fed back.

#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "the drivers are the shell: they read the clock, own sockets and threads"
)]

pub mod capture_file;
pub mod driver;
mod file_thread;
pub mod lateness;
pub mod record_file;
pub mod relay;
pub mod socket;
pub mod tunnel;

use std::sync::{Mutex, MutexGuard, PoisonError};

use mmt_shared::io::clock::Clock;
use mmt_shared::time::Time;

/// The time of `CLOCK_MONOTONIC`, which is the clock of every `Time` in the drivers.
fn now() -> Time {
    const CLOCK: Clock = Clock::since_boot();
    CLOCK.now()
}

/// Locks; what a panicking thread left behind is plain counts and queues, good to go on with.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
