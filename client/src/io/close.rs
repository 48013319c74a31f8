//! The end of a session: farewells on the stream, then the connection.

use std::time::Duration;

use mmt_shared::io::stream::ReadFrameError;
use mmt_shared::io::transport::{ReadError, RecvStream, SendStream};
use mmt_shared::wire::{
    DecodeError, Farewell, Kind, MasterTotals, STREAM_MESSAGE_MAX, Side, SlaveTotals,
    StreamMessage, decode_stream_message, encode_master_farewell,
};

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
    let message = receive
        .read_frame(STREAM_MESSAGE_MAX, Duration::MAX)
        .await?;
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
    if let Err(error) = send.write_frame(message, limit).await {
        tracing::warn!(%error, "the farewell did not reach the slave");
        return;
    }
    send.finish();
}
