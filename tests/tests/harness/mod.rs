//! What the promises share: the command as a process, hosts of their own, tshark, and the repository.
#![allow(
    dead_code,
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "each of the two binaries uses a part of it; it watches processes in real time"
)]

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

pub(crate) mod hosts;
pub(crate) mod judge;
pub(crate) mod process;
pub(crate) mod python;
pub(crate) mod rules;
pub(crate) mod tshark;

/// The root of the repository.
pub(crate) fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}

/// A host whose threads wait so long for their turn is no host for a session.
const STOOD_STILL: Duration = Duration::from_millis(100);

/// Runs a test of sessions. A session ends when its host stands still for a second, as it must; so a test that fails while the
/// host stands still runs again, three times at most.
pub(crate) fn in_real_time(test: impl Fn()) {
    for _ in 0..3 {
        let (ended, stood) = watched(&test);
        let Err(why) = ended else { return };
        if stood < STOOD_STILL {
            resume_unwind(why);
        }
    }
    test();
}

/// Runs a test and measures for how long at most a thread that does nothing did not get its turn.
fn watched(test: &impl Fn()) -> (std::thread::Result<()>, Duration) {
    const NAP: Duration = Duration::from_millis(5);
    let over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let watch = scope.spawn(|| {
            let mut stood = Duration::ZERO;
            while !over.load(Ordering::Relaxed) {
                let began = Instant::now();
                std::thread::sleep(NAP);
                stood = stood.max(began.elapsed() - NAP);
            }
            stood
        });
        let ended = catch_unwind(AssertUnwindSafe(test));
        over.store(true, Ordering::Relaxed);
        (ended, watch.join().unwrap_or_default())
    })
}

/// Whether `lost` of `sent` is what chance makes of a share of loss, but for once in 50 000 runs.
pub(crate) fn is_by_chance(lost: f64, sent: f64, share: f64) -> bool {
    let (mean, deviation) = (share * sent, (share * (1.0 - share) * sent).sqrt());
    (lost - mean).abs() <= 4.3 * deviation + 1.0
}
