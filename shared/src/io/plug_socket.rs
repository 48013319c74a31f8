//! The UDP socket that a plug listens on, with the token that lets a peer in.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

use crate::io::secret::NoRandomness;
use crate::plug::PlugToken;

/// Room for a packet, bytes: more than any of ours, so that a longer one is seen to be longer.
pub const PACKET_MAX: usize = 256;
/// A socket that fails is asked again after this.
const PAUSE: Duration = Duration::from_millis(10);

/// A plug cannot listen.
#[derive(Debug, thiserror::Error)]
pub enum PlugSocketError {
    /// The address cannot be had.
    #[error("the plug cannot listen on {address}: {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// Why.
        source: io::Error,
    },
    /// No token.
    #[error(transparent)]
    Token(#[from] NoRandomness),
}

/// A socket that listens, and its token.
#[derive(Debug)]
pub struct PlugSocket {
    socket: UdpSocket,
    local: SocketAddr,
    token: PlugToken,
}

impl PlugSocket {
    /// Listens with a token of its own.
    ///
    /// # Errors
    /// The address cannot be had, or there is no token.
    pub fn bind(listen: SocketAddr) -> Result<Self, PlugSocketError> {
        let token = PlugToken::generate()?;
        let unheard = |source| PlugSocketError::Listen {
            address: listen,
            source,
        };
        let socket = UdpSocket::bind(listen).map_err(unheard)?;
        let local = socket.local_addr().map_err(unheard)?;
        Ok(Self {
            socket,
            local,
            token,
        })
    }

    /// The socket.
    pub fn socket(&self) -> &UdpSocket {
        &self.socket
    }

    /// The token.
    pub fn token(&self) -> &PlugToken {
        &self.token
    }

    /// The address for whoever is to plug in. It holds the token.
    pub fn address(&self) -> String {
        format!("udp://{}?token={}", self.local, self.token.reveal())
    }

    /// The next packet, written to `room`, and where it came from; waits for one.
    pub fn receive<'a>(&self, room: &'a mut [u8; PACKET_MAX]) -> (&'a [u8], SocketAddr) {
        loop {
            // an error of a socket without a connection is about a packet of before
            match self.socket.recv_from(room) {
                Ok((length, from)) => return (room.get(..length).unwrap_or_default(), from),
                Err(_) => std::thread::sleep(PAUSE),
            }
        }
    }

    /// Sends a packet; one that cannot be sent is a lost one.
    pub fn send(&self, packet: &[u8], to: SocketAddr) {
        let _ = self.socket.send_to(packet, to);
    }
}
