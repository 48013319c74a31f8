//! Why a session ends.

use std::time::Duration;

use mmt_shared::channel::peer::NumbersSpent;
use mmt_shared::io::farewell::{FarewellError, ReceivedFarewell};
use mmt_shared::io::transport::ConnectionError;
use mmt_shared::report::MasterHalf;

use crate::end::DISENGAGE;

/// A master from which nothing arrived for this long has lost its lease (docs/protocol.md, section 2).
pub(in crate::io) const SILENCE_MAX: Duration = Duration::from_secs(10);

/// Why a session ended.
#[derive(Debug, thiserror::Error)]
pub(in crate::io) enum End {
    #[error("this side was asked to end")]
    Asked,
    #[error("a thread of this side panicked")]
    ThreadPanicked,
    #[error("the master ended ({:?})", .0.ending)]
    Farewell(Box<ReceivedFarewell<MasterHalf>>),
    #[error(
        "the master has been silent for {DISENGAGE:?}: the session is over, and the tool stands until the next one"
    )]
    Disengaged,
    #[error("nothing came from the master for {SILENCE_MAX:?}")]
    Silence,
    #[error("the connection was lost: {0}")]
    Disconnected(#[from] ConnectionError),
    #[error("the stream ended: {0}")]
    Stream(#[from] FarewellError),
    #[error(transparent)]
    Numbers(#[from] NumbersSpent),
    #[error("another operator has taken over")]
    TakenOver,
    #[error("the 1 kHz thread panicked or has hung")]
    LoopFailed,
}
