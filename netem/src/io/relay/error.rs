//! Why there is no relay, or no more.

use std::io;
use std::net::SocketAddr;

use crate::config::ConfigError;

/// A relay could not be started, or broke.
#[derive(Debug, thiserror::Error)]
pub enum RelayError {
    /// The settings of a link are out of range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The target is no address to send to.
    #[error("relay target {to}: give the address and the port of a host")]
    Target {
        /// The target given.
        to: SocketAddr,
    },
    /// The relay would send to itself.
    #[error("relay target {to} is the relay's own address: its packets would go round for ever")]
    Loop {
        /// The target given.
        to: SocketAddr,
    },
    /// The address to listen on cannot be had.
    #[error("relay cannot listen on {listen}: {source}")]
    Listen {
        /// The address given.
        listen: SocketAddr,
        /// The system's answer.
        source: io::Error,
    },
    /// The system gave no event descriptor or no thread.
    #[error("no thread for the relay: {0}")]
    Thread(io::Error),
    /// The relay's thread ended by itself.
    #[error("the relay broke off: {0}")]
    Broken(io::Error),
}
