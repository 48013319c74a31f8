//! Messages on the one stream: hello, then welcome or refused, then a farewell from each side.
//!
//! On the stream each stands behind its length (four bytes, little endian): framing is the transport's
//! business, which reads no more than [`STREAM_MESSAGE_MAX`](super::STREAM_MESSAGE_MAX) bytes. Here a
//! message is without that prefix. "Up" is master to slave, "down" is slave to master.

mod hello;
mod welcome;

pub use hello::{Claim, Hello, HelloError, Role, SCENE_HZ_MAX};
pub use welcome::{Welcome, WelcomeError};

use serde::{Deserialize, Serialize};

use super::body::{read, write};
use super::error::{DecodeError, EncodeError, FieldError, finite};
use super::flags::Flags;
use super::header::open;
use super::kind::{Channel, Kind, Side};
use super::state::RawState;
use crate::model::contact::Coupling;
use crate::model::settings::Smoothing;

/// Why a slave refused a hello.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// Another master operates this slave.
    Busy,
    /// The token is not this slave's.
    WrongToken,
    /// The hello's numbers are out of range.
    BadHello,
    /// The slave is ending.
    Ending,
    /// The token is for another role than the one asked for.
    WrongRole,
}

/// Why a session ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ending {
    /// The duration was over or the operator's trace had ended.
    Finished,
    /// A person or the system asked for it.
    Interrupted,
    /// An error on the sending side.
    Failed,
}

impl Ending {
    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::Interrupted => "interrupted",
            Self::Failed => "failed",
        }
    }
}

/// The last message of a side: why it ends, and what it counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Farewell<'a> {
    /// Why the sender ends.
    pub ending: Ending,
    /// The sender's report, which the wire only carries: JSON, see `docs/protocol.md`.
    pub report: &'a [u8],
}

/// A stream message. Off the wire, numbers that a model would take are not yet accepted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StreamMessage<'a> {
    /// The master asks.
    Hello(Hello),
    /// The slave accepts.
    Welcome(Welcome<RawState>),
    /// The slave refuses.
    Refused(Refusal),
    /// A side ends.
    Farewell(Farewell<'a>),
}

impl<'a> StreamMessage<'a> {
    /// Its type.
    pub const fn kind(&self) -> Kind {
        match self {
            Self::Hello(_) => Kind::Hello,
            Self::Welcome(_) => Kind::Welcome,
            Self::Refused(_) => Kind::Refused,
            Self::Farewell(_) => Kind::Farewell,
        }
    }

    /// Writes it to the front of `out`; returns its length, at most
    /// [`STREAM_MESSAGE_MAX`](super::STREAM_MESSAGE_MAX).
    ///
    /// # Errors
    /// Names the field that breaks a rule, or that `out` is too short; what is in `out` then must not be sent.
    pub fn encode(&self, out: &mut [u8]) -> Result<usize, EncodeError> {
        let (kind, none) = (self.kind(), Flags::default());
        self.check()
            .map_err(|why| EncodeError::Field { kind, why })?;
        match self {
            Self::Hello(hello) => write(kind, none, hello, out),
            Self::Welcome(welcome) => write(kind, none, welcome, out),
            Self::Refused(refusal) => write(kind, none, refusal, out),
            Self::Farewell(farewell) => write(kind, none, farewell, out),
        }
    }

    /// Reads a message that `from` sent on the stream, its length prefix taken off.
    ///
    /// # Errors
    /// Why the bytes are not exactly one message that `from` may send on the stream. The stream must
    /// not be read any further then.
    pub fn decode(message: &'a [u8], from: Side) -> Result<Self, DecodeError> {
        let (kind, _, body) = open(message, from, Channel::Stream)?;
        let message = match kind {
            Kind::Hello => Self::Hello(read(kind, body)?),
            Kind::Welcome => Self::Welcome(read(kind, body)?),
            Kind::Refused => Self::Refused(read(kind, body)?),
            Kind::Farewell => Self::Farewell(read(kind, body)?),
            Kind::Command | Kind::Update | Kind::Scene | Kind::Heartbeat | Kind::Tool => {
                return Err(DecodeError::WrongChannel { kind });
            }
        };
        match message.check() {
            Ok(()) => Ok(message),
            Err(why) => Err(DecodeError::Field { kind, why }),
        }
    }

    /// Every number must be finite: checked before writing and after reading.
    fn check(&self) -> Result<(), FieldError> {
        match self {
            Self::Hello(hello) => {
                check_coupling(&hello.coupling)?;
                finite("hip", hello.hip.as_slice())
            }
            Self::Welcome(welcome) => {
                check_coupling(&welcome.settings.coupling)?;
                match welcome.settings.smoothing {
                    Smoothing::PerPacket { lambda } => finite("lambda", &[lambda])?,
                    Smoothing::InTime { tau_s } => finite("tau_s", &[tau_s])?,
                }
                finite("tool", welcome.tool.as_slice())?;
                finite("tool_force_max_n", &[welcome.tool_force_max_n])?;
                welcome.state.check()
            }
            Self::Refused(_) | Self::Farewell(_) => Ok(()),
        }
    }
}

fn check_coupling(coupling: &Coupling) -> Result<(), FieldError> {
    finite("stiffness_n_per_m", &[coupling.stiffness_n_per_m])?;
    finite("damping_ns_per_m", &[coupling.damping_ns_per_m])
}
