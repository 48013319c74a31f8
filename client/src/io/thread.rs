//! The haptic thread: the loop at 1 kHz with absolute deadlines, with what priority the host grants.

use std::io;
use std::thread::JoinHandle;

use mmt_shared::io::clock::Clock;
use mmt_shared::io::realtime::{self, RealTime};
use mmt_shared::io::ticker::Ticker;
use mmt_shared::time::TICK;
use tokio::sync::oneshot;

use super::haptic::{HapticLoop, HapticOutcome};

/// The thread's name.
const NAME: &str = "mmt-haptic";
/// The loop looks at its own quantiles, which takes microseconds, every so many ticks.
const TIMING_TICKS: u64 = 500;

/// What the thread ends with; the error is why the loop could not be set up.
pub(super) type Finished = Result<HapticOutcome, String>;

/// Starts the thread. `granted` hears once what the host granted: the thread itself never logs.
pub(super) fn spawn(
    haptic: HapticLoop,
    clock: Clock,
    granted: oneshot::Sender<RealTime>,
) -> io::Result<JoinHandle<Finished>> {
    let body = move || {
        let _gone = haptic.gone();
        run(haptic, clock, granted)
    };
    std::thread::Builder::new()
        .name(NAME.to_owned())
        .spawn(body)
}

fn run(mut haptic: HapticLoop, clock: Clock, granted: oneshot::Sender<RealTime>) -> Finished {
    // nobody may be listening any more: then nobody wants to know
    let _ = granted.send(realtime::request());
    let mut ticker = Ticker::new(clock, TICK);
    loop {
        let tick = ticker.wait();
        if tick.index % TIMING_TICKS == TIMING_TICKS / 2 {
            haptic.note_timing(&ticker.report());
        }
        if haptic.tick(tick).is_break() {
            break;
        }
    }
    haptic.note_timing(&ticker.report());
    Ok(haptic.outcome())
}
