//! The object's plug on a UDP port: a thread that takes a plant's answers, and the loop's end of it.
//!
//! The loop takes answers from a bounded ring and sends its command itself, one system call a tick; it never waits for the
//! plant or this thread.

mod lock_step;
#[cfg(test)]
mod tests;

use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use mmt_shared::io::clock::Clock;
use mmt_shared::io::plug_socket::{PACKET_MAX, PlugSocket, PlugSocketError};
use mmt_shared::model::geometry::Pose;
use mmt_shared::plug::{Admitted, PlugCounts, PlugHead, PlugPeer, PlugToken};
use mmt_shared::time::Time;
use rtrb::{Consumer, Producer, RingBuffer};

use crate::plant::{PlantAnswer, PlantCommand, SILENCE};
use crate::slave::{Memory, SlaveConfig};
pub use lock_step::{LockStep, LockStepError};

/// Answers that may wait for the loop: a quarter of a second at 1 kHz.
const ANSWERS_MAX: usize = 256;
/// A command that cannot be sent at once is lost.
const SEND_WAIT: Duration = Duration::from_micros(500);

/// A plant cannot be plugged in.
#[derive(Debug, thiserror::Error)]
pub enum PlantHostError {
    /// It cannot listen.
    #[error("the plant: {0}")]
    Socket(#[from] PlugSocketError),
    /// Its socket cannot be set up.
    #[error("the plant's socket cannot be set up: {0}")]
    Setup(#[source] io::Error),
    /// No thread.
    #[error("no thread for the plant's plug: {0}")]
    Thread(#[source] io::Error),
}

/// An answer, when it came, and where from.
#[derive(Clone, Copy, Debug)]
struct Taken {
    at: Time,
    from: SocketAddr,
    sequence: u32,
    answer: PlantAnswer,
}

/// What the thread keeps, under a lock that no tick takes.
#[derive(Debug, Default)]
struct Known {
    newest: Option<Taken>,
    /// Where the object was seen last.
    object: Option<Pose>,
    to_loop: Option<Producer<Taken>>,
    counts: PlugCounts,
    /// Answers for which the loop had no room.
    ring_full: u64,
}

#[derive(Debug)]
struct Shared {
    socket: PlugSocket,
    clock: Clock,
    /// Commands sent so far.
    sent: AtomicU32,
    /// Answers that a newer one overtook before a tick took them.
    superseded: AtomicU64,
    known: Mutex<Known>,
    first: Condvar,
}

impl Shared {
    fn new(socket: PlugSocket) -> Self {
        Self {
            socket,
            clock: Clock::start(),
            sent: AtomicU32::new(0),
            superseded: AtomicU64::new(0),
            known: Mutex::default(),
            first: Condvar::new(),
        }
    }

    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A plug for a plant; it ends with the process.
#[derive(Clone, Debug)]
pub struct PlantHost(Arc<Shared>);

impl PlantHost {
    /// Starts to listen.
    ///
    /// # Errors
    /// See [`PlantHostError`].
    pub fn start(listen: SocketAddr) -> Result<Self, PlantHostError> {
        let socket = PlugSocket::bind(listen)?;
        let patience = socket.socket().set_write_timeout(Some(SEND_WAIT));
        patience.map_err(PlantHostError::Setup)?;
        let shared = Arc::new(Shared::new(socket));
        let served = Arc::clone(&shared);
        std::thread::Builder::new()
            .name("mmt-plant".to_owned())
            .spawn(move || serve(&served))
            .map_err(PlantHostError::Thread)?;
        Ok(Self(shared))
    }

    /// The address for the plant. It holds the token.
    #[must_use]
    pub fn address(&self) -> String {
        self.0.socket.address()
    }

    /// Waits for a plant to plug in, at most so long; whether one has.
    #[must_use]
    pub fn wait(&self, most: Duration) -> bool {
        let known = self.0.known();
        let waited = (self.0.first).wait_timeout_while(known, most, |known| known.newest.is_none());
        let (known, _) = waited.unwrap_or_else(PoisonError::into_inner);
        known.newest.is_some()
    }

    /// What a session begins with: the tool as the plant reported it last, and the object where it was seen last, or, until it
    /// was, where it is configured. None before its first answer.
    pub(super) fn memory(&self, config: &SlaveConfig, earlier: Option<&Memory>) -> Option<Memory> {
        let (newest, seen) = {
            let known = self.0.known();
            (known.newest?, known.object)
        };
        let first = config.scene.bodies.first();
        let configured = first.map_or(config.environment.pose, |body| body.pose);
        let seen = seen.or_else(|| earlier.and_then(Memory::object));
        let object = seen.unwrap_or(configured);
        Some(Memory::of_plant(newest.answer.tool, object, earlier))
    }

    /// The plant for the loop of a session that begins; the one before gets nothing any more.
    pub(super) fn port(&self) -> PlantPort {
        let (producer, answers) = RingBuffer::new(ANSWERS_MAX);
        let mut known = self.0.known();
        known.to_loop = Some(producer);
        PlantPort {
            shared: Arc::clone(&self.0),
            answers,
            newest: known.newest,
            last_answer: None,
        }
    }

    /// What became of the plant's packets.
    pub(super) fn counts(&self) -> PlugCounts {
        self.0.known().counts
    }

    /// Answers that came as they should and that no tick was given, by name.
    pub(super) fn not_given(&self) -> [(&'static str, u64); 2] {
        let superseded = self.0.superseded.load(Ordering::Relaxed);
        let ring_full = self.0.known().ring_full;
        [("superseded", superseded), ("ring_full", ring_full)]
    }
}

/// The loop's end of the plug.
#[derive(Debug)]
pub(super) struct PlantPort {
    shared: Arc<Shared>,
    answers: Consumer<Taken>,
    newest: Option<Taken>,
    /// When the newest answer was taken; none before the first tick.
    last_answer: Option<Time>,
}

impl PlantPort {
    /// The newest answer, if one has come since the tick before, with the newest image since then; `now` is this one's deadline.
    pub(super) fn receive(&mut self, now: Time) -> Option<PlantAnswer> {
        self.last_answer.get_or_insert(now);
        let mut anew = false;
        let (mut newest, mut image) = (None, None);
        while let Ok(taken) = self.answers.pop() {
            anew |= taken.answer.anew;
            image = taken.answer.object.map(|_| taken).or(image);
            if newest.replace(taken).is_some() {
                self.shared.superseded.fetch_add(1, Ordering::Relaxed);
            }
        }
        let taken = newest?;
        (self.newest, self.last_answer) = (newest, Some(now));
        let image_age_s = image.map_or(0.0, |image: Taken| {
            let since = taken.at.saturating_since(image.at);
            image.answer.image_age_s + since.as_secs_f64()
        });
        Some(PlantAnswer {
            anew,
            object: image.and_then(|image| image.answer.object),
            image_age_s,
            ..taken.answer
        })
    }

    /// Whether the plant is silent at `now`.
    pub(super) fn is_silent(&self, now: Time) -> bool {
        self.last_answer
            .is_some_and(|last_answer| now.saturating_since(last_answer) >= SILENCE)
    }

    /// Sends the tool on.
    pub(super) fn send(&mut self, command: &PlantCommand) {
        let Some(newest) = self.newest else {
            return;
        };
        let shared = &self.shared;
        let sequence = shared.sent.fetch_add(1, Ordering::Relaxed).wrapping_add(1);
        let head = PlugHead {
            flags: 0,
            sequence,
            answers: newest.sequence,
            stamp_ns: shared.clock.now().as_nanos(),
        };
        // if it is lost, the next is due in a millisecond
        let packet = command.packet(shared.socket.token(), &head);
        shared.socket.send(&packet, newest.from);
    }
}

fn serve(shared: &Shared) {
    let mut receiver = Receiver::new();
    let mut packet = [0; PACKET_MAX];
    loop {
        let (packet, from) = shared.socket.receive(&mut packet);
        receiver.handle(shared, shared.clock.now(), from, packet);
    }
}

/// Takes the answers of the plant that is plugged in.
struct Receiver {
    peer: PlugPeer,
    /// When the newest answer came that could be.
    last: Option<Time>,
}

impl Receiver {
    fn new() -> Self {
        Self {
            peer: PlugPeer::new(SILENCE),
            last: None,
        }
    }

    /// Takes in a packet that came from there at `now`, and hands an answer on.
    fn handle(&mut self, shared: &Shared, now: Time, from: SocketAddr, packet: &[u8]) {
        let taken = self.take(shared.socket.token(), now, from, packet);
        let mut known = shared.known();
        known.counts = self.peer.counts;
        if let Some(taken) = taken {
            known.newest = Some(taken);
            known.object = taken.answer.object.or(known.object);
            // a full ring is a loop that stands: it takes what waits later
            let to_loop = known.to_loop.as_mut().filter(|ring| !ring.is_abandoned());
            let is_full = to_loop.is_some_and(|ring| ring.push(taken).is_err());
            known.ring_full += u64::from(is_full);
            shared.first.notify_all();
        }
    }

    /// An answer of the plant that is plugged in, if it is one.
    fn take(
        &mut self,
        token: &PlugToken,
        now: Time,
        from: SocketAddr,
        packet: &[u8],
    ) -> Option<Taken> {
        let read = PlantAnswer::read(token, packet);
        let (head, answer) = read.map_err(|why| self.peer.refuse(why)).ok()?;
        let admitted = self.peer.admit(now, from, head.sequence)?;
        if admitted == Admitted::First {
            tracing::info!("a plant is plugged in at {from}");
        }
        let Some(answer) = answer else {
            self.peer.counts.nonsense += 1;
            return None;
        };
        // nonsense is a silence too
        let last = self.last.replace(now);
        let anew = last.is_none_or(|last| now.saturating_since(last) >= SILENCE);
        Some(Taken {
            at: now,
            from,
            sequence: head.sequence,
            answer: PlantAnswer { anew, ..answer },
        })
    }
}
