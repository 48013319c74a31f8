//! The thread of a 1 kHz loop, with a watchdog beside it.

use std::io;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use tokio::sync::oneshot;

use super::{LoopHandle, LoopSide, pair};
use crate::io::clock::Clock;
use crate::io::realtime::{self, RealTime};
use crate::io::ticker::Ticker;
use crate::io::watchdog::{self, Pulse};
use crate::time::TICK;

/// Starts a thread of this name that runs `body` with the loop's side and a ticker of 1 ms, and a watchdog beside it: if a tick
/// hangs, the loop counts as ended, without a value.
///
/// # Errors
/// The process is out of descriptors or threads.
pub fn spawn<S, T>(
    name: &'static str,
    clock: Clock,
    first: &S,
    body: impl FnOnce(LoopSide<S>, Ticker) -> T + Send + 'static,
) -> io::Result<LoopHandle<S, T>>
where
    S: Clone + Send + 'static,
    T: Send + 'static,
{
    let (handle, side, done) = pair(first)?;
    let done = Ending(Arc::new(Mutex::new(Some(done))));
    let hung = Arc::clone(&handle.hung);
    let run = move || {
        announce(name, &realtime::request());
        let pulse = Pulse::default();
        let (watched, ended) = (done.clone(), done.clone());
        let bark = move || {
            tracing::error!("{name}: a tick does not end: the loop has hung");
            hung.store(true, Ordering::Release);
            watched.take();
        };
        let own = rustix::thread::gettid();
        let watches = watchdog::watch(pulse.clone(), own, move || ended.is_reported(), bark);
        if let Err(error) = watches {
            tracing::warn!("{name}: nobody watches for a tick that hangs: {error}");
        }
        let done = OnDrop(done);
        let ended = body(side, Ticker::new(clock, TICK).watched_by(pulse));
        if let Some(done) = done.0.take() {
            // an error means that nobody waits for it any more: the session was dropped
            let _ = done.send(ended);
        }
    };
    thread::Builder::new().name(name.into()).spawn(run)?;
    Ok(handle)
}

/// How the loop's end is reported: once, by the loop or by its watchdog.
struct Ending<T>(Arc<Mutex<Option<oneshot::Sender<T>>>>);

impl<T> Clone for Ending<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T> Ending<T> {
    /// For whoever reports it. The loop takes it after its last tick.
    fn take(&self) -> Option<oneshot::Sender<T>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Whether it is reported.
    fn is_reported(&self) -> bool {
        let sender = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        sender.is_none()
    }
}

/// A loop that panics ends without a value.
struct OnDrop<T>(Ending<T>);

impl<T> Drop for OnDrop<T> {
    fn drop(&mut self) {
        self.0.take();
    }
}

/// What was not granted is worth a line by default: deadlines will slip.
fn announce(name: &str, obtained: &RealTime) {
    let granted = [&obtained.fifo, &obtained.memory, &obtained.slack];
    if granted.into_iter().all(|of| of.granted()) {
        tracing::info!("{name}: {obtained}");
    } else {
        tracing::warn!("{name}: {obtained}");
    }
}
