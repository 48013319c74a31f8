//! The farewell of a session, which both ends send and receive alike.
//!
//! A report that cannot be written or read costs the session nothing: the farewell then goes without it.

use std::time::Duration;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::stream::{ReadFrameError, WriteFrameError, read_frame, write_message};
use super::transport::{Connection, ReadError, RecvStream, SendStream};
use crate::wire::{DecodeError, Ending, Farewell, Kind, STREAM_MESSAGE_MAX, Side, StreamMessage};

/// How long each side waits for the other's farewell and close after its own farewell, beyond the round trip
/// (docs/protocol.md, section 2).
pub const FAREWELL_WAIT: Duration = Duration::from_secs(1);
/// The longest round trip that is waited for: a way that has become worse than that is as good as gone.
const ROUND_TRIP_MAX: Duration = Duration::from_secs(4);

/// How long to wait for the other's farewell over this connection: `least`, and the round trip that it needs.
pub fn farewell_wait(connection: &Connection, least: Duration) -> Duration {
    least + connection.round_trip().min(ROUND_TRIP_MAX)
}

/// The other side's farewell.
#[derive(Clone, Debug, PartialEq)]
pub struct ReceivedFarewell<T> {
    /// Why the other side ended.
    pub ending: Ending,
    /// What it counted: of its JSON the keys that are known, the others absent; none if it cannot be read.
    pub report: Option<T>,
}

/// Why there is no farewell of the other side.
#[derive(Debug, thiserror::Error)]
pub enum FarewellError {
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
    /// Whether the connection went and the other side is not to blame.
    pub fn is_loss(&self) -> bool {
        matches!(
            self,
            Self::Read(ReadFrameError::Stream(ReadError::ConnectionLost(_)))
        )
    }
}

/// Writes a farewell and ends this direction of the stream.
///
/// # Errors
/// The stream did not take it within `limit`.
pub async fn send_farewell(
    stream: &mut SendStream,
    ending: Ending,
    report: &impl Serialize,
    limit: Duration,
) -> Result<(), WriteFrameError> {
    let report = serde_json::to_vec(report).unwrap_or_default();
    let farewell = |report| StreamMessage::Farewell(Farewell { ending, report });
    let written = write_message(stream, &farewell(&report), limit).await;
    if let Err(WriteFrameError::Encode(_)) = written {
        // a report too long for the frame stays behind
        write_message(stream, &farewell(&[]), limit).await?;
    } else {
        written?;
    }
    // fails only on a stream that has ended
    drop(stream.finish());
    Ok(())
}

/// Waits for the farewell of the side `from`, for as long as it takes. Not cancel-safe.
///
/// # Errors
/// The stream or the connection ended, or something else came.
pub async fn receive_farewell<T: DeserializeOwned>(
    stream: &mut RecvStream,
    from: Side,
) -> Result<ReceivedFarewell<T>, FarewellError> {
    let message = read_frame(stream, STREAM_MESSAGE_MAX, Duration::MAX).await?;
    match StreamMessage::decode(&message, from)? {
        StreamMessage::Farewell(Farewell { ending, report }) => Ok(ReceivedFarewell {
            ending,
            report: serde_json::from_slice(report).ok(),
        }),
        other => Err(FarewellError::Unexpected { kind: other.kind() }),
    }
}

/// What a side does after its own farewell: it waits for the other's, then for its close, for both until `deadline`.
pub async fn answer<T>(
    farewell: impl Future<Output = Option<T>>,
    closed: impl Future,
    deadline: impl Future,
) -> Option<T> {
    let mut theirs = None;
    let both = async {
        theirs = farewell.await;
        closed.await;
    };
    tokio::select! {
        biased;
        () = both => {}
        _ = deadline => {}
    }
    theirs
}

#[cfg(test)]
mod tests {
    use std::future::{pending, ready};

    use super::*;

    #[tokio::test]
    async fn one_deadline_is_for_the_farewell_and_the_close_together() {
        let nothing = answer(pending::<Option<u8>>(), pending::<()>(), ready(())).await;
        assert_eq!(nothing, None);
        let unclosed = answer(ready(Some(7)), pending::<()>(), ready(())).await;
        assert_eq!(unclosed, Some(7), "the farewell came, the close did not");
        let all = answer(ready(Some(7)), ready(()), pending::<()>()).await;
        assert_eq!(all, Some(7), "nothing is waited for any more");
    }
}
