//! The slave's way from an endpoint to connections of masters, none of which is trusted yet.
//!
//! A flood must not cost the slave its ticks: handshakes are few at once, forged addresses cannot take all of
//! them, and what is turned away is counted.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use quinn::{Connecting, ConnectionError, Incoming};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

use super::connection::Connection;
use super::endpoint::{Endpoint, Raw, join};

/// Handshakes at once. More are refused: a slave has one master, and a flood must not cost it its ticks.
const HANDSHAKES_MAX: usize = 8;
/// With fewer places left than this, an address must prove itself first (Retry, RFC 9000, section 8.1.2), so
/// that forged ones cannot take the rest.
const UNPROVEN_PLACES: usize = 6;
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
    raw: Raw,
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
    pub fn new(endpoint: impl Into<Endpoint>) -> Self {
        Self {
            endpoint: endpoint.into(),
            places: Arc::new(Semaphore::new(HANDSHAKES_MAX)),
            refused: AtomicU64::new(0),
            asked_to_prove: AtomicU64::new(0),
            unreadable: AtomicU64::new(0),
        }
    }

    /// What was turned away so far.
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
            let incoming = self.endpoint.quic.accept().await?;
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
        match incoming.accept() {
            Ok(connecting) => Some(Handshake {
                connecting,
                address,
                raw: self.endpoint.raw.clone(),
                _place: place,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crowd_must_prove_its_addresses_before_the_last_places_are_taken() {
        assert_eq!(admission(HANDSHAKES_MAX, false), Admission::Enter);
        assert_eq!(admission(3, false), Admission::Enter);
        assert_eq!(admission(2, false), Admission::ProveAddress);
        assert_eq!(admission(2, true), Admission::Enter);
        assert_eq!(admission(0, true), Admission::Refuse);
        assert_eq!(admission(0, false), Admission::Refuse);
    }
}
