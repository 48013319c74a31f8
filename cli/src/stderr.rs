//! Messages on their way to stderr. A thread of its own writes them: whoever reads stderr slowly, or not at all, holds up
//! nobody but that thread.

use std::collections::VecDeque;
use std::fmt::Display;
use std::io::{self, Write};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

/// Messages that may wait; what comes then is dropped and counted.
const WAITING_MAX: usize = 1000;

static QUEUE: Queue = Queue {
    state: Mutex::new(State {
        waiting: VecDeque::new(),
        dropped: 0,
        writing: false,
        started: false,
    }),
    changed: Condvar::new(),
};

struct Queue {
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    waiting: VecDeque<String>,
    /// Messages that found no room since the last that did.
    dropped: u64,
    /// Whether the thread holds something that has not been written yet.
    writing: bool,
    /// Whether there is a thread.
    started: bool,
}

/// Hands over a message; it is dropped and counted if too many wait.
pub(crate) fn note(message: impl Display) {
    let text = format!("{message}\n");
    let mut state = QUEUE.lock();
    state.push(text);
    if !state.started {
        let writer = thread::Builder::new().name("stderr".to_owned());
        state.started = writer.spawn(|| QUEUE.write()).is_ok();
    }
    drop(state);
    QUEUE.changed.notify_all();
}

/// Waits until all that was handed over has been written, no longer than `patience`.
pub(crate) fn settle(patience: Duration) {
    let busy = |state: &mut State| state.started && (state.writing || !state.waiting.is_empty());
    let waited = QUEUE
        .changed
        .wait_timeout_while(QUEUE.lock(), patience, busy);
    drop(waited);
}

impl State {
    fn push(&mut self, text: String) {
        if self.waiting.len() == WAITING_MAX {
            self.dropped += 1;
            return;
        }
        let dropped = std::mem::take(&mut self.dropped);
        if dropped > 0 {
            let lost = format!("{dropped} messages were dropped here: stderr was not read\n");
            self.waiting.push_back(lost);
        }
        self.waiting.push_back(text);
    }
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes until the process ends. What nobody can read is gone.
    fn write(&self) {
        let mut state = self.lock();
        loop {
            let Some(text) = state.waiting.pop_front() else {
                state = (self.changed.wait(state)).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            state.writing = true;
            drop(state);
            let _ = io::stderr().lock().write_all(text.as_bytes());
            state = self.lock();
            state.writing = false;
            self.changed.notify_all();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_finds_no_room_is_dropped_and_counted_where_it_is_missing() {
        let mut state = State {
            waiting: VecDeque::new(),
            dropped: 0,
            writing: false,
            started: false,
        };
        for number in 0..WAITING_MAX + 7 {
            state.push(format!("{number}\n"));
        }
        assert_eq!((state.waiting.len(), state.dropped), (WAITING_MAX, 7));
        state.waiting.clear();
        state.push("after\n".to_owned());
        assert_eq!(
            state.waiting.front().unwrap(),
            "7 messages were dropped here: stderr was not read\n"
        );
        assert_eq!((state.waiting.len(), state.dropped), (2, 0));
    }
}
