//! The network task of a session, the same on both sides: it moves bytes and time between a connection and a 1 kHz loop.
//!
//! It decides nothing about the model and never waits for the network to take a datagram: what cannot be sent now is
//! dropped and counted. What ends a session it reports as an event; what follows is its caller's affair.

use std::pin::Pin;
use std::time::Duration;

use bytes::Bytes;
use tokio::sync::watch;
use tokio::time::{Interval, MissedTickBehavior, interval, timeout};

use super::clock::Clock;
use super::loop_thread::LoopHandle;
use super::transport::{Connection, ConnectionError, SendDatagramError};
use super::wish::{Wish, asked_to_stop};
use crate::report::SessionStats;

/// Between two beats, at which a caller reads the loop's snapshot: 62 a second, a frame of most screens.
pub const BEAT: Duration = Duration::from_millis(16);
/// More datagrams than QUIC's queue holds.
pub const WAITING_MAX: usize = 4096;

/// What the task counts besides what the ends count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct NetworkCounts {
    /// Datagrams read from the connection; what it received and nobody read it dropped itself.
    read: u64,
    /// Datagrams that the connection took; what it did not send it dropped itself.
    given: u64,
    /// Longer than the path takes.
    send_too_large: u64,
    /// The peer takes no datagrams, or the connection sends none.
    send_unsupported: u64,
    /// The connection was gone.
    send_disconnected: u64,
}

/// What happened that a session must know. Each of the first four happens once at most.
#[derive(Debug)]
pub enum Event<T, F> {
    /// The read of the other side's farewell has ended.
    Farewell(F),
    /// The session is to end, for this reason.
    Stopped(Wish),
    /// The connection is gone.
    Disconnected(ConnectionError),
    /// The loop has ended, by itself, or by a panic or a hang (none).
    LoopEnded(Option<T>),
    /// It is time to read the snapshot.
    Beat,
}

/// The network task of a session.
#[derive(Debug)]
pub struct NetworkTask<S: Send, T> {
    clock: Clock,
    connection: Connection,
    handle: LoopHandle<S, T>,
    counts: NetworkCounts,
    beat: Interval,
    connected: bool,
    /// Whether the read of the farewell still waits; once it has ended it must not be polled again.
    awaits_farewell: bool,
    stopped: bool,
    wakes: bool,
}

impl<S: Send, T> NetworkTask<S, T> {
    /// The task of a session that begins. Call it inside of a tokio runtime with time.
    pub fn new(clock: Clock, connection: Connection, handle: LoopHandle<S, T>) -> Self {
        let mut beat = interval(BEAT);
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        Self {
            clock,
            connection,
            handle,
            counts: NetworkCounts::default(),
            beat,
            connected: true,
            awaits_farewell: true,
            stopped: false,
            wakes: true,
        }
    }

    /// Adds what was dropped between the loop and the network so far, by name and by who did not pass it on.
    pub fn add_to(&self, stats: &mut SessionStats) {
        stats.unsent = Some(self.unsent());
        stats.unread = Some(self.unread());
        let rings = self.handle.arrivals_dropped() + self.handle.departures_dropped();
        stats.add_drops([
            ("datagrams_displaced", self.displaced()),
            ("datagrams_ring_full", rings),
            ("datagrams_unread", self.left_unread()),
            ("send_disconnected", self.counts.send_disconnected),
            ("send_too_large", self.counts.send_too_large),
            ("send_unsupported", self.counts.send_unsupported),
        ]);
    }

    /// Datagrams that this end made and did not send while the connection was up.
    pub fn unsent(&self) -> u64 {
        let refused = self.counts.send_too_large + self.counts.send_unsupported;
        self.displaced() + refused + self.handle.departures_dropped()
    }

    /// Datagrams that arrived and never reached the loop.
    pub fn unread(&self) -> u64 {
        self.left_unread() + self.handle.arrivals_dropped()
    }

    /// Datagrams that QUIC dropped for newer ones, or still holds.
    fn displaced(&self) -> u64 {
        (self.counts.given).saturating_sub(self.connection.datagrams().sent)
    }

    /// Datagrams that QUIC received and nobody read.
    fn left_unread(&self) -> u64 {
        (self.connection.datagrams().received).saturating_sub(self.counts.read)
    }

    /// The loop's handle.
    pub fn handle(&mut self) -> &mut LoopHandle<S, T> {
        &mut self.handle
    }

    /// Whether the connection is up.
    pub fn is_connected(&self) -> bool {
        self.connected
    }

    /// Whether the slave closed the connection because another operator has taken over.
    pub fn is_taken_over(&self) -> bool {
        self.connection.is_taken_over()
    }

    /// Whether the read of the other side's farewell still waits.
    pub fn awaits_farewell(&self) -> bool {
        self.awaits_farewell
    }

    /// Moves datagrams until something else happens. `farewell` is the read of the other side's farewell.
    pub async fn next<F: Future>(
        &mut self,
        mut farewell: Pin<&mut F>,
        stop: &mut watch::Receiver<Wish>,
    ) -> Event<T, F::Output> {
        loop {
            // in this order, so that a flood of datagrams holds up nothing else
            tokio::select! {
                biased;
                read = farewell.as_mut(), if self.awaits_farewell => {
                    self.awaits_farewell = false;
                    return Event::Farewell(read);
                }
                wish = asked_to_stop(stop), if !self.stopped => {
                    self.stopped = true;
                    return Event::Stopped(wish);
                }
                ended = &mut self.handle.finished => {
                    self.send_departures();
                    return Event::LoopEnded(ended.ok());
                }
                woken = self.handle.wakeup.wait(), if self.wakes => {
                    // only a runtime that shuts down fails here
                    self.wakes = woken.is_ok();
                    self.send_departures();
                }
                _ = self.beat.tick() => return Event::Beat,
                datagram = self.connection.read_datagram(), if self.connected => match datagram {
                    Ok(bytes) => self.take(&bytes),
                    Err(error) => {
                        self.connected = false;
                        return Event::Disconnected(error);
                    }
                },
            }
        }
    }

    /// Takes the datagrams that have arrived and were not read, stops the loop and waits for what it ends with, at most
    /// `limit`; none if it panicked or has hung.
    pub async fn stop_loop(&mut self, limit: Duration) -> Option<T> {
        self.drain().await;
        self.handle.stop();
        let ended = timeout(limit, &mut self.handle.finished).await;
        self.send_departures();
        ended.ok()?.ok()
    }

    async fn drain(&mut self) {
        for _ in 0..WAITING_MAX {
            match timeout(Duration::ZERO, self.connection.read_datagram()).await {
                Ok(Ok(datagram)) => self.take(&datagram),
                _ => break,
            }
        }
    }

    /// Hands a datagram to the loop; its arrival is this moment.
    fn take(&mut self, datagram: &Bytes) {
        self.counts.read += 1;
        self.handle.deliver(self.clock.now(), datagram);
    }

    fn send_departures(&mut self) {
        while let Some(frame) = self.handle.next_departure() {
            let given = self
                .connection
                .send_datagram(Bytes::copy_from_slice(frame.bytes()));
            let counter = match &given {
                Ok(()) => &mut self.counts.given,
                Err(SendDatagramError::TooLarge) => &mut self.counts.send_too_large,
                Err(SendDatagramError::ConnectionLost(_)) => &mut self.counts.send_disconnected,
                Err(SendDatagramError::UnsupportedByPeer | SendDatagramError::Disabled) => {
                    &mut self.counts.send_unsupported
                }
            };
            *counter += 1;
        }
    }
}
