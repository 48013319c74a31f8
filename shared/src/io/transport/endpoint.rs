//! Endpoints of either transport: the master's way to a connection, and the slave's to those of masters.
//!
//! When the connection is there, the slave has proven itself. Who may operate is judged by the hello.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use quinn::{AsyncUdpSocket, VarInt};

use super::choice::Transport;
use super::connection::{CLOSE_OTHER_TRANSPORT, Connection};
use crate::io::connect::{ConnectError, connect};
use crate::io::identity::Identity;
use crate::io::quic::{EndpointError, Traffic, client_endpoint, server_endpoint};
use crate::io::raw_udp::SharedSocket;
use crate::pairing::Pin;

/// The socket that raw datagrams share with QUIC; none if they go by QUIC.
pub(super) type Raw = Option<Arc<SharedSocket>>;

/// An endpoint; clones are the same one.
#[derive(Clone, Debug)]
pub struct Endpoint {
    pub(super) quic: quinn::Endpoint,
    pub(super) raw: Raw,
}

impl From<quinn::Endpoint> for Endpoint {
    /// An endpoint whose datagrams go by QUIC.
    fn from(quic: quinn::Endpoint) -> Self {
        Self { quic, raw: None }
    }
}

/// The socket for QUIC and for raw datagrams.
fn share(transport: Transport, socket: Arc<dyn AsyncUdpSocket>) -> (Arc<dyn AsyncUdpSocket>, Raw) {
    if transport == Transport::Quic {
        return (socket, None);
    }
    let shared = Arc::new(SharedSocket::new(socket));
    (Arc::clone(&shared) as _, Some(shared))
}

/// What QUIC has to carry of a side's traffic.
fn by_quic(raw: &Raw, mut traffic: Traffic) -> Traffic {
    if raw.is_some() {
        traffic.datagram_max = 0;
    }
    traffic
}

/// The connection, if both sides use the same transport: one that has its datagrams beside QUIC takes none by QUIC.
pub(super) fn join(quic: quinn::Connection, raw: &Raw) -> Option<Connection> {
    if quic.max_datagram_size().is_some() == raw.is_some() {
        quic.close(CLOSE_OTHER_TRANSPORT, b"the transports differ");
        return None;
    }
    let raw = raw.as_ref().map(|socket| socket.flow(&quic));
    Some(Connection { quic, raw })
}

impl Endpoint {
    /// The slave's endpoint.
    ///
    /// Call it inside of a tokio runtime with I/O and time.
    ///
    /// # Errors
    /// The identity is unusable or the socket fails.
    pub fn of_slave(
        transport: Transport,
        socket: Arc<dyn AsyncUdpSocket>,
        identity: &Identity,
        traffic: Traffic,
    ) -> Result<Self, EndpointError> {
        let (socket, raw) = share(transport, socket);
        let quic = server_endpoint(socket, identity, by_quic(&raw, traffic))?;
        Ok(Self { quic, raw })
    }

    /// The master's endpoint.
    ///
    /// Call it inside of a tokio runtime with I/O and time.
    ///
    /// # Errors
    /// The socket fails.
    pub fn of_master(
        transport: Transport,
        socket: Arc<dyn AsyncUdpSocket>,
    ) -> Result<Self, EndpointError> {
        let (socket, raw) = share(transport, socket);
        let quic = client_endpoint(socket)?;
        Ok(Self { quic, raw })
    }

    /// Connects to the slave at `address`, which must prove that it holds the key of `pin`, within `limit`.
    ///
    /// # Errors
    /// See [`ConnectError`].
    pub async fn connect(
        &self,
        address: SocketAddr,
        pin: Pin,
        traffic: Traffic,
        limit: Duration,
    ) -> Result<Connection, ConnectError> {
        let traffic = by_quic(&self.raw, traffic);
        let quic = connect(&self.quic, address, pin, traffic, limit).await?;
        join(quic, &self.raw).ok_or(ConnectError::OtherTransport { address })
    }

    /// Where it is bound.
    ///
    /// # Errors
    /// Those of the system.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.quic.local_addr()
    }

    /// Closes all connections and takes no more.
    pub fn close(&self, code: VarInt, reason: &[u8]) {
        self.quic.close(code, reason);
    }

    /// Waits until the ends of all connections have gone out.
    pub async fn wait_idle(&self) {
        self.quic.wait_idle().await;
    }
}
