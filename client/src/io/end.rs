//! Why a session ends, in the order of who noticed.

use std::fmt;

use mmt_shared::io::wish::Wish;
use mmt_shared::wire::Ending;
use serde::Serialize;

/// Why a session ended, as the master saw it. The first cause counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SessionEnd {
    /// The duration that was asked for is over.
    DurationOver,
    /// The operator has nothing more to do: its trace has ended.
    OperatorFinished,
    /// A person or the system asked for it here.
    Stopped,
    /// A thread of this process panicked.
    ThreadPanicked,
    /// The slave sent its farewell first.
    SlaveEnded(Ending),
    /// One of the two ways was silent for so long that the hand was released.
    LinkSilent,
    /// An observer received nothing for so long that the slave counts as gone.
    SlaveSilent,
    /// A number of the local model was none, and the hand was released.
    ModelBroken,
    /// Another operator has taken the slave over.
    TakenOver,
    /// The token of an observer was replaced or revoked.
    Revoked,
    /// The connection broke or was closed.
    ConnectionLost,
    /// The slave sent on the stream what it must not send there, or closed it.
    StreamBroken,
}

impl SessionEnd {
    /// The ending in the farewell and in the report.
    pub fn ending(self) -> Ending {
        match self {
            Self::DurationOver | Self::OperatorFinished => Ending::Finished,
            Self::Stopped => Ending::Interrupted,
            Self::SlaveEnded(ending) => ending,
            Self::LinkSilent
            | Self::SlaveSilent
            | Self::ModelBroken
            | Self::ThreadPanicked
            | Self::TakenOver
            | Self::Revoked
            | Self::ConnectionLost
            | Self::StreamBroken => Ending::Failed,
        }
    }
}

impl From<Wish> for SessionEnd {
    fn from(wish: Wish) -> Self {
        match wish {
            Wish::Fail => Self::ThreadPanicked,
            Wish::GoOn | Wish::End => Self::Stopped,
        }
    }
}

impl fmt::Display for SessionEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::DurationOver => "the duration is over",
            Self::OperatorFinished => "the operator has finished",
            Self::Stopped => "it was asked to end",
            Self::ThreadPanicked => {
                "a thread of mmt panicked: this is a defect of mmt; please report it with what stands above"
            }
            Self::SlaveEnded(Ending::Finished) => "the slave has finished",
            Self::SlaveEnded(Ending::Interrupted) => "the slave was asked to end",
            Self::SlaveEnded(Ending::Failed) => "the slave failed: see its own log",
            Self::LinkSilent => {
                "for 1 s nothing came from the slave, or nothing that was sent was answered, and the hand \
                 was released: see whether the slave and the network are alive, and start again"
            }
            Self::SlaveSilent => {
                "for 10 s nothing came from the slave: see whether the slave and the network are alive, and start again"
            }
            Self::ModelBroken => {
                "a number of the local model was not finite and the hand was released: this is a \
                 defect of mmt; please report it with the report of this session"
            }
            Self::TakenOver => "another operator has taken the slave over",
            Self::Revoked => {
                "the token was replaced or revoked: ask the slave's owner for another pairing string"
            }
            Self::ConnectionLost => {
                "the connection to the slave was lost: see whether it still runs, and start again"
            }
            Self::StreamBroken => {
                "the slave broke the protocol on the stream: run the same version of mmt on both hosts"
            }
        })
    }
}
