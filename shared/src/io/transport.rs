//! What carries a session: QUIC, or raw UDP for measurement, behind one narrow interface.
//!
//! Datagrams that may be lost, one stream of framed messages in each direction, an end with a reason. Errors are in
//! QUIC's words whichever it is. A session must not ask which one carries it.

mod endpoint;
#[cfg(test)]
mod tests;

use std::fmt;
use std::net::SocketAddr;
use std::time::Duration;

use bytes::Bytes;
use tokio::time::timeout;

use super::raw_udp;
use super::stream::{ReadFrameError, WriteFrameError, read_frame, write_frame};

pub use endpoint::{Endpoint, Handshake, Listener};
pub use quinn::{ConnectionError, ReadError, SendDatagramError, VarInt, WriteError};

/// Which transport a host uses. Both hosts of a session must use the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Transport {
    /// Encrypted, both sides proven, congestion controlled.
    #[default]
    Quic,
    /// None of that: for measurement.
    RawUdp {
        /// Somebody insists on using it beyond loopback.
        insist: bool,
    },
}

impl Transport {
    /// As the command line and reports spell it.
    #[must_use]
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
    pub fn permit(self, address: SocketAddr) -> Result<(), raw_udp::Insecure> {
        match self {
            Self::Quic => Ok(()),
            Self::RawUdp { insist } => raw_udp::permit(address, insist),
        }
    }
}

impl fmt::Display for Transport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A connection; clones are the same one.
#[derive(Clone, Debug)]
pub enum Connection {
    /// Of QUIC.
    Quic(quinn::Connection),
    /// Of raw UDP.
    RawUdp(raw_udp::Connection),
}

/// Datagrams that passed the transport itself: not what the application offered it or took from it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DatagramCounts {
    /// Sent.
    pub sent: u64,
    /// Received.
    pub received: u64,
}

impl Connection {
    /// Who is at the other end.
    #[must_use]
    pub fn remote_address(&self) -> SocketAddr {
        match self {
            Self::Quic(connection) => connection.remote_address(),
            Self::RawUdp(connection) => connection.remote_address(),
        }
    }

    /// Sends a datagram; does not wait. If there is no room an older one or this one is lost.
    ///
    /// # Errors
    /// It is too long or the connection is over.
    pub fn send_datagram(&self, message: Bytes) -> Result<(), SendDatagramError> {
        match self {
            Self::Quic(connection) => connection.send_datagram(message),
            Self::RawUdp(connection) => connection.send_datagram(&message),
        }
    }

    /// The next datagram. Cancel-safe.
    ///
    /// # Errors
    /// The connection is over.
    pub async fn read_datagram(&self) -> Result<Bytes, ConnectionError> {
        match self {
            Self::Quic(connection) => connection.read_datagram().await,
            Self::RawUdp(connection) => connection.read_datagram().await,
        }
    }

    /// Opens the one stream: the master does.
    ///
    /// # Errors
    /// The connection is over.
    pub async fn open_bi(&self) -> Result<(SendStream, RecvStream), ConnectionError> {
        match self {
            Self::Quic(connection) => {
                let (send, receive) = connection.open_bi().await?;
                Ok((SendStream::Quic(send), RecvStream::Quic(receive)))
            }
            Self::RawUdp(connection) => Ok(letters(connection)),
        }
    }

    /// The one stream, once the master has opened it.
    ///
    /// # Errors
    /// The connection is over.
    pub async fn accept_bi(&self) -> Result<(SendStream, RecvStream), ConnectionError> {
        match self {
            Self::Quic(connection) => {
                let (send, receive) = connection.accept_bi().await?;
                Ok((SendStream::Quic(send), RecvStream::Quic(receive)))
            }
            Self::RawUdp(connection) => Ok(letters(connection)),
        }
    }

    /// Ends it, with a reason for the other side.
    pub fn close(&self, code: VarInt, reason: &[u8]) {
        match self {
            Self::Quic(connection) => connection.close(code, reason),
            Self::RawUdp(connection) => connection.close(byte(code), reason),
        }
    }

    /// Waits for its end, and tells why.
    pub async fn closed(&self) -> ConnectionError {
        match self {
            Self::Quic(connection) => connection.closed().await,
            Self::RawUdp(connection) => connection.closed().await,
        }
    }

    /// What passed so far.
    #[must_use]
    pub fn datagrams(&self) -> DatagramCounts {
        let (sent, received) = match self {
            Self::Quic(connection) => {
                let frames = connection.stats();
                (frames.frame_tx.datagram, frames.frame_rx.datagram)
            }
            Self::RawUdp(connection) => connection.datagrams(),
        };
        DatagramCounts { sent, received }
    }
}

/// The stream of framed messages to the other side.
#[derive(Debug)]
pub enum SendStream {
    /// Of QUIC.
    Quic(quinn::SendStream),
    /// Letters of raw UDP.
    RawUdp(raw_udp::Connection),
}

/// The stream of framed messages from the other side.
#[derive(Debug)]
pub enum RecvStream {
    /// Of QUIC.
    Quic(quinn::RecvStream),
    /// Letters of raw UDP.
    RawUdp(raw_udp::Connection),
}

impl SendStream {
    /// Writes one message, within `limit`. Not cancel-safe.
    ///
    /// # Errors
    /// See [`WriteFrameError`]; the stream is of no use afterwards.
    pub async fn write_frame(
        &mut self,
        message: &[u8],
        limit: Duration,
    ) -> Result<(), WriteFrameError> {
        match self {
            Self::Quic(stream) => write_frame(stream, message, limit).await,
            Self::RawUdp(connection) => connection.write_letter(message, limit).await,
        }
    }

    /// Says that no more messages come; does nothing on a stream that has ended.
    pub fn finish(&mut self) {
        match self {
            // fails only on a stream that has ended
            Self::Quic(stream) => drop(stream.finish()),
            // each letter is an end of its own
            Self::RawUdp(_) => {}
        }
    }

    /// Waits, at most `limit`, until the other side has all of it or refuses it.
    pub async fn delivered(&self, limit: Duration) {
        match self {
            // either way there is nothing more to wait for
            Self::Quic(stream) => drop(timeout(limit, stream.stopped()).await),
            // written is delivered
            Self::RawUdp(_) => {}
        }
    }
}

impl RecvStream {
    /// Reads one message of at most `max` bytes, within `limit`. Not cancel-safe.
    ///
    /// # Errors
    /// See [`ReadFrameError`]; after any but [`ReadFrameError::Finished`] the stream is of no use.
    pub async fn read_frame(
        &mut self,
        max: usize,
        limit: Duration,
    ) -> Result<Vec<u8>, ReadFrameError> {
        match self {
            Self::Quic(stream) => read_frame(stream, max, limit).await,
            Self::RawUdp(connection) => connection.read_letter(max, limit).await,
        }
    }
}

fn letters(connection: &raw_udp::Connection) -> (SendStream, RecvStream) {
    let (send, receive) = (connection.clone(), connection.clone());
    (SendStream::RawUdp(send), RecvStream::RawUdp(receive))
}

/// Our codes are small numbers.
fn byte(code: VarInt) -> u8 {
    u8::try_from(code.into_inner()).unwrap_or(u8::MAX)
}
