//! Raw UDP as a transport, for measurement: the same messages without encryption, proof of anybody, or
//! congestion control.
//!
//! What a datagram costs here is what QUIC is compared with. Whoever can send a packet can operate the slave and
//! whoever sees one reads the token: it must never leave loopback unless a person insists ([`permit`]).

mod connection;
mod driver;
mod endpoint;
mod hub;
mod letters;
pub mod packet;
#[cfg(test)]
mod tests;

use std::net::SocketAddr;

pub use connection::Connection;
pub use endpoint::{Endpoint, OpenError};

/// An address that raw UDP must not be used with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "raw UDP has neither encryption nor authentication, and {address} is not a loopback address: whoever reaches \
     it can read the token and operate the slave; use QUIC, or a loopback address, or insist with --insecure"
)]
pub struct Insecure {
    /// The address.
    pub address: SocketAddr,
}

/// Whether raw UDP may be used with `address`: on loopback always, elsewhere if somebody insists.
///
/// # Errors
/// It may not.
pub fn permit(address: SocketAddr, insist: bool) -> Result<(), Insecure> {
    match insist || address.ip().to_canonical().is_loopback() {
        true => Ok(()),
        false => Err(Insecure { address }),
    }
}
