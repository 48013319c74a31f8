//! Endpoints of either transport: the master's way to a connection, and the slave's to those of masters.
//!
//! On raw UDP nobody has proven anything when the connection is there; on QUIC the slave has. Who may operate is
//! judged by the hello in both cases.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use quinn::{AsyncUdpSocket, TokioRuntime, VarInt};

use super::{Connection, Transport, byte};
use crate::io::connect::{ConnectError, connect};
use crate::io::identity::Identity;
use crate::io::listen::{self, AcceptError, TurnedAway};
use crate::io::quic::{EndpointError, Traffic, client_endpoint, server_endpoint};
use crate::io::raw_udp::{self, OpenError};
use crate::pairing::Pin;

/// An endpoint; clones are the same one.
#[derive(Clone, Debug)]
pub enum Endpoint {
    /// Of QUIC.
    Quic(quinn::Endpoint),
    /// Of raw UDP.
    RawUdp(Arc<raw_udp::Endpoint>),
}

impl Endpoint {
    /// The slave's endpoint; raw UDP has no use for `identity` and `traffic`.
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
        match transport {
            Transport::Quic => server_endpoint(socket, identity, traffic).map(Self::Quic),
            Transport::RawUdp { .. } => Ok(Self::raw_udp(socket, true)),
        }
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
        match transport {
            Transport::Quic => client_endpoint(socket).map(Self::Quic),
            Transport::RawUdp { .. } => Ok(Self::raw_udp(socket, false)),
        }
    }

    fn raw_udp(socket: Arc<dyn AsyncUdpSocket>, accepts: bool) -> Self {
        let runtime = Arc::new(TokioRuntime);
        Self::RawUdp(Arc::new(raw_udp::Endpoint::new(socket, runtime, accepts)))
    }

    /// Connects to the slave at `address`, within `limit`. QUIC has it prove that it holds the key of `pin`; on raw
    /// UDP it is whoever answers.
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
        match self {
            Self::Quic(endpoint) => connect(endpoint, address, pin, traffic, limit)
                .await
                .map(Connection::Quic),
            Self::RawUdp(endpoint) => {
                let opened = endpoint.connect(address, limit).await;
                opened
                    .map(Connection::RawUdp)
                    .map_err(|error| connect_error(address, error))
            }
        }
    }

    /// Where it is bound.
    ///
    /// # Errors
    /// What the system says.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        match self {
            Self::Quic(endpoint) => endpoint.local_addr(),
            Self::RawUdp(endpoint) => endpoint.local_addr(),
        }
    }

    /// Closes all connections and takes no more.
    pub fn close(&self, code: VarInt, reason: &[u8]) {
        match self {
            Self::Quic(endpoint) => endpoint.close(code, reason),
            Self::RawUdp(endpoint) => endpoint.close(byte(code), reason),
        }
    }

    /// Waits until the ends of all connections have gone out.
    pub async fn wait_idle(&self) {
        match self {
            Self::Quic(endpoint) => endpoint.wait_idle().await,
            // said once, and not waited for
            Self::RawUdp(_) => {}
        }
    }
}

fn connect_error(address: SocketAddr, error: OpenError) -> ConnectError {
    match error {
        OpenError::NoAnswer { limit } => ConnectError::NoAnswer { address, limit },
        OpenError::OtherVersion { theirs } => ConnectError::OtherVersion { address, theirs },
        OpenError::Randomness => ConnectError::Randomness,
        OpenError::Lost(source) => ConnectError::Failed { address, source },
    }
}

/// Masters that knock at a slave's endpoint.
#[derive(Debug)]
pub enum Listener {
    /// Of QUIC.
    Quic(listen::Listener),
    /// Of raw UDP.
    RawUdp(Arc<raw_udp::Endpoint>),
}

/// A master that knocks. Let it finish in a task of its own, so that a slow one holds up nobody.
#[derive(Debug)]
pub enum Handshake {
    /// Of QUIC, under way.
    Quic(listen::Handshake),
    /// Of raw UDP: it is over.
    RawUdp(raw_udp::Connection),
}

impl Listener {
    /// A listener on an endpoint that accepts.
    #[must_use]
    pub fn new(endpoint: Endpoint) -> Self {
        match endpoint {
            Endpoint::Quic(endpoint) => Self::Quic(listen::Listener::new(endpoint)),
            Endpoint::RawUdp(endpoint) => Self::RawUdp(endpoint),
        }
    }

    /// What was turned away so far; raw UDP turns nobody away.
    #[must_use]
    pub fn turned_away(&self) -> TurnedAway {
        match self {
            Self::Quic(listener) => listener.turned_away(),
            Self::RawUdp(_) => TurnedAway::default(),
        }
    }

    /// The next handshake that is let in; `None` once the endpoint is closed. Cancel-safe.
    pub async fn next(&self) -> Option<Handshake> {
        match self {
            Self::Quic(listener) => listener.next().await.map(Handshake::Quic),
            Self::RawUdp(endpoint) => endpoint.accept().await.map(Handshake::RawUdp),
        }
    }
}

impl Handshake {
    /// Who knocks.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        match self {
            Self::Quic(handshake) => handshake.address(),
            Self::RawUdp(connection) => connection.remote_address(),
        }
    }

    /// The connection, once the handshake is over and the versions agree. Its master is not trusted yet.
    ///
    /// # Errors
    /// See [`AcceptError`].
    pub async fn finish(self) -> Result<Connection, AcceptError> {
        match self {
            Self::Quic(handshake) => handshake.finish().await.map(Connection::Quic),
            Self::RawUdp(connection) => Ok(Connection::RawUdp(connection)),
        }
    }
}
