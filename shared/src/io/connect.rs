//! From an endpoint to a connection whose peer is the right slave, or is a program of the same version.
//!
//! The handshake proves the slave to the master; the master's token comes later, in the hello. So a master's
//! `connect` succeeds before the slave has judged it: only a welcome opens a session.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use quinn::crypto::rustls::HandshakeData;
use quinn::{
    Connecting, Connection, ConnectionError, Endpoint, Incoming, TransportErrorCode, VarInt,
};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

use super::quic::{Traffic, client_config};
use super::secret::Pin;
use super::stream::{read_frame, write_frame};
use super::tls::{PROTOCOL, PinVerifier, TlsError};

/// Close code: the session is over.
pub const CLOSE_FINISHED: VarInt = VarInt::from_u32(0);
/// Close code: the peers speak different versions; the reason is what the closing side speaks.
pub const CLOSE_OTHER_VERSION: VarInt = VarInt::from_u32(1);

/// Handshakes at once. More are refused: a slave has one master, and a flood must not cost it its ticks.
const HANDSHAKES_MAX: usize = 8;
/// With fewer places left than this, an address must prove itself first (Retry, RFC 9000, section 8.1.2), so
/// that forged ones cannot take the rest.
const UNPROVEN_PLACES: usize = 6;
/// A handshake may take this long: three round trips of 2 s and the wait for a lost packet.
const HANDSHAKE_MAX: Duration = Duration::from_secs(10);
/// Peers that share no version have this long to tell each other theirs.
const VERSIONS_MAX: Duration = Duration::from_secs(5);
/// The longest name of a version that is believed, bytes.
const VERSION_BYTES_MAX: u32 = 64;
/// Name given to the TLS library, which wants one; it is not sent.
const SERVER_NAME: &str = "mmt";
/// TLS alert `no_application_protocol` (RFC 7301, section 3.2).
const ALERT_NO_PROTOCOL: u8 = 120;

/// Why a master got no connection.
#[derive(Debug, thiserror::Error)]
pub enum ConnectError {
    /// Nothing there.
    #[error(
        "nothing answered at {address} for {limit:?}: is the slave running there, is the port right, \
         does a firewall let UDP through?"
    )]
    NoAnswer {
        /// Where.
        address: SocketAddr,
        /// How long it was waited for.
        limit: Duration,
    },
    /// Somebody else, or the slave with a new identity.
    #[error(
        "the slave at {address} has the key {offered}, but the pairing string pins {expected}: it is \
         another slave or it made itself a new identity; take the pairing string that it prints"
    )]
    WrongKey {
        /// Where.
        address: SocketAddr,
        /// The pin of the pairing string.
        expected: Pin,
        /// The pin of the key that was offered.
        offered: Pin,
    },
    /// Another version of this program.
    #[error(
        "the slave at {address} speaks {theirs:?}, this program speaks {PROTOCOL:?}: install the same \
         version on both hosts"
    )]
    OtherVersion {
        /// Where.
        address: SocketAddr,
        /// What the slave speaks.
        theirs: String,
    },
    /// QUIC, but not ours.
    #[error("what answers at {address} speaks QUIC, but not {PROTOCOL:?}: is the port right?")]
    OtherProtocol {
        /// Where.
        address: SocketAddr,
    },
    /// Too many handshakes at the slave.
    #[error("the slave at {address} has too many handshakes under way: try again in some seconds")]
    Crowded {
        /// Where.
        address: SocketAddr,
    },
    /// The endpoint cannot connect at all.
    #[error("cannot connect to {address}: {source}")]
    Impossible {
        /// Where.
        address: SocketAddr,
        /// Why.
        source: quinn::ConnectError,
    },
    /// TLS could not be set up.
    #[error(transparent)]
    Tls(#[from] TlsError),
    /// The handshake failed otherwise.
    #[error("the handshake with {address} failed: {source}")]
    Failed {
        /// Where.
        address: SocketAddr,
        /// What QUIC said.
        source: ConnectionError,
    },
}

/// Why a slave got no connection of somebody who knocked.
#[derive(Debug, thiserror::Error)]
pub enum AcceptError {
    /// Another version of this program.
    #[error("the master at {address} speaks {theirs:?}, this program speaks {PROTOCOL:?}")]
    OtherVersion {
        /// Where.
        address: SocketAddr,
        /// What the master speaks.
        theirs: String,
    },
    /// It began a handshake and went silent.
    #[error("the handshake with {address} was not over after {HANDSHAKE_MAX:?}")]
    Slow {
        /// Where.
        address: SocketAddr,
    },
    /// The handshake failed otherwise.
    #[error("the handshake with {address} failed: {source}")]
    Failed {
        /// Where.
        address: SocketAddr,
        /// What QUIC said.
        source: ConnectionError,
    },
}

/// Connects to the slave at `address` that holds the key of `pin`, within `limit`.
///
/// # Errors
/// See [`ConnectError`].
pub async fn connect(
    endpoint: &Endpoint,
    address: SocketAddr,
    pin: Pin,
    traffic: Traffic,
    limit: Duration,
) -> Result<Connection, ConnectError> {
    let verifier = Arc::new(PinVerifier::new(pin));
    let config = client_config(Arc::clone(&verifier), traffic)?;
    let connecting = endpoint
        .connect_with(config, address, SERVER_NAME)
        .map_err(|source| ConnectError::Impossible { address, source })?;
    let Ok(handshake) = timeout(limit, connecting).await else {
        return Err(ConnectError::NoAnswer { address, limit });
    };
    let connection = handshake.map_err(|source| match verifier.refused() {
        Some(offered) => ConnectError::WrongKey {
            address,
            expected: pin,
            offered,
        },
        None => connect_error(address, limit, source),
    })?;
    if shares_version(&connection) {
        return Ok(connection);
    }
    let theirs = version_of_slave(&connection, PROTOCOL).await;
    Err(ConnectError::OtherVersion { address, theirs })
}

fn connect_error(address: SocketAddr, limit: Duration, source: ConnectionError) -> ConnectError {
    let code = match &source {
        ConnectionError::TimedOut => return ConnectError::NoAnswer { address, limit },
        ConnectionError::ConnectionClosed(close) => close.error_code,
        _ => return ConnectError::Failed { address, source },
    };
    if code == TransportErrorCode::crypto(ALERT_NO_PROTOCOL) {
        ConnectError::OtherProtocol { address }
    } else if code == TransportErrorCode::CONNECTION_REFUSED {
        ConnectError::Crowded { address }
    } else {
        ConnectError::Failed { address, source }
    }
}

/// Masters that knock at a slave's endpoint.
#[derive(Debug)]
pub struct Listener {
    endpoint: Endpoint,
    places: Arc<Semaphore>,
    refused: AtomicU64,
    asked_to_prove: AtomicU64,
    unreadable: AtomicU64,
}

/// First packets that led to no handshake, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TurnedAway {
    /// All places were taken.
    pub refused: u64,
    /// The address had to prove itself; an honest one came back, and was counted as a handshake then.
    pub asked_to_prove: u64,
    /// Not a handshake that could be answered: garbage, or a protocol that is not ours.
    pub unreadable: u64,
}

/// A handshake that was let in. Finish it in a task of its own, so that a slow one holds up nobody.
#[derive(Debug)]
pub struct Handshake {
    connecting: Connecting,
    address: SocketAddr,
    _place: OwnedSemaphorePermit,
}

#[derive(Debug, PartialEq, Eq)]
enum Admission {
    Enter,
    ProveAddress,
    Refuse,
}

fn admission(places_left: usize, address_proven: bool) -> Admission {
    if places_left == 0 {
        Admission::Refuse
    } else if address_proven || places_left > HANDSHAKES_MAX - UNPROVEN_PLACES {
        Admission::Enter
    } else {
        Admission::ProveAddress
    }
}

impl Listener {
    /// A listener on an endpoint that accepts.
    #[must_use]
    pub fn new(endpoint: Endpoint) -> Self {
        Self {
            endpoint,
            places: Arc::new(Semaphore::new(HANDSHAKES_MAX)),
            refused: AtomicU64::new(0),
            asked_to_prove: AtomicU64::new(0),
            unreadable: AtomicU64::new(0),
        }
    }

    /// What was turned away so far.
    #[must_use]
    pub fn turned_away(&self) -> TurnedAway {
        TurnedAway {
            refused: self.refused.load(Ordering::Relaxed),
            asked_to_prove: self.asked_to_prove.load(Ordering::Relaxed),
            unreadable: self.unreadable.load(Ordering::Relaxed),
        }
    }

    /// The next handshake that is let in; `None` once the endpoint is closed. Cancel-safe.
    pub async fn next(&self) -> Option<Handshake> {
        loop {
            let incoming = self.endpoint.accept().await?;
            if let Some(handshake) = self.admit(incoming) {
                return Some(handshake);
            }
        }
    }

    fn admit(&self, incoming: Incoming) -> Option<Handshake> {
        let proven = incoming.remote_address_validated();
        match admission(self.places.available_permits(), proven) {
            Admission::Refuse => {
                self.refused.fetch_add(1, Ordering::Relaxed);
                incoming.refuse();
                None
            }
            Admission::ProveAddress => {
                self.asked_to_prove.fetch_add(1, Ordering::Relaxed);
                // An unproven address may always be asked to prove itself.
                let _ = incoming.retry();
                None
            }
            Admission::Enter => self.enter(incoming),
        }
    }

    fn enter(&self, incoming: Incoming) -> Option<Handshake> {
        let place = Arc::clone(&self.places).try_acquire_owned().ok()?;
        let address = incoming.remote_address();
        // quinn has answered an unreadable one with the reason.
        let Ok(connecting) = incoming.accept() else {
            self.unreadable.fetch_add(1, Ordering::Relaxed);
            return None;
        };
        Some(Handshake {
            connecting,
            address,
            _place: place,
        })
    }
}

impl Handshake {
    /// Who knocks.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The connection, once the handshake is over and the versions agree. Its master is not trusted yet.
    ///
    /// # Errors
    /// See [`AcceptError`].
    pub async fn finish(self) -> Result<Connection, AcceptError> {
        let address = self.address;
        let connection = timeout(HANDSHAKE_MAX, self.connecting)
            .await
            .map_err(|_| AcceptError::Slow { address })?
            .map_err(|source| AcceptError::Failed { address, source })?;
        if shares_version(&connection) {
            return Ok(connection);
        }
        let theirs = version_of_master(&connection).await;
        connection.close(CLOSE_OTHER_VERSION, PROTOCOL.as_bytes());
        Err(AcceptError::OtherVersion { address, theirs })
    }
}

/// Whether the handshake agreed on [`PROTOCOL`]; else it was [`tls::VERSION_PROTOCOL`](super::tls::VERSION_PROTOCOL).
fn shares_version(connection: &Connection) -> bool {
    let data = connection.handshake_data();
    let data = data.and_then(|data| data.downcast::<HandshakeData>().ok());
    data.and_then(|data| data.protocol)
        .is_some_and(|protocol| protocol == PROTOCOL.as_bytes())
}

/// The master's half of `mmt/version`: says `ours` in a frame on the stream, and learns the slave's
/// from the reason with which that closes.
async fn version_of_slave(connection: &Connection, ours: &str) -> String {
    let told = async {
        if let Ok((mut send, _)) = connection.open_bi().await {
            let _ = write_frame(&mut send, ours.as_bytes(), VERSIONS_MAX).await;
        }
        connection.closed().await
    };
    match timeout(VERSIONS_MAX, told).await {
        Ok(ConnectionError::ApplicationClosed(close)) => readable(&close.reason),
        _ => readable(b""),
    }
}

/// The slave's half: learns the master's from its frame; closing says the slave's own.
async fn version_of_master(connection: &Connection) -> String {
    let told = async {
        let (_, mut receive) = connection.accept_bi().await.ok()?;
        let frame = read_frame(&mut receive, VERSION_BYTES_MAX, VERSIONS_MAX).await;
        frame.ok()
    };
    let told = timeout(VERSIONS_MAX, told).await;
    readable(&told.ok().flatten().unwrap_or_default())
}

fn readable(name: &[u8]) -> String {
    let name = name.get(..VERSION_BYTES_MAX as usize).unwrap_or(name);
    if name.is_empty() {
        "an unknown version".to_owned()
    } else {
        String::from_utf8_lossy(name).into_owned()
    }
}

#[cfg(test)]
#[path = "connect_tests.rs"]
mod tests;
