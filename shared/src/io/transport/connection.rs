//! A connection: datagrams by QUIC or as raw UDP, one stream of framed messages in each direction by QUIC.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use bytes::Bytes;
use quinn::{ConnectionError, SendDatagramError, VarInt};
use tokio::time::timeout;

use crate::io::raw_udp::Flow;
use crate::io::stream::{ReadFrameError, WriteFrameError, read_frame, write_frame};

/// Close code: the session is over, or none came about.
pub const CLOSE_FINISHED: VarInt = VarInt::from_u32(0);
/// Close code: no hello came.
pub const CLOSE_NO_HELLO: VarInt = VarInt::from_u32(2);
/// Close code: what came first is no hello; the reason names the fault.
pub const CLOSE_NOT_A_HELLO: VarInt = VarInt::from_u32(3);
/// Close code: one side sends its datagrams by QUIC, the other as raw UDP.
pub(super) const CLOSE_OTHER_TRANSPORT: VarInt = VarInt::from_u32(1);

/// A connection; clones are the same one.
#[derive(Clone, Debug)]
pub struct Connection {
    pub(super) quic: quinn::Connection,
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
        let (send, receive) = self.quic.open_bi().await?;
        Ok((SendStream(send), RecvStream(receive)))
    }

    /// The one stream, once the master has opened it.
    ///
    /// # Errors
    /// The connection is over.
    pub async fn accept_bi(&self) -> Result<(SendStream, RecvStream), ConnectionError> {
        let (send, receive) = self.quic.accept_bi().await?;
        Ok((SendStream(send), RecvStream(receive)))
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

/// The stream of framed messages to the other side.
#[derive(Debug)]
pub struct SendStream(quinn::SendStream);

/// The stream of framed messages from the other side.
#[derive(Debug)]
pub struct RecvStream(quinn::RecvStream);

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
        write_frame(&mut self.0, message, limit).await
    }

    /// Ends the stream after the last message; does nothing on a stream that has ended.
    pub fn finish(&mut self) {
        // fails only on a stream that has ended
        drop(self.0.finish());
    }

    /// Waits, at most `limit`, until the other side has all of it or refuses it.
    pub async fn delivered(&self, limit: Duration) {
        // either way there is nothing more to wait for
        drop(timeout(limit, self.0.stopped()).await);
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
        read_frame(&mut self.0, max, limit).await
    }
}
