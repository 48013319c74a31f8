//! An endpoint of raw UDP: connects, accepts, closes.
//!
//! It never reads its socket: that is the driver's.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use quinn::{AsyncUdpSocket, ConnectionError, Runtime};
use ring::rand::{SecureRandom, SystemRandom};

use super::connection::Connection;
use super::driver::drive;
use super::hub::Hub;
use super::letters::Letters;
use crate::io::stream::WriteFrameError;
use crate::io::versions::CLOSE_OTHER_VERSION;
use crate::wire::ALPN;

/// Why a master got no connection.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// Nobody there, or nobody who speaks raw UDP.
    #[error("nothing answered for {limit:?}")]
    NoAnswer {
        /// How long it was waited for.
        limit: Duration,
    },
    /// Another version of this program.
    #[error("the other side speaks {theirs:?}, this program speaks {ALPN:?}")]
    OtherVersion {
        /// What it speaks.
        theirs: String,
    },
    /// The system gave no random number.
    #[error("the system has no randomness")]
    Randomness,
    /// It broke otherwise.
    #[error(transparent)]
    Lost(#[from] ConnectionError),
}

/// An endpoint. Dropping it ends its connections.
#[derive(Debug)]
pub struct Endpoint(Arc<Hub>);

impl Endpoint {
    /// An endpoint on a socket of `runtime`; one that `accepts` is a slave's.
    #[must_use]
    pub fn new(socket: Arc<dyn AsyncUdpSocket>, runtime: Arc<dyn Runtime>, accepts: bool) -> Self {
        let hub = Arc::new(Hub::new(socket, Arc::clone(&runtime), accepts));
        runtime.spawn(Box::pin(drive(Arc::clone(&hub))));
        Self(hub)
    }

    /// Where it is bound.
    ///
    /// # Errors
    /// What the system says.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.0.socket.local_addr()
    }

    /// Connects to `address`: letter 0 and its receipt, within `limit`.
    ///
    /// # Errors
    /// See [`OpenError`].
    pub async fn connect(
        &self,
        address: SocketAddr,
        limit: Duration,
    ) -> Result<Connection, OpenError> {
        let mut number = [0; 4];
        let random = SystemRandom::new().fill(&mut number);
        random.map_err(|_| OpenError::Randomness)?;
        let number = u32::from_le_bytes(number);
        let connection = Connection::new(self.0.add(number, address, Letters::default()));
        match connection.write_letter(ALPN.as_bytes(), limit).await {
            Ok(()) => Ok(connection),
            Err(WriteFrameError::Stream(quinn::WriteError::ConnectionLost(why))) => Err(lost(why)),
            Err(_) => Err(OpenError::NoAnswer { limit }),
        }
    }

    /// The next connection that somebody has opened; none once the endpoint is closed. Cancel-safe.
    pub async fn accept(&self) -> Option<Connection> {
        self.0.accept().await
    }

    /// Closes every connection and takes no more.
    pub fn close(&self, code: u8, reason: &[u8]) {
        self.0.close(code, reason);
    }
}

impl Drop for Endpoint {
    fn drop(&mut self) {
        self.close(0, b"");
    }
}

fn lost(why: ConnectionError) -> OpenError {
    match why {
        ConnectionError::ApplicationClosed(close) if close.error_code == CLOSE_OTHER_VERSION => {
            OpenError::OtherVersion {
                theirs: String::from_utf8_lossy(&close.reason).into_owned(),
            }
        }
        other => OpenError::Lost(other),
    }
}
