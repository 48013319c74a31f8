//! Messages in QUIC datagrams: an envelope, then a command, update, scene, tool state or nothing more.
//!
//! One datagram is exactly one message. Nothing here allocates.

use serde::{Deserialize, Serialize};

use super::body::{read, write};
use super::error::{DecodeError, EncodeError, FieldError, demand, finite};
use super::flags::Flags;
use super::header::open;
use super::kind::{Channel, Kind, Side};
use super::samples::SampleBlock;
use super::state::RawState;
use crate::model::tool::{HandPort, Scene, Tool};
use crate::model::update::Update;
use crate::time::Time;

/// What every datagram carries besides its message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Envelope {
    /// Number of this datagram in its direction, from 1, whatever its type: the receiver counts loss by it.
    pub number: u32,
    /// When it was sent, by the sender's clock.
    pub sent: Time,
    /// The newest datagram that the sender has from the other side; none before the first.
    pub echo: Option<Echo>,
}

/// The answer to a stamp: from it the other side computes the round-trip time without a common clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Echo {
    /// Number of the newest datagram received from the other side.
    pub number: u32,
    /// That datagram's `sent`, by the other side's clock.
    pub sent: Time,
    /// How long it was held before this answer, ns.
    pub held_ns: u64,
    /// How many datagrams have been received from the other side so far.
    pub received: u32,
}

/// The master's motion since its last command.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// Number of the newest update that the master had accepted when it sent this, 0 before the first: the
    /// acknowledgement that the shadow needs.
    pub newest_update: u32,
    /// One sample or more.
    pub samples: SampleBlock,
    /// The hand's port, where the hand feels the tool's force.
    pub port: Option<HandPort>,
}

/// What a datagram is about.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "a command is the common case, and nothing here may allocate"
)]
pub enum Message {
    /// The master's motion.
    Command(Command),
    /// The slave's model; off the wire its state is not yet accepted.
    Update(Update<RawState>),
    /// What a viewer sees.
    Scene(Scene),
    /// What the tool feels.
    Tool(Tool),
    /// Nothing but the envelope.
    Heartbeat,
}

impl Message {
    /// Its type.
    pub const fn kind(&self) -> Kind {
        match self {
            Self::Command(_) => Kind::Command,
            Self::Update(_) => Kind::Update,
            Self::Scene(_) => Kind::Scene,
            Self::Tool(_) => Kind::Tool,
            Self::Heartbeat => Kind::Heartbeat,
        }
    }
}

/// A datagram: its envelope and its message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Datagram {
    /// What the header shows of the sender.
    pub flags: Flags,
    /// Number, stamp and echo.
    pub envelope: Envelope,
    /// What it is about.
    pub message: Message,
}

impl Datagram {
    /// Writes it to the front of `out`; returns its length, at most [`DATAGRAM_MAX`](super::DATAGRAM_MAX).
    ///
    /// # Errors
    /// Names the field that breaks a rule, or that `out` is too short; what is in `out` then must not be sent.
    pub fn encode(&self, out: &mut [u8]) -> Result<usize, EncodeError> {
        let (kind, flags, envelope) = (self.message.kind(), self.flags, &self.envelope);
        self.check()
            .map_err(|why| EncodeError::Field { kind, why })?;
        match &self.message {
            Message::Command(command) => write(kind, flags, &(envelope, command), out),
            Message::Update(update) => write(kind, flags, &(envelope, update), out),
            Message::Scene(scene) => write(kind, flags, &(envelope, scene), out),
            Message::Tool(tool) => write(kind, flags, &(envelope, tool), out),
            Message::Heartbeat => write(kind, flags, envelope, out),
        }
    }

    /// Reads a datagram that `from` sent.
    ///
    /// # Errors
    /// Why the bytes are not exactly one message that `from` may send in a datagram.
    pub fn decode(bytes: &[u8], from: Side) -> Result<Self, DecodeError> {
        let (kind, flags, body) = open(bytes, from, Channel::Datagram)?;
        let (envelope, message) = match kind {
            Kind::Command => with(Message::Command, read(kind, body)?),
            Kind::Update => with(Message::Update, read(kind, body)?),
            Kind::Scene => with(Message::Scene, read(kind, body)?),
            Kind::Tool => with(Message::Tool, read(kind, body)?),
            Kind::Heartbeat => (read(kind, body)?, Message::Heartbeat),
            Kind::Hello | Kind::Welcome | Kind::Refused | Kind::Farewell => {
                return Err(DecodeError::WrongChannel { kind });
            }
        };
        let datagram = Self {
            flags,
            envelope,
            message,
        };
        match datagram.check() {
            Ok(()) => Ok(datagram),
            Err(why) => Err(DecodeError::Field { kind, why }),
        }
    }

    /// The rules that fields keep, whatever the session: checked before writing and after reading.
    fn check(&self) -> Result<(), FieldError> {
        let from_1 = "must be 1 or more";
        demand(self.envelope.number > 0, "number", from_1)?;
        let echo = self.envelope.echo;
        let echoed = echo.is_none_or(|echo| echo.number > 0);
        demand(echoed, "echoed number", from_1)?;
        match &self.message {
            Message::Command(command) => {
                demand(!command.samples.is_empty(), "samples", from_1)?;
                command.port.map_or(Ok(()), |port| energy(port.in_j))
            }
            Message::Update(update) => {
                demand(update.sequence > 0, "sequence", from_1)?;
                update.state.check()
            }
            Message::Scene(scene) => {
                let object = scene.object;
                finite("object", object.position.as_slice())?;
                finite("object", &[object.angle])?;
                finite("tool", scene.tool.as_slice())?;
                finite("force", scene.force.as_slice())
            }
            Message::Tool(tool) => energy(tool.in_j),
            Message::Heartbeat => Ok(()),
        }
    }
}

fn with<M>(message: fn(M) -> Message, (envelope, body): (Envelope, M)) -> (Envelope, Message) {
    (envelope, message(body))
}

/// What went in at a port, J.
fn energy(in_j: f64) -> Result<(), FieldError> {
    finite("in_j", &[in_j])?;
    demand(in_j >= 0.0, "in_j", "must be 0 or more")
}
