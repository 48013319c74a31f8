//! What a loop was given and what its ticks gave: a pure end that is given the same again gives the same bits.
//!
//! All room is taken at the start: keeping an input neither allocates nor waits. Once the room is used up nothing more is
//! kept, so that a log is always the beginning of a session.

use std::sync::{Arc, Mutex, PoisonError};

use super::loop_thread::Frame;
use crate::time::Time;

/// What an end was given.
#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "a log lies in one piece of memory"
)]
pub enum Input<G> {
    /// A datagram and its arrival.
    Frame(Frame),
    /// A tick.
    Tick {
        /// Its deadline.
        deadline: Time,
        /// What else it was given.
        given: G,
        /// When what it sent left.
        sent: Time,
    },
}

/// Inputs in their order, and what each tick gave.
#[derive(Clone, Debug, Default)]
pub struct InputLog<G, T> {
    inputs: Vec<Input<G>>,
    ticks: Vec<T>,
    is_full: bool,
}

impl<G: Copy, T> InputLog<G, T> {
    /// Room for so many inputs.
    pub fn with_room(inputs: usize) -> Self {
        Self {
            inputs: Vec::with_capacity(inputs),
            ticks: Vec::with_capacity(inputs),
            is_full: false,
        }
    }

    /// Keeps a frame that was handled.
    pub fn keep_frame(&mut self, frame: &Frame) {
        self.keep(Input::Frame(*frame));
    }

    /// Keeps a tick and what it gave.
    pub fn keep_tick(&mut self, deadline: Time, given: G, sent: Time, tick: T) {
        self.keep(Input::Tick {
            deadline,
            given,
            sent,
        });
        if !self.is_full {
            self.ticks.push(tick);
        }
    }

    fn keep(&mut self, input: Input<G>) {
        self.is_full |= self.inputs.len() == self.inputs.capacity();
        if !self.is_full {
            self.inputs.push(input);
        }
    }

    /// The inputs, oldest first.
    pub fn inputs(&self) -> &[Input<G>] {
        &self.inputs
    }

    /// What the ticks gave, oldest first.
    pub fn ticks(&self) -> &[T] {
        &self.ticks
    }
}

/// How many inputs of a loop are to be kept, and where its session leaves the record at its end.
#[derive(Clone, Debug)]
pub struct RecordWanted<R> {
    /// So many of the first inputs.
    pub inputs: usize,
    /// Where the record is left.
    pub kept: Arc<Mutex<Option<R>>>,
}

impl<R> RecordWanted<R> {
    /// Leaves the record of a session that has ended.
    pub fn keep(&self, record: Option<R>) {
        *self.kept.lock().unwrap_or_else(PoisonError::into_inner) = record;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_keeps_the_beginning_and_takes_no_more_room() {
        let mut log = InputLog::with_room(3);
        log.keep_frame(&Frame::new(Time::ZERO, b"1"));
        for n in 0..5 {
            log.keep_tick(Time::from_millis(n), n, Time::ZERO, n);
        }
        assert_eq!((log.inputs().len(), log.ticks()), (3, &[0, 1][..]));
        assert!(matches!(log.inputs()[0], Input::Frame(_)));
    }
}
