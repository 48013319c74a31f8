//! From what a loop left to the messages of a record: what is the same at both ends.

use std::fmt::Debug;

use rtrb::Consumer;

use super::file::RecordWriter;
use super::shown::Names;
use super::sink::{Entry, ROOM, Ticked};
use super::wall::Wall;
use crate::io::loop_thread::Frame;
use crate::record::digest::RunDigest;
use crate::record::messages::{Arrival, Loop, Reading, Session, Stamp};
use crate::record::packet::PacketWatch;
use crate::wire::Side;

/// Ticks that a message about the loop sums up.
const LOOP_TICKS: u64 = 1000;
/// Standard messages of every so many ticks: 100 a second.
const STANDARD_TICKS: u64 = 10;

/// What every message about a tick has.
#[derive(Clone, Copy, Debug)]
pub struct TickAbout {
    /// Its deadline on the wall clock.
    pub stamp: Stamp,
    /// Number of the session in the record.
    pub session: u32,
    /// Number of the input in its session.
    pub index: u64,
    /// From the deadline to the wake, ns.
    pub lateness_ns: u64,
    /// Digest of all that the session gave before this tick's datagrams.
    pub digest: u64,
}

/// What one end makes of what its loop left.
pub trait Topics: Send + 'static {
    /// Which end.
    const SIDE: Side;
    /// What a tick is given besides its deadline.
    type Given: Copy + Send + 'static;
    /// What a tick does; its text goes into the digest.
    type Done: Copy + Debug + Send + 'static;

    /// Writes a tick.
    fn ticked(about: &TickAbout, tick: &Ticked<Self::Given, Self::Done>, out: &mut RecordWriter);

    /// Writes the standard messages of a tick, 100 times a second.
    fn standard(stamp: Stamp, done: &Self::Done, out: &mut RecordWriter);
}

/// Something that is written while a session goes on.
pub(super) trait Drain: Send {
    /// Writes what has been left; whether more can come. `missed`: what found no room so far.
    fn drain(&mut self, missed: u64, out: &mut RecordWriter) -> bool;
}

type Left<T> = Entry<<T as Topics>::Given, <T as Topics>::Done>;

/// One session of one end.
pub(super) struct Source<T: Topics> {
    wall: Wall,
    session: Session,
    begun: bool,
    names: &'static Names,
    ticks: u64,
    entries: Consumer<Left<T>>,
    digest: RunDigest,
    packets: PacketWatch,
    timing: Timing,
}

/// The loop in the second before.
#[derive(Default)]
struct Timing {
    ticks: u64,
    skipped: u64,
    sum_ns: u64,
    max_ns: u64,
}

impl<T: Topics> Source<T> {
    pub(super) fn new(wall: Wall, session: Session, entries: Consumer<Left<T>>) -> Self {
        Self {
            wall,
            packets: PacketWatch::new(T::SIDE, session.session),
            session,
            begun: false,
            names: Names::of(T::SIDE),
            ticks: 0,
            entries,
            digest: RunDigest::default(),
            timing: Timing::default(),
        }
    }

    fn write(&mut self, entry: &Left<T>, missed: u64, out: &mut RecordWriter) {
        match entry {
            Entry::Arrived { index, frame } => self.arrived(*index, frame, out),
            Entry::Ticked { index, tick } => self.ticked(*index, tick, missed, out),
            Entry::Sent(frame) => {
                self.digest.datagram(frame.bytes());
                let stamp = self.wall.stamp(frame.at);
                let packet = self.packets.sent(stamp, frame.bytes());
                out.put(self.names.packets, stamp, &packet);
            }
            Entry::Shown { at, shown } => {
                let stamp = self.wall.stamp(*at);
                self.names.put(stamp, self.session.session, shown, out);
            }
            Entry::Read(reading) => {
                let stamp = self.wall.stamp(reading.at);
                let message = Reading {
                    stamp,
                    session: self.session.session,
                    own_s: reading.own_s,
                    x_m: reading.point.x,
                    y_m: reading.point.y,
                    held: reading.held,
                };
                // only the master has a hand
                out.put("/master/readings", stamp, &message);
            }
        }
    }

    fn arrived(&mut self, index: u64, frame: &Frame, out: &mut RecordWriter) {
        let stamp = self.wall.stamp(frame.at);
        let arrival = Arrival {
            stamp,
            session: self.session.session,
            index,
            at_ns: frame.at.as_nanos(),
            datagram: frame.bytes().to_vec(),
        };
        out.put(self.names.arrivals, stamp, &arrival);
        let packet = self.packets.arrived(stamp, frame.at, frame.bytes());
        out.put(self.names.packets, stamp, &packet);
    }

    fn ticked(
        &mut self,
        index: u64,
        tick: &Ticked<T::Given, T::Done>,
        missed: u64,
        out: &mut RecordWriter,
    ) {
        self.digest.tick(&tick.done);
        let lateness_ns = u64::try_from(tick.tick.lateness.as_nanos()).unwrap_or(u64::MAX);
        let about = TickAbout {
            stamp: self.wall.stamp(tick.tick.deadline),
            session: self.session.session,
            index,
            lateness_ns,
            digest: self.digest.value(),
        };
        T::ticked(&about, tick, out);
        if self.ticks.is_multiple_of(STANDARD_TICKS) {
            T::standard(about.stamp, &tick.done, out);
        }
        self.ticks += 1;
        let timing = &mut self.timing;
        timing.ticks += 1;
        timing.skipped += tick.tick.skipped;
        timing.sum_ns = timing.sum_ns.saturating_add(lateness_ns);
        timing.max_ns = timing.max_ns.max(lateness_ns);
        if timing.ticks >= LOOP_TICKS {
            let message = timing.message(&about, missed);
            out.put(self.names.about_loop, about.stamp, &message);
            *timing = Timing::default();
        }
    }
}

impl Timing {
    fn message(&self, about: &TickAbout, missed: u64) -> Loop {
        Loop {
            stamp: about.stamp,
            session: about.session,
            ticks: self.ticks,
            skipped: self.skipped,
            lateness_mean_us: self.sum_ns as f64 * 1e-3 / self.ticks.max(1) as f64,
            lateness_max_us: self.max_ns as f64 * 1e-3,
            missed,
        }
    }
}

impl<T: Topics> Drain for Source<T> {
    fn drain(&mut self, missed: u64, out: &mut RecordWriter) -> bool {
        if !self.begun {
            self.begun = true;
            out.put(self.names.session, self.session.stamp, &self.session);
        }
        // the loop goes on meanwhile: no more at a time than the ring holds
        let ended = self.entries.is_abandoned();
        for _ in 0..ROOM {
            let Ok(entry) = self.entries.pop() else {
                return !ended;
            };
            self.write(&entry, missed, out);
        }
        true
    }
}
