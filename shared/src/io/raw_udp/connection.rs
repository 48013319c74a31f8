//! One connection of raw UDP: datagrams that may be lost, letters that are repeated, and an end.
//!
//! What waits to be read is bounded; the oldest datagram goes first. It never waits for the socket: what the socket
//! has no room for is lost and counted.

use std::collections::VecDeque;
use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use bytes::Bytes;
use quinn::udp::Transmit;
use quinn::{
    ApplicationClose, AsyncUdpSocket, ConnectionError, Runtime, SendDatagramError, VarInt,
    WriteError,
};
use tokio::sync::Notify;

use super::letters::Letters;
use super::packet::{Body, HEADER, NUMBER, PACKET_MAX, Packet};
use crate::io::runtime::until;
use crate::io::stream::{ReadFrameError, WriteFrameError};

/// A letter without a receipt is repeated after this long.
const REPEAT: Duration = Duration::from_millis(100);
/// Datagrams that may wait to be read: as many small ones as QUIC's queue takes.
const WAITING_MAX: usize = 512;

/// A connection; clones are the same one. The last to go closes it.
#[derive(Clone, Debug)]
pub struct Connection(Arc<Held>);

#[derive(Debug)]
struct Held(Arc<Ends>);

impl Drop for Held {
    fn drop(&mut self) {
        self.0.close(0, b"");
    }
}

/// What the endpoint and the connection share.
#[derive(Debug)]
pub(super) struct Ends {
    pub(super) number: u32,
    pub(super) remote: SocketAddr,
    socket: Arc<dyn AsyncUdpSocket>,
    runtime: Arc<dyn Runtime>,
    state: Mutex<State>,
    /// For who reads datagrams.
    datagram: Notify,
    /// For who reads letters.
    letter: Notify,
    /// For who writes letters.
    receipt: Notify,
    /// For who waits for the end.
    over: Notify,
}

#[derive(Debug, Default)]
struct State {
    datagrams: VecDeque<Bytes>,
    letters: Letters,
    closed: Option<ConnectionError>,
    sent: u64,
    received: u64,
}

/// Waits for `future`, at most `limit`.
async fn within<T>(
    runtime: &dyn Runtime,
    limit: Duration,
    future: impl Future<Output = T>,
) -> Option<T> {
    // no instant is that late: then there is no limit
    until(runtime, runtime.now().checked_add(limit), future).await
}

impl Ends {
    pub(super) fn new(
        number: u32,
        remote: SocketAddr,
        socket: Arc<dyn AsyncUdpSocket>,
        runtime: Arc<dyn Runtime>,
        letters: Letters,
    ) -> Self {
        let state = State {
            letters,
            ..State::default()
        };
        Self {
            number,
            remote,
            socket,
            runtime,
            state: Mutex::new(state),
            datagram: Notify::new(),
            letter: Notify::new(),
            receipt: Notify::new(),
            over: Notify::new(),
        }
    }

    /// Nobody can leave it half changed.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn send(&self, body: Body<'_>) -> io::Result<()> {
        send(&*self.socket, self.remote, self.number, body)
    }

    /// Takes in a packet of this connection.
    pub(super) fn take(&self, body: Body<'_>) {
        match body {
            Body::Datagram(message) => {
                let mut state = self.state();
                state.received += 1;
                if state.datagrams.len() == WAITING_MAX {
                    state.datagrams.pop_front();
                }
                state.datagrams.push_back(Bytes::copy_from_slice(message));
                drop(state);
                self.datagram.notify_one();
            }
            Body::Letter { number, message } => {
                let receipt = self.state().letters.take(number, message);
                if let Some(number) = receipt {
                    // a lost receipt brings the letter again
                    let _ = self.send(Body::Receipt { number });
                }
                self.letter.notify_one();
            }
            Body::Receipt { number } => {
                if self.state().letters.receipt(number) {
                    self.receipt.notify_one();
                }
            }
            Body::Close { code, reason } => {
                self.end(ConnectionError::ApplicationClosed(ApplicationClose {
                    error_code: VarInt::from(code),
                    reason: Bytes::copy_from_slice(reason),
                }));
            }
        }
    }

    /// The connection is over, unless it was already.
    pub(super) fn end(&self, why: ConnectionError) {
        self.state().closed.get_or_insert(why);
        for waiting in [&self.datagram, &self.letter, &self.receipt, &self.over] {
            waiting.notify_one();
        }
    }

    fn close(&self, code: u8, reason: &[u8]) {
        if self.closed().is_some() {
            return;
        }
        // said once: whoever does not hear it notices the silence
        let _ = self.send(Body::Close { code, reason });
        self.end(ConnectionError::LocallyClosed);
    }

    pub(super) fn closed(&self) -> Option<ConnectionError> {
        self.state().closed.clone()
    }

    /// Something out of the state, or the end; waits on `news` until there is one of them.
    async fn wait<T>(
        &self,
        news: &Notify,
        mut look: impl FnMut(&mut State) -> Option<T>,
    ) -> Result<T, ConnectionError> {
        loop {
            {
                let mut state = self.state();
                if let Some(found) = look(&mut state) {
                    return Ok(found);
                }
                if let Some(why) = &state.closed {
                    return Err(why.clone());
                }
            }
            news.notified().await;
        }
    }
}

/// Sends a packet, now or never.
pub(super) fn send(
    socket: &dyn AsyncUdpSocket,
    destination: SocketAddr,
    connection: u32,
    body: Body<'_>,
) -> io::Result<()> {
    let mut contents = Vec::with_capacity(PACKET_MAX);
    Packet { connection, body }.write(&mut contents);
    socket.try_send(&Transmit {
        destination,
        ecn: None,
        contents: &contents,
        segment_size: None,
        src_ip: None,
    })
}

impl Connection {
    pub(super) fn new(ends: Arc<Ends>) -> Self {
        Self(Arc::new(Held(ends)))
    }

    fn ends(&self) -> &Ends {
        &self.0.0
    }

    /// Who is at the other end.
    #[must_use]
    pub fn remote_address(&self) -> SocketAddr {
        self.ends().remote
    }

    /// Sends a datagram, now or never: what the socket has no room for counts as taken and is lost.
    ///
    /// # Errors
    /// It is too long or the connection is over.
    pub fn send_datagram(&self, message: &[u8]) -> Result<(), SendDatagramError> {
        if let Some(why) = self.ends().closed() {
            return Err(SendDatagramError::ConnectionLost(why));
        }
        if message.len() > PACKET_MAX - HEADER {
            return Err(SendDatagramError::TooLarge);
        }
        if self.ends().send(Body::Datagram(message)).is_ok() {
            self.ends().state().sent += 1;
        }
        Ok(())
    }

    /// The next datagram. Cancel-safe; one reader at a time.
    ///
    /// # Errors
    /// The connection is over and nothing waits any more.
    pub async fn read_datagram(&self) -> Result<Bytes, ConnectionError> {
        let ends = self.ends();
        ends.wait(&ends.datagram, |state| state.datagrams.pop_front())
            .await
    }

    /// Writes a letter and repeats it until its receipt has come, at most `limit`. Not cancel-safe; one writer at
    /// a time.
    ///
    /// # Errors
    /// It is too long for a packet, no receipt came in time, or the connection is over.
    pub async fn write_letter(
        &self,
        message: &[u8],
        limit: Duration,
    ) -> Result<(), WriteFrameError> {
        let bytes = message.len();
        if bytes > PACKET_MAX - HEADER - NUMBER {
            return Err(WriteFrameError::TooLong { bytes });
        }
        let ends = self.ends();
        let number = ends.state().letters.number();
        let repeated = async {
            loop {
                // what the socket does not take is repeated like what the path loses
                let _ = ends.send(Body::Letter { number, message });
                let come = ends.wait(&ends.receipt, |state| {
                    state.letters.has_come(number).then_some(())
                });
                if let Some(come) = within(&*ends.runtime, REPEAT, come).await {
                    return come;
                }
            }
        };
        match within(&*ends.runtime, limit, repeated).await {
            Some(Ok(())) => Ok(()),
            Some(Err(why)) => Err(WriteError::ConnectionLost(why).into()),
            None => Err(WriteFrameError::Slow { limit }),
        }
    }

    /// Reads a letter of at most `max` bytes, within `limit`. One reader at a time.
    ///
    /// # Errors
    /// It is longer, none came in time, or the connection is over.
    pub async fn read_letter(
        &self,
        max: usize,
        limit: Duration,
    ) -> Result<Vec<u8>, ReadFrameError> {
        let ends = self.ends();
        let come = ends.wait(&ends.letter, |state| state.letters.read());
        match within(&*ends.runtime, limit, come).await {
            Some(Ok(letter)) if letter.len() > max => Err(ReadFrameError::TooLong {
                bytes: letter.len(),
                max,
            }),
            Some(Ok(letter)) => Ok(letter),
            Some(Err(why)) => Err(ReadFrameError::Stream(quinn::ReadError::ConnectionLost(
                why,
            ))),
            None => Err(ReadFrameError::Slow { limit }),
        }
    }

    /// Says once that it is over, and why.
    pub fn close(&self, code: u8, reason: &[u8]) {
        self.ends().close(code, reason);
    }

    /// Waits for the end, and tells why.
    pub async fn closed(&self) -> ConnectionError {
        let ends = self.ends();
        match ends.wait(&ends.over, |_| None::<()>).await {
            Err(why) => why,
            Ok(()) => ConnectionError::LocallyClosed,
        }
    }

    /// Datagrams that the socket took, and datagrams that came.
    #[must_use]
    pub fn datagrams(&self) -> (u64, u64) {
        let state = self.ends().state();
        (state.sent, state.received)
    }
}
