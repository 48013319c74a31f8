//! The end of a session: farewells on the stream, then the connection.

use std::time::Duration;

use mmt_shared::io::stream::{ReadFrameError, read_frame, write_frame};
use mmt_shared::wire::{
    DecodeError, Farewell, Kind, MasterTotals, STREAM_MESSAGE_MAX, Side, SlaveTotals,
    StreamMessage, decode_stream_message, encode_master_farewell,
};
use quinn::{ReadError, RecvStream, SendStream};
use tokio::time::timeout;

/// Why there is no farewell of the slave.
#[derive(Debug, thiserror::Error)]
pub(super) enum FarewellError {
    /// The stream gave none.
    #[error(transparent)]
    Read(#[from] ReadFrameError),
    /// What came cannot be read.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// What came is something else.
    #[error("a {} came where only a farewell may come", kind.name())]
    Unexpected {
        /// What came.
        kind: Kind,
    },
}

impl FarewellError {
    /// Whether the connection went and the slave is not to blame.
    pub(super) fn is_loss(&self) -> bool {
        matches!(
            self,
            Self::Read(ReadFrameError::Stream(ReadError::ConnectionLost(_)))
        )
    }
}

/// Waits for the slave's farewell, for as long as the session runs. Not cancel-safe.
pub(super) async fn read_farewell(
    receive: &mut RecvStream,
) -> Result<Farewell<SlaveTotals>, FarewellError> {
    let message = read_frame(receive, STREAM_MESSAGE_MAX, Duration::MAX).await?;
    match decode_stream_message(&message, Side::Slave)? {
        StreamMessage::SlaveFarewell(farewell) => Ok(farewell),
        other => Err(FarewellError::Unexpected { kind: other.kind() }),
    }
}

/// Sends the master's farewell; what goes wrong here changes nothing any more, so it is only logged.
pub(super) async fn send_farewell(
    send: &mut SendStream,
    farewell: &Farewell<MasterTotals>,
    limit: Duration,
) {
    let mut message = [0; STREAM_MESSAGE_MAX];
    let length = match encode_master_farewell(farewell, &mut message) {
        Ok(length) => length,
        Err(error) => {
            tracing::error!(%error, "the farewell cannot be written");
            return;
        }
    };
    let message = message.get(..length).unwrap_or_default();
    if let Err(error) = write_frame(send, message, limit).await {
        tracing::warn!(%error, "the farewell did not reach the slave");
        return;
    }
    // an error says that the stream is closed already
    let _ = send.finish();
}

/// Waits until the slave has all of the stream, or not.
pub(super) async fn delivered(send: &SendStream, limit: Duration) {
    // closing comes next in any case
    let _ = timeout(limit, send.stopped()).await;
}
