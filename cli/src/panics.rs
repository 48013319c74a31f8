//! A panic is our bug. In whatever thread of this process it happens, the run ends in order, and its exit code is
//! that of a failure.
//!
//! Two kinds of threads end nothing: those whose panic somebody else notices, who fails the session by name, and those in which
//! strangers are served, because nobody who finds a bug of ours may end a session that is not theirs.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::failure::Failure;

/// Whose panics fail the session by name: the hosts, which are joined, and the 1 kHz loops, which their hosts look after.
const LOOKED_AFTER: [&str; 5] = ["main", "master", "observer", "mmt-haptic", "mmt-slave"];
/// Where strangers are served beside the session: judges and observers on the thread of the slave's host, pages.
const OF_STRANGERS: [&str; 2] = ["slave", "mmt-console"];

/// Those of this process.
pub(crate) static PANICS: Panics = Panics::new();

/// The panics of a process.
pub(crate) struct Panics {
    any: AtomicBool,
    /// Ends the run.
    end: Mutex<Option<Box<dyn Fn() + Send>>>,
}

impl Panics {
    pub(crate) const fn new() -> Self {
        Self {
            any: AtomicBool::new(false),
            end: Mutex::new(None),
        }
    }

    /// When a thread panics that nobody looks after, `end` ends the run.
    pub(crate) fn end_by(&self, end: impl Fn() + Send + 'static) {
        let mut ends = self.end.lock().unwrap_or_else(PoisonError::into_inner);
        *ends = Some(Box::new(end));
    }

    /// A thread of this name panics.
    pub(crate) fn note(&self, thread: Option<&str>) {
        self.any.store(true, Ordering::Release);
        let mut goes_on = LOOKED_AFTER.iter().chain(&OF_STRANGERS);
        if goes_on.any(|name| Some(*name) == thread) {
            return;
        }
        // a panic while the lock is held would wait for itself
        if let Ok(ends) = self.end.try_lock()
            && let Some(end) = &*ends
        {
            end();
        }
    }

    /// What a run came to that went well but for a panic.
    ///
    /// # Errors
    /// There was one.
    pub(crate) fn judge(&self) -> Result<(), Failure> {
        if self.any.load(Ordering::Acquire) {
            return Err(Failure::failed("a thread of mmt panicked")
                .remedy("this is a defect of mmt: please report it with what stands above"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use mmt_shared::io::wish::Wish;

    use super::*;
    use crate::stop::Stop;

    #[test]
    fn a_panic_that_nobody_looks_after_ends_the_run_and_every_one_is_a_failure() {
        for (thread, ends) in [
            (Some("mmt-device"), true),
            (Some("signals"), true),
            (None, true),
            (Some("mmt-haptic"), false),
            (Some("slave"), false),
        ] {
            let (panics, stop) = (Panics::new(), Stop::new());
            let ended = stop.clone();
            panics.end_by(move || ended.give_up());
            assert_eq!(panics.judge(), Ok(()));
            panics.note(thread);
            let wish = if ends { Wish::Fail } else { Wish::GoOn };
            assert_eq!(*stop.receiver().borrow(), wish, "{thread:?}");
            assert_eq!(stop.asked(), ends, "{thread:?}");
            assert!(panics.judge().is_err());
        }
    }
}
