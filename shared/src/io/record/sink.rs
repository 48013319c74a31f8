//! What a loop leaves for its record, and the ring in which it leaves it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rtrb::{Consumer, Producer, RingBuffer};

use super::shown::Shown;
use crate::io::loop_thread::Frame;
use crate::io::schedule::Tick;
use crate::model::geometry::Vec2;
use crate::time::Time;

/// Entries that may wait for the thread: at 2000 a second, four seconds in which a disk stands.
pub(super) const ROOM: usize = 8192;

/// A tick: when it was, what it was given besides, when what it sent left, and what it did.
#[derive(Clone, Copy, Debug)]
pub struct Ticked<G, D> {
    /// Its deadline, and how late it was.
    pub tick: Tick,
    /// What its end was given.
    pub given: G,
    /// When what it sent left.
    pub sent: Time,
    /// What it did.
    pub done: D,
}

/// A reading of a person's hand as it came, before anything is made of it.
#[derive(Clone, Copy, Debug)]
pub struct HandReading {
    /// When the loop took it.
    pub at: Time,
    /// When it was taken, by the clock of the page or the device, s; NaN when the hand lets go.
    pub own_s: f64,
    /// Where the pointer or the device was, m, world; NaN when the hand lets go.
    pub point: Vec2,
    /// Whether the hand holds.
    pub held: bool,
}

/// What a loop left.
#[derive(Clone, Copy, Debug)]
pub(super) enum Entry<G, D> {
    Arrived { index: u64, frame: Frame },
    Ticked { index: u64, tick: Ticked<G, D> },
    Sent(Frame),
    Shown { at: Time, shown: Shown },
    Read(HandReading),
}

/// The loop's side of a record. It never waits or allocates; what finds no room is counted.
#[derive(Debug)]
pub struct RecordSink<G, D> {
    entries: Producer<Entry<G, D>>,
    missed: Arc<AtomicU64>,
    /// The number of the next input: inputs so far, and whatever found no room.
    inputs: u64,
}

impl<G, D> RecordSink<G, D> {
    pub(super) fn with_room(
        entries: usize,
        missed: Arc<AtomicU64>,
    ) -> (Self, Consumer<Entry<G, D>>) {
        let (entries, taken) = RingBuffer::new(entries);
        let sink = Self {
            entries,
            missed,
            inputs: 0,
        };
        (sink, taken)
    }

    /// Keeps a datagram that was handled.
    pub fn arrived(&mut self, frame: &Frame) {
        let (index, frame) = (self.count(), *frame);
        self.keep(Entry::Arrived { index, frame });
    }

    /// Keeps a tick, before what it sends.
    pub fn ticked(&mut self, tick: Ticked<G, D>) {
        let index = self.count();
        self.keep(Entry::Ticked { index, tick });
    }

    /// Keeps a datagram that leaves at `at`.
    pub fn sent(&mut self, at: Time, bytes: &[u8]) {
        self.keep(Entry::Sent(Frame::new(at, bytes)));
    }

    /// Keeps what is shown of the session at `at`.
    pub fn shown(&mut self, at: Time, shown: Shown) {
        self.keep(Entry::Shown { at, shown });
    }

    /// Keeps a reading of the hand.
    pub fn read(&mut self, reading: HandReading) {
        self.keep(Entry::Read(reading));
    }

    fn count(&mut self) -> u64 {
        let index = self.inputs;
        self.inputs += 1;
        index
    }

    fn keep(&mut self, entry: Entry<G, D>) {
        if self.entries.push(entry).is_err() {
            self.missed.fetch_add(1, Ordering::Relaxed);
            // whatever is missing, the numbers of the inputs show that something is
            self.inputs += 1;
        }
    }
}
