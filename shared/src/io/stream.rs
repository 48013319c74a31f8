//! Framed messages on a QUIC stream: a length, 4 bytes little endian, then that many bytes.
//!
//! For the few messages that must arrive: hello, welcome, refusal, farewell. Every read has a bound and
//! every wait a limit. What the bytes mean is the wire module's business.

use std::time::Duration;

use quinn::{ReadExactError, RecvStream, SendStream, WriteError};
use tokio::time::timeout;

use crate::wire::{EncodeError, STREAM_MESSAGE_MAX, StreamMessage};

/// Why a message was not written.
#[derive(Debug, thiserror::Error)]
pub enum WriteFrameError {
    /// More than a length field holds.
    #[error("a message of {bytes} bytes does not fit a frame")]
    TooLong {
        /// Length of the message.
        bytes: usize,
    },
    /// The message breaks a rule of the wire.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The peer took nothing for too long.
    #[error("the peer took no message for {limit:?}: it hangs or the link is down")]
    Slow {
        /// How long it was waited for.
        limit: Duration,
    },
    /// The stream or the connection ended.
    #[error("the message could not be written: {0}")]
    Stream(#[from] WriteError),
}

/// Why no message was read.
#[derive(Debug, thiserror::Error)]
pub enum ReadFrameError {
    /// The peer ended the stream between two messages.
    #[error("the peer ended the stream")]
    Finished,
    /// The peer ended the stream within a message.
    #[error("the peer ended the stream in the middle of a message")]
    Truncated,
    /// The peer announced more than it may send.
    #[error("the peer announced a message of {bytes} bytes, but {max} is the most")]
    TooLong {
        /// Length announced.
        bytes: usize,
        /// Longest allowed.
        max: usize,
    },
    /// The peer sent nothing for too long.
    #[error("the peer sent no message for {limit:?}: it hangs or the link is down")]
    Slow {
        /// How long it was waited for.
        limit: Duration,
    },
    /// The stream or the connection ended.
    #[error("the message could not be read: {0}")]
    Stream(#[from] quinn::ReadError),
}

/// Writes one message and waits, at most `limit`, until QUIC has taken it; delivery comes later.
///
/// Not cancel-safe: a dropped write leaves half a frame.
///
/// # Errors
/// See [`WriteFrameError`]; the stream is of no use afterwards.
pub async fn write_frame(
    stream: &mut SendStream,
    message: &[u8],
    limit: Duration,
) -> Result<(), WriteFrameError> {
    let bytes = message.len();
    let length = u32::try_from(bytes).map_err(|_| WriteFrameError::TooLong { bytes })?;
    let frame = [&length.to_le_bytes(), message].concat();
    let written = timeout(limit, stream.write_all(&frame)).await;
    written.map_err(|_| WriteFrameError::Slow { limit })??;
    Ok(())
}

/// Writes one message of the wire as [`write_frame`] does.
///
/// # Errors
/// Those of [`write_frame`]; or the message breaks a rule of the wire, and nothing of it was written.
pub async fn write_message(
    stream: &mut SendStream,
    message: &StreamMessage<'_>,
    limit: Duration,
) -> Result<(), WriteFrameError> {
    let mut out = [0; STREAM_MESSAGE_MAX];
    let length = message.encode(&mut out)?;
    write_frame(stream, out.get(..length).unwrap_or_default(), limit).await
}

/// Waits, at most `limit`, until the peer has all that was written, or takes no more of it.
pub async fn delivered(stream: &SendStream, limit: Duration) {
    // either way there is nothing more to wait for
    drop(timeout(limit, stream.stopped()).await);
}

/// Reads one message of at most `max` bytes, within `limit`.
///
/// Not cancel-safe: a dropped read loses what it has read.
///
/// # Errors
/// See [`ReadFrameError`]; after any but [`ReadFrameError::Finished`] the stream is of no use.
pub async fn read_frame(
    stream: &mut RecvStream,
    max: usize,
    limit: Duration,
) -> Result<Vec<u8>, ReadFrameError> {
    let read = timeout(limit, read_unlimited(stream, max)).await;
    read.map_err(|_| ReadFrameError::Slow { limit })?
}

async fn read_unlimited(stream: &mut RecvStream, max: usize) -> Result<Vec<u8>, ReadFrameError> {
    let mut length = [0; 4];
    match stream.read_exact(&mut length).await {
        Ok(()) => {}
        Err(ReadExactError::FinishedEarly(0)) => return Err(ReadFrameError::Finished),
        Err(error) => return Err(error.into()),
    }
    let bytes = usize::try_from(u32::from_le_bytes(length)).unwrap_or(usize::MAX);
    if bytes > max {
        return Err(ReadFrameError::TooLong { bytes, max });
    }
    // `max` bounds it, and it is the caller's.
    let mut message = vec![0; bytes];
    stream.read_exact(&mut message).await?;
    Ok(message)
}

impl From<ReadExactError> for ReadFrameError {
    fn from(error: ReadExactError) -> Self {
        match error {
            ReadExactError::FinishedEarly(_) => Self::Truncated,
            ReadExactError::ReadError(error) => Self::Stream(error),
        }
    }
}

#[cfg(test)]
mod tests;
