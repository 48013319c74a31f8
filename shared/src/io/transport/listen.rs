//! The slave's way from an endpoint to connections of masters, none of which is trusted yet.
//!
//! Every address proves itself first (Retry, RFC 9000, section 8.1.2): who forges one gets nothing, and whoever it belongs
//! to is sent fewer bytes than came in its name. How many are let in at once is the host's business.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use quinn::{Connecting, ConnectionError, Incoming};
use tokio::time::timeout;

use super::connection::Connection;
use super::endpoint::{Endpoint, Raw, join};

/// A handshake may take this long: three round trips of 2 s and the wait for a lost packet.
const HANDSHAKE_MAX: Duration = Duration::from_secs(10);

/// Why a slave got no connection of a master that began one.
#[derive(Debug, thiserror::Error)]
pub enum AcceptError {
    /// Datagrams by QUIC on one side, as raw UDP on the other.
    #[error("the master at {address} uses another transport: give both sides the same --transport")]
    OtherTransport {
        /// Where.
        address: SocketAddr,
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
        /// What QUIC reports.
        source: ConnectionError,
    },
}

/// Takes the connections of masters at a slave's endpoint.
#[derive(Debug)]
pub struct Listener {
    endpoint: Endpoint,
    unreadable: AtomicU64,
}

/// A handshake with an address that has proven itself. Finish it in a task of its own, so that a slow one holds up nobody.
#[derive(Debug)]
pub struct Handshake {
    connecting: Connecting,
    address: SocketAddr,
    raw: Raw,
}

impl Listener {
    /// A listener on an endpoint that accepts.
    pub fn new(endpoint: impl Into<Endpoint>) -> Self {
        Self {
            endpoint: endpoint.into(),
            unreadable: AtomicU64::new(0),
        }
    }

    /// First packets so far that led to no handshake: garbage, or a protocol that is not ours.
    pub fn unreadable(&self) -> u64 {
        self.unreadable.load(Ordering::Relaxed)
    }

    /// The next handshake; `None` once the endpoint is closed. Cancel-safe.
    pub async fn next(&self) -> Option<Handshake> {
        loop {
            let incoming = self.endpoint.quic.accept().await?;
            if !incoming.remote_address_validated() {
                // an unproven address may always be asked to prove itself
                let _ = incoming.retry();
            } else if let Some(handshake) = self.accept(incoming) {
                return Some(handshake);
            }
        }
    }

    fn accept(&self, incoming: Incoming) -> Option<Handshake> {
        let address = incoming.remote_address();
        match incoming.accept() {
            Ok(connecting) => Some(Handshake {
                connecting,
                address,
                raw: self.endpoint.raw.clone(),
            }),
            // quinn has answered with the reason
            Err(error) => {
                self.unreadable.fetch_add(1, Ordering::Relaxed);
                tracing::warn!("no handshake with {address}: {error}");
                None
            }
        }
    }
}

impl Handshake {
    /// Who connects.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The connection, once the handshake is over. Its master is not trusted yet.
    ///
    /// # Errors
    /// See [`AcceptError`].
    pub async fn finish(self) -> Result<Connection, AcceptError> {
        let address = self.address;
        let quic = timeout(HANDSHAKE_MAX, self.connecting)
            .await
            .map_err(|_| AcceptError::Slow { address })?
            .map_err(|source| AcceptError::Failed { address, source })?;
        join(quic, &self.raw).ok_or(AcceptError::OtherTransport { address })
    }
}
