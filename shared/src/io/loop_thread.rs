//! A 1 kHz loop on a thread of its own, and its boundary with the network task.
//!
//! Between the two there is one pair of bounded rings of frames, a wake-up, a stop flag and the newest snapshot for
//! viewers, and nothing else. The loop's side never waits, allocates, locks or logs after its first deadline.

mod spawn;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rtrb::{Consumer, Producer, RingBuffer};
use tokio::sync::oneshot;
use triple_buffer::{Input, Output, triple_buffer};

use super::wake::{self, Waker, Wakeup};
use crate::time::Time;
use crate::wire::DATAGRAM_MAX;
pub use spawn::spawn;

/// Frames that may wait for the loop: at 2000 a second, two seconds in which it stands.
pub const ARRIVALS_MAX: usize = 4096;
/// Frames that a tick takes: a peer that floods costs a loop so much of each tick, and no tick.
pub const ARRIVALS_PER_TICK: usize = 64;
/// Frames that may wait for the network task: at 2000 a second, half a second in which that stands.
pub const DEPARTURES_MAX: usize = 1024;
/// A frame keeps one byte more than a datagram may have: one that is too long is seen to be.
const FRAME_MAX: usize = DATAGRAM_MAX + 1;

/// A datagram and when it arrived or left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Its arrival or departure by this host's clock.
    pub at: Time,
    length: u16,
    bytes: [u8; FRAME_MAX],
}

impl Frame {
    /// The front of `bytes`, as much as a frame keeps.
    pub fn new(at: Time, bytes: &[u8]) -> Self {
        let mut frame = Self {
            at,
            length: 0,
            bytes: [0; FRAME_MAX],
        };
        let kept = bytes.get(..FRAME_MAX).unwrap_or(bytes);
        if let Some(front) = frame.bytes.get_mut(..kept.len()) {
            front.copy_from_slice(kept);
            frame.length = kept.len() as u16;
        }
        frame
    }

    /// The datagram.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length.into()).unwrap_or_default()
    }
}

/// The network task's side of a loop that shows snapshots `S` and ends with `T`. Dropping it stops the loop.
#[derive(Debug)]
pub struct LoopHandle<S: Send, T> {
    arrivals: Producer<Frame>,
    departures: Consumer<Frame>,
    snapshots: Output<S>,
    stop: Arc<AtomicBool>,
    hung: Arc<AtomicBool>,
    arrivals_dropped: u64,
    departures_dropped: Arc<AtomicU64>,
    /// Woken when frames are to leave.
    pub wakeup: Wakeup,
    /// What the loop ends with; closed without a value if it panicked or hangs.
    pub finished: oneshot::Receiver<T>,
}

/// The loop's side.
#[derive(Debug)]
pub struct LoopSide<S: Send> {
    arrivals: Consumer<Frame>,
    departures: Producer<Frame>,
    snapshots: Input<S>,
    stop: Arc<AtomicBool>,
    waker: Waker,
    departures_dropped: Arc<AtomicU64>,
}

/// Both sides, and where the loop leaves what it ends with.
pub type Boundary<S, T> = (LoopHandle<S, T>, LoopSide<S>, oneshot::Sender<T>);

/// A boundary. `first` is the snapshot until the loop publishes one. Call it inside of a
/// tokio runtime with I/O.
///
/// # Errors
/// The process is out of descriptors.
pub fn pair<S: Clone + Send, T>(first: &S) -> io::Result<Boundary<S, T>> {
    let (arrivals_in, arrivals) = RingBuffer::new(ARRIVALS_MAX);
    let (departures, departures_out) = RingBuffer::new(DEPARTURES_MAX);
    let (snapshots, snapshots_out) = triple_buffer(first);
    let (waker, wakeup) = wake::pair()?;
    let stop = Arc::new(AtomicBool::new(false));
    let departures_dropped = Arc::new(AtomicU64::new(0));
    let (done, finished) = oneshot::channel();
    let side = LoopSide {
        arrivals,
        departures,
        snapshots,
        stop: Arc::clone(&stop),
        waker,
        departures_dropped: Arc::clone(&departures_dropped),
    };
    let handle = LoopHandle {
        arrivals: arrivals_in,
        departures: departures_out,
        snapshots: snapshots_out,
        stop,
        hung: Arc::default(),
        arrivals_dropped: 0,
        departures_dropped,
        wakeup,
        finished,
    };
    Ok((handle, side, done))
}

impl<S: Send, T> LoopHandle<S, T> {
    /// Hands a datagram that arrived at `at` to the loop. The ring is full only when the loop has stood for seconds: what
    /// then arrives is dropped and counted.
    pub fn deliver(&mut self, at: Time, bytes: &[u8]) {
        if self.arrivals.push(Frame::new(at, bytes)).is_err() {
            self.arrivals_dropped += 1;
        }
    }

    /// The oldest frame that is to leave.
    pub fn next_departure(&mut self) -> Option<Frame> {
        self.departures.pop().ok()
    }

    /// The newest snapshot.
    pub fn snapshot(&mut self) -> &S {
        self.snapshots.read()
    }

    /// Asks the loop to end; then `finished` has what it ends with.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Release);
    }

    /// Whether the loop has ended because a tick hung. Its thread is still there.
    pub fn has_hung(&self) -> bool {
        self.hung.load(Ordering::Acquire)
    }

    /// Datagrams that arrived and found no room before the loop.
    pub fn arrivals_dropped(&self) -> u64 {
        self.arrivals_dropped
    }

    /// Datagrams that were to leave and found no room before the network task.
    pub fn departures_dropped(&self) -> u64 {
        self.departures_dropped.load(Ordering::Relaxed)
    }
}

impl<S: Send, T> Drop for LoopHandle<S, T> {
    fn drop(&mut self) {
        self.stop();
    }
}

impl<S: Send> LoopSide<S> {
    /// The frames that have arrived, oldest first, as many as a tick may take.
    pub fn arrivals(&mut self) -> impl Iterator<Item = Frame> {
        (0..ARRIVALS_PER_TICK).map_while(|_| self.arrivals.pop().ok())
    }

    /// Leaves what `next` writes, datagram by datagram until there is none, for the network task, and wakes it once. What
    /// finds no room is dropped and counted.
    pub fn send(&mut self, now: Time, mut next: impl FnMut(&mut [u8]) -> Option<usize>) {
        let mut buffer = [0; DATAGRAM_MAX];
        let mut leaves = false;
        while let Some(length) = next(&mut buffer) {
            let frame = Frame::new(now, buffer.get(..length).unwrap_or_default());
            if self.departures.push(frame).is_ok() {
                leaves = true;
            } else {
                self.departures_dropped.fetch_add(1, Ordering::Relaxed);
            }
        }
        if leaves {
            self.waker.wake();
        }
    }

    /// Shows a snapshot; the one before is gone.
    pub fn publish(&mut self, snapshot: S) {
        *self.snapshots.input_buffer_mut() = snapshot;
        self.snapshots.publish();
    }

    /// Whether the network task has asked the loop to end.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Acquire)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::clock::Clock;

    const AT: fn(u64) -> Time = Time::from_millis;

    #[tokio::test]
    async fn frames_keep_their_order_bytes_and_times_and_what_finds_no_room_is_counted() {
        let (mut handle, mut side, _done) = pair::<u8, ()>(&0).unwrap();
        for n in 0..ARRIVALS_MAX as u64 + 3 {
            handle.deliver(AT(n), &n.to_le_bytes());
        }
        assert_eq!(handle.arrivals_dropped() + handle.departures_dropped(), 3);
        for n in 0..ARRIVALS_MAX as u64 {
            let frame = side.arrivals().next().unwrap();
            assert_eq!((frame.at, frame.bytes()), (AT(n), &n.to_le_bytes()[..]));
        }
        assert_eq!(side.arrivals().next(), None);
        let mut left = DEPARTURES_MAX + 2;
        side.send(AT(7), |out| {
            out[..2].copy_from_slice(b"up");
            left -= 1;
            (left > 0).then_some(2)
        });
        assert_eq!(
            handle.arrivals_dropped() + handle.departures_dropped(),
            3 + 1
        );
        handle.wakeup.wait().await.unwrap();
        assert_eq!(handle.next_departure().unwrap().bytes(), b"up");
    }

    #[test]
    fn a_datagram_that_is_too_long_stays_too_long() {
        let long = Frame::new(AT(1), &[7; DATAGRAM_MAX + 100]);
        assert_eq!(long.bytes().len(), DATAGRAM_MAX + 1);
        let fits = Frame::new(AT(1), &[7; DATAGRAM_MAX]);
        assert_eq!(fits.bytes(), &[7; DATAGRAM_MAX]);
    }

    #[tokio::test]
    async fn a_thread_runs_until_it_is_stopped_and_a_panic_is_seen() {
        let handle = spawn("test", Clock::start(), &0, |mut side, mut ticker| {
            let mut ticks = 0;
            while !side.is_stopped() {
                ticker.wait();
                ticks += 1;
                side.publish(ticks);
            }
            ticks
        });
        let mut handle = handle.unwrap();
        while *handle.snapshot() < 3 {
            tokio::time::sleep(std::time::Duration::from_millis(1)).await;
        }
        handle.stop();
        assert!((&mut handle.finished).await.unwrap() >= 3);
        let broken = spawn("test", Clock::start(), &0, |_, _| panic!("on purpose"));
        let mut broken: LoopHandle<i32, ()> = broken.unwrap();
        assert!((&mut broken.finished).await.is_err());
        assert!(!broken.has_hung() && !handle.has_hung());
    }

    #[tokio::test]
    async fn a_tick_that_does_not_end_ends_the_loop_whether_it_is_blocked_or_computes() {
        let over = Arc::new(AtomicBool::new(false));
        let (release, blocked) = std::sync::mpsc::channel::<()>();
        let computes = Arc::clone(&over);
        let blocks = move || {
            let _ = blocked.recv();
        };
        let spins = move || while !computes.load(Ordering::Relaxed) {};
        let hangs: [Box<dyn FnOnce() + Send>; 2] = [Box::new(blocks), Box::new(spins)];
        for hang in hangs {
            let handle = spawn("test", Clock::start(), &0, |_, mut ticker| {
                ticker.wait();
                ticker.wait();
                hang();
            });
            let mut handle: LoopHandle<i32, ()> = handle.unwrap();
            assert!((&mut handle.finished).await.is_err());
            assert!(handle.has_hung());
        }
        over.store(true, Ordering::Relaxed);
        drop(release);
    }
}
