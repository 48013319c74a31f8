//! Why a session ends, and the master's farewell.

use std::time::Duration;

use mmt_shared::channel::peer::NumbersSpent;
use mmt_shared::io::stream::ReadFrameError;
use mmt_shared::io::transport::{ConnectionError, RecvStream};
use mmt_shared::wire::{
    DecodeError, Farewell, MasterTotals, STREAM_MESSAGE_MAX, Side, StreamMessage,
    decode_stream_message,
};

/// A master that has not been heard for this long has lost its lease (reliability.md, section 1).
pub(super) const SILENCE_MAX: Duration = Duration::from_secs(10);
/// Why a session ended.
#[derive(Debug, thiserror::Error)]
pub(in crate::io) enum End {
    #[error("this side was asked to end")]
    Asked,
    #[error("the master said farewell ({:?})", .0.ending)]
    Farewell(Box<Farewell<MasterTotals>>),
    #[error("the master was not heard for {SILENCE_MAX:?}")]
    Silence,
    #[error("the connection was lost: {0}")]
    Disconnected(#[from] ConnectionError),
    #[error("the stream ended: {0}")]
    Stream(#[from] StreamError),
    #[error(transparent)]
    Numbers(#[from] NumbersSpent),
    #[error("the 1 kHz thread panicked")]
    Panicked,
}

/// Why no farewell could be read.
#[derive(Debug, thiserror::Error)]
pub(in crate::io) enum StreamError {
    #[error(transparent)]
    Frame(#[from] ReadFrameError),
    #[error(transparent)]
    Message(#[from] DecodeError),
    #[error("a message that is no farewell")]
    NoFarewell,
}

/// Waits for the master's farewell, for as long as it takes.
pub(super) async fn farewell_of(
    mut receive: RecvStream,
) -> Result<Farewell<MasterTotals>, StreamError> {
    let frame = receive
        .read_frame(STREAM_MESSAGE_MAX, Duration::MAX)
        .await?;
    match decode_stream_message(&frame, Side::Master)? {
        StreamMessage::MasterFarewell(farewell) => Ok(farewell),
        _ => Err(StreamError::NoFarewell),
    }
}
