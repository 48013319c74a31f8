//! A socket with the connections of raw UDP on it: what the endpoint and its driver share.
//!
//! One that accepts lets anybody in who knows the protocol's name; who may operate is the hello's business.

use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Waker;

use quinn::{AsyncUdpSocket, ConnectionError, Runtime};
use tokio::sync::Notify;

use super::connection::{Connection, Ends, send};
use super::letters::Letters;
use super::packet::{Body, Packet};
use crate::io::versions::CLOSE_OTHER_VERSION;
use crate::wire::ALPN;

/// Connections that may wait to be accepted. One more hears nothing, and knocks again.
const INCOMING_MAX: usize = 8;
/// Connections at once: a slave has one master, and judges few more.
const CONNECTIONS_MAX: usize = 64;
/// Close code: the endpoint knows no such connection, as after a restart.
const CLOSE_UNKNOWN: u8 = 2;

/// What the endpoint and its driver share.
#[derive(Debug)]
pub(super) struct Hub {
    pub(super) socket: Arc<dyn AsyncUdpSocket>,
    runtime: Arc<dyn Runtime>,
    accepts: bool,
    state: Mutex<State>,
    knock: Notify,
}

#[derive(Debug, Default)]
struct State {
    connections: BTreeMap<(SocketAddr, u32), Arc<Ends>>,
    incoming: VecDeque<Connection>,
    closed: bool,
    driver: Option<Waker>,
}

impl Hub {
    pub(super) fn new(
        socket: Arc<dyn AsyncUdpSocket>,
        runtime: Arc<dyn Runtime>,
        accepts: bool,
    ) -> Self {
        Self {
            socket,
            runtime,
            accepts,
            state: Mutex::default(),
            knock: Notify::new(),
        }
    }

    /// Nobody can leave it half changed.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn add(&self, number: u32, remote: SocketAddr, letters: Letters) -> Arc<Ends> {
        let (socket, runtime) = (Arc::clone(&self.socket), Arc::clone(&self.runtime));
        let ends = Arc::new(Ends::new(number, remote, socket, runtime, letters));
        let mut state = self.state();
        state.connections.retain(|_, ends| ends.closed().is_none());
        state
            .connections
            .insert((remote, number), Arc::clone(&ends));
        ends
    }

    /// The next connection that somebody has opened; none once the endpoint is closed. Cancel-safe.
    pub(super) async fn accept(&self) -> Option<Connection> {
        loop {
            {
                let mut state = self.state();
                if let Some(connection) = state.incoming.pop_front() {
                    return Some(connection);
                }
                if state.closed {
                    return None;
                }
            }
            self.knock.notified().await;
        }
    }

    /// Whether the endpoint is closed; if not, `waker` hears when it is.
    pub(super) fn is_closed(&self, waker: &Waker) -> bool {
        let mut state = self.state();
        state.driver = Some(waker.clone());
        state.closed
    }

    /// The socket has failed: so has everything on it.
    pub(super) fn fail(&self) {
        self.end(|ends| ends.end(ConnectionError::Reset));
    }

    pub(super) fn close(&self, code: u8, reason: &[u8]) {
        self.end(|ends| {
            let body = Body::Close { code, reason };
            if ends.closed().is_none() {
                // said once: whoever does not hear it notices the silence
                let _ = send(&*self.socket, ends.remote, ends.number, body);
            }
            ends.end(ConnectionError::LocallyClosed);
        });
    }

    fn end(&self, each: impl Fn(&Ends)) {
        let mut state = self.state();
        state.closed = true;
        let (connections, incoming) = (
            std::mem::take(&mut state.connections),
            std::mem::take(&mut state.incoming),
        );
        let driver = state.driver.take();
        drop(state);
        connections.values().for_each(|ends| each(ends));
        drop(incoming);
        self.knock.notify_one();
        if let Some(driver) = driver {
            driver.wake();
        }
    }

    /// Takes in what came from somebody.
    pub(super) fn take(&self, from: SocketAddr, bytes: &[u8]) {
        let Some(Packet { connection, body }) = Packet::read(bytes) else {
            return;
        };
        let known = self.state().connections.get(&(from, connection)).cloned();
        match (known.filter(|ends| ends.closed().is_none()), body) {
            (Some(ends), body) => ends.take(body),
            (None, Body::Letter { number: 0, message }) if self.accepts => {
                self.open(from, connection, message);
            }
            (None, Body::Datagram(_) | Body::Letter { .. }) => {
                let body = Body::Close {
                    code: CLOSE_UNKNOWN,
                    reason: b"",
                };
                let _ = send(&*self.socket, from, connection, body);
            }
            (None, Body::Receipt { .. } | Body::Close { .. }) => {}
        }
    }

    fn open(&self, from: SocketAddr, number: u32, name: &[u8]) {
        if name != ALPN.as_bytes() {
            let code = u8::try_from(CLOSE_OTHER_VERSION.into_inner()).unwrap_or(u8::MAX);
            let reason = ALPN.as_bytes();
            let _ = send(&*self.socket, from, number, Body::Close { code, reason });
            return;
        }
        {
            let state = self.state();
            let full =
                state.incoming.len() >= INCOMING_MAX || state.connections.len() >= CONNECTIONS_MAX;
            if full || state.closed {
                return;
            }
        }
        let ends = self.add(number, from, Letters::opened());
        let _ = send(&*self.socket, from, number, Body::Receipt { number: 0 });
        self.state().incoming.push_back(Connection::new(ends));
        self.knock.notify_one();
    }
}
