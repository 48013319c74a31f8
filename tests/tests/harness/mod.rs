//! What the promises share: the command as a process, hosts of their own, tshark, and the repository.
#![allow(
    dead_code,
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "each of the two binaries uses a part of it; it watches processes in real time"
)]

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

pub(crate) mod hosts;
pub(crate) mod process;
pub(crate) mod python;
pub(crate) mod tshark;

/// The root of the repository.
pub(crate) fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}

/// One session at a time: each wants two cores in real time.
pub(crate) fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether `lost` of `sent` is what chance makes of a share of loss, but for once in 50 000 runs.
pub(crate) fn is_by_chance(lost: f64, sent: f64, share: f64) -> bool {
    let (mean, deviation) = (share * sent, (share * (1.0 - share) * sent).sqrt());
    (lost - mean).abs() <= 4.3 * deviation + 1.0
}
