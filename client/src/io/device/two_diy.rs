//! The thread of a 2DIY: torques out and angles back over its serial port, a thousand times a second.

use std::io;
use std::path::Path;
use std::time::Duration;

use mmt_shared::io::clock::Clock;
use mmt_shared::io::ticker::Ticker;
use mmt_shared::time::TICK;

use super::serial::Serial;
use super::shared::Shared;
use crate::device::two_diy::{ANSWER_BYTES, RESET, TwoDiy, no_torques};

/// How long an answer is waited for.
const ANSWER: Duration = Duration::from_millis(20);
/// How long the port may take to take something.
const PATIENCE: Duration = Duration::from_millis(500);
/// A board that has sent nothing for so long is set up anew: it may have been off.
const SILENCE: Duration = Duration::from_secs(1);
/// Answers that are read at once: those of a board that was late.
const ANSWERS_MAX: usize = 16;
/// Between two attempts to open the port.
const RETRY: Duration = Duration::from_millis(500);

/// What a person has to know of a board that is set up while they use it.
const ANEW: &str = "the 2DIY is set up anew, and counts from where its arms stand now: if that is not the vendor's start, end mmt, \
                    set them to it, and begin again";

/// Serves the device until the host ends; a port that goes away is opened again.
pub(super) fn serve(path: &Path, first: Serial, device: &mut TwoDiy, shared: &Shared) {
    let clock = Clock::start();
    let mut port = Some(first);
    while !shared.has_ended() {
        if let Some(mut open) = port.take() {
            let _ = exchange(&mut open, device, shared, clock);
            // the board keeps what it got last
            let _ = open.write(&no_torques(), PATIENCE);
        }
        if !shared.has_ended() {
            shared.take(clock.now(), |give| {
                device.lose(give);
                (None, *device.counts())
            });
            tracing::warn!("the 2DIY at {} is gone", path.display());
        }
        while !shared.has_ended() && port.is_none() {
            clock.sleep_until(clock.now() + RETRY);
            port = Serial::open(path).ok();
        }
        if port.is_some() {
            tracing::warn!("{ANEW}");
        }
    }
}

/// Asks and listens until the host ends.
///
/// # Errors
/// The port is gone.
fn exchange(
    port: &mut Serial,
    device: &mut TwoDiy,
    shared: &Shared,
    clock: Clock,
) -> io::Result<()> {
    set_up(port, device)?;
    let mut ticker = Ticker::new(clock, TICK);
    let mut last_answer = clock.now();
    let mut room = [0; ANSWERS_MAX * ANSWER_BYTES];
    while !shared.has_ended() {
        ticker.wait();
        port.drain()?;
        let torques = device.torques(clock.now(), &shared.cell.load());
        port.write(&torques, PATIENCE)?;
        let (first, more) = room.split_at_mut(ANSWER_BYTES);
        let mut came = port.read(first, clock, ANSWER)?;
        if came == ANSWER_BYTES {
            came += port.read(more, clock, Duration::ZERO)?;
        }
        let now = clock.now();
        let answers = room.get(..came).unwrap_or_default();
        shared.take(now, |give| {
            if answers.is_empty() {
                device.miss(now, give);
            } else {
                device.handle(now, answers, give);
            }
            (device.seen(), *device.counts())
        });
        if came > 0 {
            last_answer = now;
        } else if now.saturating_since(last_answer) > SILENCE {
            tracing::warn!("{ANEW}");
            set_up(port, device)?;
            last_answer = now;
        }
    }
    Ok(())
}

fn set_up(port: &mut Serial, device: &TwoDiy) -> io::Result<()> {
    port.write(&RESET, PATIENCE)?;
    port.write(&device.set_up(), PATIENCE)
}
