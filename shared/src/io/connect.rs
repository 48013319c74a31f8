//! The master's way from an endpoint to a connection with the slave of its pairing string.
//!
//! The handshake proves the slave to the master; the master's token comes later, in the hello. So
//! [`connect`] succeeds before the slave has judged its master: only a welcome opens a session.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use quinn::{Connection, ConnectionError, Endpoint, TransportErrorCode};
use tokio::time::timeout;

use super::quic::{Traffic, client_config};
use super::tls::{PinVerifier, TlsError};
use crate::pairing::Pin;
use crate::wire::ALPN;

/// Name given to the TLS library, which requires one; it is not sent.
const SERVER_NAME: &str = "mmt";
/// TLS alert `no_application_protocol` (RFC 7301, section 3.2).
const ALERT_NO_PROTOCOL: u8 = 120;

/// The first packets of a QUIC connection are as long as this and must not be split, bytes of UDP payload (RFC 9000,
/// section 14): a smaller path lets none of them through.
const MTU_MIN: usize = 1200;

/// IP and UDP headers of a packet to an address, bytes.
fn header_bytes(address: &SocketAddr) -> usize {
    if address.is_ipv4() { 28 } else { 48 }
}

/// What there is to say of an address that means this host itself wherever it is used.
fn own_host(address: &SocketAddr) -> String {
    if !address.ip().is_loopback() {
        return String::new();
    }
    let port = address.port();
    format!(
        " This address is this host itself: on two hosts start the slave with --listen 0.0.0.0:{port}"
    )
}

/// Why a master got no connection.
#[derive(Debug, thiserror::Error)]
pub enum ConnectError {
    /// Nothing there.
    #[error(
        "nothing answered at {address} for {limit:?}: is the slave running there, is the port right, \
         does a firewall let UDP through, does the path carry UDP packets of {MTU_MIN} bytes (an MTU of {} \
         at the least)?{}",
        MTU_MIN + header_bytes(.address),
        own_host(.address)
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
    /// QUIC, but not ours, or of another version.
    #[error(
        "what answers at {address} uses QUIC, but not {ALPN:?}: is the port right, is the same version of mmt \
         installed on both hosts?"
    )]
    OtherProtocol {
        /// Where.
        address: SocketAddr,
    },
    /// Datagrams by QUIC on one side, as raw UDP on the other.
    #[error("the slave at {address} uses another transport: give both sides the same --transport")]
    OtherTransport {
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
        /// What QUIC reports.
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
    handshake.map_err(|source| match verifier.refused() {
        Some(offered) => ConnectError::WrongKey {
            address,
            expected: pin,
            offered,
        },
        None => connect_error(address, limit, source),
    })
}

/// The addresses of a name in the order in which they are tried, each once: IPv4 first. A slave listens on IPv4 unless it
/// is given another address, and a wrong first address costs the whole wait.
pub fn in_order(found: impl IntoIterator<Item = SocketAddr>) -> Vec<SocketAddr> {
    let mut addresses: Vec<SocketAddr> = Vec::new();
    for one in found {
        if !addresses.contains(&one) {
            addresses.push(one);
        }
    }
    addresses.sort_by_key(SocketAddr::is_ipv6);
    addresses
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

#[cfg(test)]
mod tests;
