//! Why a run of quinn in virtual time came to nothing.

use mmt_netem::config::ConfigError;
use mmt_shared::io::identity::GenerateError;
use mmt_shared::io::tls::TlsError;
use mmt_shared::time::Time;
use quinn::ConnectionError;

use crate::experiment::findings::ExperimentError;

/// Why a run came to nothing.
#[derive(Debug, thiserror::Error)]
pub enum VirtualTimeError {
    /// A setting of the link.
    #[error(transparent)]
    Link(#[from] ConfigError),
    /// No identity.
    #[error(transparent)]
    Identity(#[from] GenerateError),
    /// TLS could not be set up.
    #[error(transparent)]
    Tls(#[from] TlsError),
    /// quinn would not make an endpoint.
    #[error("no endpoint: {0}")]
    Endpoint(#[from] std::io::Error),
    /// quinn would not connect.
    #[error("cannot connect: {0}")]
    Connect(#[from] quinn::ConnectError),
    /// The connection failed.
    #[error("the connection failed: {0}")]
    Connection(#[from] ConnectionError),
    /// The handshake was never over.
    #[error("the handshake was not over after {after:?} of virtual time")]
    Handshake {
        /// When it was given up.
        after: Time,
    },
    /// quinn would not take a message.
    #[error("a message could not be sent: {0}")]
    Send(#[from] quinn::SendDatagramError),
}

impl From<VirtualTimeError> for ExperimentError {
    fn from(error: VirtualTimeError) -> Self {
        let why = error.to_string();
        Self::Transport { why }
    }
}
