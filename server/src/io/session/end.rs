//! Why a session ends.

use std::time::Duration;

use mmt_shared::channel::peer::NumbersSpent;
use mmt_shared::io::farewell::{FarewellError, ReceivedFarewell};
use mmt_shared::io::transport::ConnectionError;
use mmt_shared::report::MasterHalf;

/// A master that has not been heard for this long has lost its lease (reliability.md, section 1).
pub(super) const SILENCE_MAX: Duration = Duration::from_secs(10);

/// Why a session ended.
#[derive(Debug, thiserror::Error)]
pub(in crate::io) enum End {
    #[error("this side was asked to end")]
    Asked,
    #[error("the master said farewell ({:?})", .0.ending)]
    Farewell(Box<ReceivedFarewell<MasterHalf>>),
    #[error("the master was not heard for {SILENCE_MAX:?}")]
    Silence,
    #[error("the connection was lost: {0}")]
    Disconnected(#[from] ConnectionError),
    #[error("the stream ended: {0}")]
    Stream(#[from] FarewellError),
    #[error(transparent)]
    Numbers(#[from] NumbersSpent),
    #[error("the 1 kHz thread panicked")]
    Panicked,
}
