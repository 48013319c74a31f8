//! Records of sessions: a ring out of each loop, one thread that writes the file, and the way back.
//!
//! A loop leaves what it was given and what it did in a bounded ring: it never waits, and what finds no room is counted. A
//! thread of its own makes messages of that and writes them. A disk that is slow or full costs parts of the record, which
//! is reported, and never a tick. A file that is cut off in the middle opens up to there.

mod file;
mod read;
mod shown;
mod sink;
mod source;
#[cfg(test)]
mod tests;
mod wall;

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender, TryRecvError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use mcap::MAGIC;

use crate::io::output_file;
use crate::record::messages::Session;
use crate::time::Time;
use crate::wire::Side;

pub use file::RecordWriter;
pub use read::{Ended, RecordError, is_record, read, read_from};
pub use shown::Shown;
pub use sink::{HandReading, RecordSink, Ticked};
pub use source::{TickAbout, Topics};

use sink::ROOM;
use source::{Drain, Source};
pub use wall::Wall;

/// How long the thread rests when the rings are empty.
const REST: Duration = Duration::from_millis(5);
/// What is older than this is on the disk: so much a cut loses.
const FLUSH: Duration = Duration::from_millis(200);
/// How long the last messages may take to be written.
const FINISH: Duration = Duration::from_secs(5);

/// What the thread is asked for.
enum Order {
    Begin(Box<dyn Drain>),
    Finish,
}

/// What a record came to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordOutcome {
    /// Inputs and events that found no room on their way to the file.
    pub missed: u64,
    /// Why the file is not whole.
    pub error: Option<RecordFailure>,
}

/// Why a record is not whole.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RecordFailure {
    /// The file could not be written.
    #[error("{0}")]
    File(String),
    /// The disk was too slow for what was left at the end.
    #[error("the disk took more than {FINISH:?} for the end")]
    Slow,
    /// The thread that writes it panicked.
    #[error("the thread that writes it panicked")]
    Panicked,
}

/// A record at work. Copies write into the same file.
#[derive(Clone, Debug)]
pub struct Recorder {
    path: Arc<PathBuf>,
    orders: Sender<Order>,
    done: Arc<Mutex<Receiver<RecordOutcome>>>,
    missed: Arc<AtomicU64>,
    /// Sessions so far at the master and at the slave.
    sessions: Arc<[AtomicU32; 2]>,
}

impl Recorder {
    /// Creates the file; an older record of that name is overwritten.
    ///
    /// # Errors
    /// It cannot be created, something else is in it or writes it, or no thread is to be had.
    pub fn create(path: &Path) -> io::Result<Self> {
        Self::written_by(write, path)
    }

    /// The same with a writer of the caller's making.
    fn written_by(
        write: impl FnOnce(File, &Receiver<Order>, &AtomicU64) -> Option<String> + Send + 'static,
        path: &Path,
    ) -> io::Result<Self> {
        let file = output_file::create(path, |head| head.starts_with(MAGIC))?;
        let (orders, inbox) = mpsc::channel();
        let (outcome, done) = mpsc::channel();
        let missed = Arc::new(AtomicU64::new(0));
        let counted = Arc::clone(&missed);
        std::thread::Builder::new()
            .name("mmt-record".to_owned())
            .spawn(move || {
                let error = write(file, &inbox, &counted).map(RecordFailure::File);
                let missed = counted.load(Ordering::Relaxed);
                // an error means that nobody waits for it any more
                let _ = outcome.send(RecordOutcome { missed, error });
            })?;
        Ok(Self {
            path: Arc::new(path.to_owned()),
            orders,
            done: Arc::new(Mutex::new(done)),
            missed,
            sessions: Arc::default(),
        })
    }

    /// Where the file is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Begins a session: what its loop leaves in the sink is written on the topics `T`. `session` describes all that its
    /// end was made of; its number and stamp are given here.
    pub fn begin<T: Topics>(
        &self,
        wall: Wall,
        mut session: Session,
    ) -> RecordSink<T::Given, T::Done> {
        let [masters, slaves] = &*self.sessions;
        let sessions = match T::SIDE {
            Side::Master => masters,
            Side::Slave => slaves,
        };
        session.session = sessions.fetch_add(1, Ordering::Relaxed) + 1;
        session.stamp = wall.stamp(Time::from_nanos(session.began_ns));
        let (sink, entries) = RecordSink::with_room(ROOM, Arc::clone(&self.missed));
        let source = Source::<T>::new(wall, session, entries);
        // the thread that has ended has left its outcome
        let _ = self.orders.send(Order::Begin(Box::new(source)));
        sink
    }

    /// Waits until all that was left so far is written; what comes later is not.
    pub fn finish(&self) -> RecordOutcome {
        let _ = self.orders.send(Order::Finish);
        let done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        done.recv_timeout(FINISH)
            .unwrap_or_else(|gone| RecordOutcome {
                missed: self.missed.load(Ordering::Relaxed),
                error: Some(match gone {
                    RecvTimeoutError::Timeout => RecordFailure::Slow,
                    RecvTimeoutError::Disconnected => RecordFailure::Panicked,
                }),
            })
    }
}

/// What the thread does; returns the file's error.
fn write(file: File, orders: &Receiver<Order>, missed: &AtomicU64) -> Option<String> {
    let mut out = RecordWriter::create(file);
    let mut sources: Vec<Box<dyn Drain>> = Vec::new();
    let mut flushed = Instant::now();
    let mut warned = false;
    loop {
        let mut ends = false;
        while !ends {
            match orders.try_recv() {
                Ok(Order::Begin(source)) => sources.push(source),
                Err(TryRecvError::Empty) => break,
                // or nobody is left who could ask
                Ok(Order::Finish) | Err(TryRecvError::Disconnected) => ends = true,
            }
        }
        let lost = missed.load(Ordering::Relaxed);
        sources.retain_mut(|source| source.drain(lost, &mut out));
        if ends {
            return out.finish();
        }
        if lost > 0 && !warned {
            warned = true;
            tracing::warn!("the disk is too slow for the record: parts of it are missing");
        }
        if flushed.elapsed() >= FLUSH {
            flushed = Instant::now();
            out.flush();
        }
        std::thread::sleep(REST);
    }
}
