//! A connection: datagrams by QUIC or as raw UDP, one stream of framed messages in each direction by QUIC.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use bytes::Bytes;
use quinn::{ConnectionError, RecvStream, SendDatagramError, SendStream, VarInt};

use crate::io::raw_udp::Flow;

/// Close code: the session is over, or none came about.
pub const CLOSE_FINISHED: VarInt = VarInt::from_u32(0);
/// Close code: no hello came.
pub const CLOSE_NO_HELLO: VarInt = VarInt::from_u32(2);
/// Close code: what came first is no hello; the reason names the fault.
pub const CLOSE_NOT_A_HELLO: VarInt = VarInt::from_u32(3);
/// Close code: another operator has taken over.
pub const CLOSE_TAKEN_OVER: VarInt = VarInt::from_u32(4);
/// Close code: the token of an observer was replaced or revoked.
pub const CLOSE_REVOKED: VarInt = VarInt::from_u32(5);
/// Close code: one side sends its datagrams by QUIC, the other as raw UDP.
pub(super) const CLOSE_OTHER_TRANSPORT: VarInt = VarInt::from_u32(1);

/// A connection; clones are the same one.
#[derive(Clone, Debug)]
pub struct Connection {
    pub(in crate::io) quic: quinn::Connection,
    /// Its datagrams, if they are raw UDP.
    pub(super) raw: Option<Arc<Flow>>,
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
    pub fn remote_address(&self) -> SocketAddr {
        self.quic.remote_address()
    }

    /// The round trip as QUIC measures it; 100 ms before the first.
    pub fn round_trip(&self) -> Duration {
        self.quic.rtt()
    }

    /// Whether the slave closed it because another operator has taken over.
    pub fn is_taken_over(&self) -> bool {
        self.was_closed_with(CLOSE_TAKEN_OVER)
    }

    /// Whether the slave closed it because the observer's token was replaced or revoked.
    pub fn is_revoked(&self) -> bool {
        self.was_closed_with(CLOSE_REVOKED)
    }

    fn was_closed_with(&self, code: VarInt) -> bool {
        matches!(
            self.quic.close_reason(),
            Some(ConnectionError::ApplicationClosed(close)) if close.error_code == code
        )
    }

    /// Sends a datagram; does not wait. If there is no room an older one or this one is lost.
    ///
    /// # Errors
    /// It is too long or the connection is over.
    pub fn send_datagram(&self, message: Bytes) -> Result<(), SendDatagramError> {
        match &self.raw {
            Some(raw) => raw.send(&self.quic, &message),
            None => self.quic.send_datagram(message),
        }
    }

    /// The next datagram. Cancel-safe.
    ///
    /// # Errors
    /// The connection is over.
    pub async fn read_datagram(&self) -> Result<Bytes, ConnectionError> {
        match &self.raw {
            Some(raw) => raw.read(&self.quic).await,
            None => self.quic.read_datagram().await,
        }
    }

    /// Opens the one stream: the master does.
    ///
    /// # Errors
    /// The connection is over.
    pub async fn open_bi(&self) -> Result<(SendStream, RecvStream), ConnectionError> {
        self.quic.open_bi().await
    }

    /// The one stream, once the master has opened it.
    ///
    /// # Errors
    /// The connection is over.
    pub async fn accept_bi(&self) -> Result<(SendStream, RecvStream), ConnectionError> {
        self.quic.accept_bi().await
    }

    /// Ends it, with a reason for the other side.
    pub fn close(&self, code: VarInt, reason: &[u8]) {
        self.quic.close(code, reason);
    }

    /// Waits for its end, and returns why.
    pub async fn closed(&self) -> ConnectionError {
        self.quic.closed().await
    }

    /// What passed so far.
    pub fn datagrams(&self) -> DatagramCounts {
        let (sent, received) = match &self.raw {
            Some(raw) => (
                raw.sent.load(Ordering::Relaxed),
                raw.received.load(Ordering::Relaxed),
            ),
            None => {
                let frames = self.quic.stats();
                (frames.frame_tx.datagram, frames.frame_rx.datagram)
            }
        };
        DatagramCounts { sent, received }
    }
}
