//! How a run is asked to end: Ctrl-C, SIGTERM or a key. The second time ends the process at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;

use crate::failure::{Failure, INTERRUPTED_TWICE};
use crate::view::restore_terminal;

/// The wish that the run ends. Copies are the same wish.
#[derive(Clone, Debug)]
pub(crate) struct Stop {
    wanted: Arc<watch::Sender<bool>>,
    asked: Arc<AtomicBool>,
}

impl Stop {
    /// A wish that nobody has yet.
    pub(crate) fn new() -> Self {
        Self {
            wanted: Arc::new(watch::Sender::new(false)),
            asked: Arc::default(),
        }
    }

    /// A wish that SIGINT and SIGTERM wake from now on.
    ///
    /// # Errors
    /// The system gives no thread or no signals.
    pub(crate) fn on_signals() -> Result<Self, Failure> {
        let stop = Self::new();
        let on_signal = stop.clone();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .build()
            .map_err(no_signals)?;
        // Registered before the thread starts: from here on no signal is missed.
        let (mut interrupt, mut terminate) = {
            let _inside = runtime.enter();
            let register = |kind| signal(kind).map_err(no_signals);
            (
                register(SignalKind::interrupt())?,
                register(SignalKind::terminate())?,
            )
        };
        let wait = async move {
            loop {
                tokio::select! {
                    _ = interrupt.recv() => on_signal.ask(),
                    _ = terminate.recv() => on_signal.ask(),
                }
            }
        };
        std::thread::Builder::new()
            .name("signals".to_owned())
            .spawn(move || runtime.block_on(wait))
            .map_err(no_signals)?;
        Ok(stop)
    }

    /// Asks for the end as a person does: the first time kindly; the second time this process is over.
    #[allow(
        clippy::disallowed_methods,
        reason = "whoever asks twice wants the process gone, whatever hangs"
    )]
    pub(crate) fn ask(&self) {
        if self.asked.swap(true, Ordering::AcqRel) {
            restore_terminal();
            std::process::exit(INTERRUPTED_TWICE);
        }
        tracing::info!("ending; once more to quit at once");
        self.wanted.send_replace(true);
    }

    /// Ends the run without counting as asked by a person.
    pub(crate) fn end(&self) {
        self.wanted.send_replace(true);
    }

    /// Whether a person or the system asked for the end.
    pub(crate) fn asked(&self) -> bool {
        self.asked.load(Ordering::Acquire)
    }

    /// Turns true when the run shall end.
    pub(crate) fn receiver(&self) -> watch::Receiver<bool> {
        self.wanted.subscribe()
    }
}

fn no_signals(error: std::io::Error) -> Failure {
    Failure::failed(format!("cannot listen for Ctrl-C and SIGTERM: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn asking_once_tells_every_receiver_and_ending_is_not_asking() {
        let stop = Stop::new();
        let receiver = stop.receiver();
        stop.end();
        assert!(*receiver.borrow() && !stop.asked());
        stop.ask();
        assert!(*stop.receiver().borrow() && stop.asked());
    }
}
