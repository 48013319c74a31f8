//! The transports by name, and where each may be used.

use std::net::SocketAddr;

/// Which transport a host uses. Both hosts of a session must use the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Transport {
    /// Encrypted, both sides proven, congestion controlled.
    #[default]
    Quic,
    /// None of that for the datagrams: for measurement.
    RawUdp {
        /// A person insists on using it beyond loopback.
        insist: bool,
    },
}

/// An address that raw UDP must not be used with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "raw UDP has neither encryption nor authentication, and {address} is not a loopback address: whoever sees its \
     packets can operate the slave; use QUIC, or a loopback address, or insist with --insecure"
)]
pub struct Insecure {
    /// The address.
    pub address: SocketAddr,
}

impl Transport {
    /// As the command line and reports spell it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quic => "quic",
            Self::RawUdp { .. } => "udp",
        }
    }

    /// Whether this transport may be used with `address`, one's own or the other side's.
    ///
    /// # Errors
    /// Raw UDP, not loopback, and nobody insists.
    pub fn permit(self, address: SocketAddr) -> Result<(), Insecure> {
        let is_loopback = address.ip().to_canonical().is_loopback();
        if self == (Self::RawUdp { insist: false }) && !is_loopback {
            return Err(Insecure { address });
        }
        Ok(())
    }
}
