//! How a run is asked to end: Ctrl-C, SIGTERM, SIGHUP or a key; the second time ends the process at once. And its emergency
//! stop: SIGUSR1 sets it, SIGUSR2 clears it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::time::Duration;

use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::wish::Wish;
use mmt_shared::wire::Ending;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;

use crate::failure::{Failure, INTERRUPTED_TWICE};
use crate::panics::PANICS;
use crate::view::restore_terminal;

/// Between two looks at whether a person asked for the end.
const LOOK: Duration = Duration::from_millis(50);

/// The wish that the run ends. Copies are the same wish.
#[derive(Clone, Debug)]
pub(crate) struct Stop {
    wanted: Arc<watch::Sender<Wish>>,
    asked: Arc<AtomicBool>,
    emergency: EmergencyStop,
}

impl Stop {
    /// A wish that nobody has yet.
    pub(crate) fn new() -> Self {
        Self {
            wanted: Arc::default(),
            asked: Arc::default(),
            emergency: EmergencyStop::default(),
        }
    }

    /// A wish that SIGINT, SIGTERM and SIGHUP wake from now on, SIGHUP only where it is not ignored (`nohup`); with an
    /// emergency stop that SIGUSR1 sets and SIGUSR2 clears.
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
        let (mut interrupt, mut terminate, mut hang_up, mut set, mut clear) = {
            let _inside = runtime.enter();
            let register = |kind| signal(kind).map_err(no_signals);
            (
                register(SignalKind::interrupt())?,
                register(SignalKind::terminate())?,
                (!ignores_hang_up())
                    .then(|| register(SignalKind::hangup()))
                    .transpose()?,
                register(SignalKind::user_defined1())?,
                register(SignalKind::user_defined2())?,
            )
        };
        let wait = async move {
            loop {
                let hung_up = async {
                    match &mut hang_up {
                        Some(hang_up) => hang_up.recv().await,
                        None => std::future::pending().await,
                    }
                };
                tokio::select! {
                    _ = hung_up => on_signal.ask(),
                    _ = interrupt.recv() => on_signal.ask(),
                    _ = terminate.recv() => on_signal.ask(),
                    _ = set.recv() => on_signal.emergency.set(true),
                    _ = clear.recv() => on_signal.emergency.set(false),
                }
            }
        };
        std::thread::Builder::new()
            .name("signals".to_owned())
            .spawn(move || runtime.block_on(wait))
            .map_err(no_signals)?;
        let ended = stop.clone();
        PANICS.end_by(move || ended.give_up());
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
        self.end();
        tracing::info!("ending; once more to quit at once");
    }

    /// Ends the run in order, as failed: a thread of this process panicked.
    pub(crate) fn give_up(&self) {
        self.asked.store(true, Ordering::Release);
        self.wanted.send_replace(Wish::Fail);
    }

    /// What the end of a run is called in its report that goes on until it is asked to end, or until `finished`.
    pub(crate) fn ending(&self) -> Ending {
        match *self.wanted.borrow() {
            Wish::Fail => Ending::Failed,
            _ if self.asked() => Ending::Interrupted,
            _ => Ending::Finished,
        }
    }

    /// The emergency stop of this side.
    pub(crate) fn emergency(&self) -> &EmergencyStop {
        &self.emergency
    }

    /// Ends the run without counting as asked by a person.
    pub(crate) fn end(&self) {
        self.wanted.send_if_modified(|wish| {
            let goes_on = !wish.ends();
            if goes_on {
                *wish = Wish::End;
            }
            goes_on
        });
    }

    /// Whether a person or the system asked for the end.
    pub(crate) fn asked(&self) -> bool {
        self.asked.load(Ordering::Acquire)
    }

    /// Does `work` on a thread of its own and hands what it sends to `take`, here and in order. Whether it was left
    /// because a person asked for the end: it then goes on until the process ends, and nobody waits for it.
    ///
    /// # Errors
    /// That of the work or of `take`. The system gives no thread.
    pub(crate) fn until_asked<T: Send + 'static>(
        &self,
        work: impl FnOnce(Sender<T>) -> Result<(), Failure> + Send + 'static,
        mut take: impl FnMut(T) -> Result<(), Failure>,
    ) -> Result<bool, Failure> {
        let (sender, receiver) = mpsc::channel();
        let worker = std::thread::Builder::new().name("work".to_owned());
        let worker = worker
            .spawn(move || work(sender))
            .map_err(|error| Failure::failed(format!("the system gives no thread: {error}")))?;
        loop {
            match receiver.recv_timeout(LOOK) {
                Ok(done) => take(done)?,
                Err(RecvTimeoutError::Timeout) if self.asked() => return Ok(true),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        match worker.join() {
            Ok(ended) => ended.map(|()| false),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }

    /// What is wanted of the run.
    pub(crate) fn receiver(&self) -> watch::Receiver<Wish> {
        self.wanted.subscribe()
    }
}

/// Whether this process was started with SIGHUP, number 1, ignored.
fn ignores_hang_up() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask & 1 == 1)
}

fn no_signals(error: std::io::Error) -> Failure {
    Failure::failed(format!("cannot listen for Ctrl-C and SIGTERM: {error}"))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    #[test]
    fn asking_once_reaches_every_receiver_and_neither_ending_nor_failing_is_asking() {
        let stop = Stop::new();
        let receiver = stop.receiver();
        stop.end();
        assert!(receiver.borrow().ends() && !stop.asked());
        stop.ask();
        assert_eq!((*stop.receiver().borrow(), stop.asked()), (Wish::End, true));
        assert_eq!(stop.ending(), Ending::Interrupted);
        stop.give_up();
        stop.end();
        assert_eq!(
            (*receiver.borrow(), stop.ending()),
            (Wish::Fail, Ending::Failed)
        );
    }

    #[test]
    fn work_that_is_left_keeps_what_it_sent_and_work_that_ends_hands_over_its_error() {
        let stop = Stop::new();
        let taken = Cell::new(0);
        let take = |number| {
            taken.set(10 * taken.get() + number);
            Ok(())
        };
        let work = |sender: Sender<u32>| {
            sender.send(1).map_err(Failure::failed)?;
            sender.send(2).map_err(Failure::failed)?;
            Err(Failure::usage("no more"))
        };
        assert_eq!(stop.until_asked(work, take), Err(Failure::usage("no more")));
        assert_eq!(taken.get(), 12);

        let wish = stop.clone();
        let endless = move |sender: Sender<u32>| {
            sender.send(3).map_err(Failure::failed)?;
            wish.ask();
            loop {
                std::thread::park();
            }
        };
        assert_eq!(stop.until_asked(endless, take), Ok(true));
        assert_eq!(taken.get(), 123);
    }
}
