//! Messages in QUIC datagrams: an envelope and a command, update, scene, tool or heartbeat.
//!
//! One datagram is exactly one message. Nothing here allocates.

use serde::{Deserialize, Serialize};

use super::body::{Body, read, write};
use super::error::{DecodeError, EncodeError, FieldError, demand, finite};
use super::header::{Channel, DATAGRAM_MAX, Kind, Side, open};
use super::message::{Command, Envelope};
use super::raw::{RawScene, RawUpdate};
use super::samples::SampleBlock;
use crate::model::tool::{HandPort, Scene, Tool};
use crate::model::update::Update;

/// A datagram that was read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Datagram {
    /// Number, stamp and echo.
    pub envelope: Envelope,
    /// What it is about.
    pub matter: Matter,
}

/// What a datagram is about.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "a command is the common case, and nothing here may allocate"
)]
pub enum Matter {
    /// The master's motion.
    Command(Command),
    /// The slave's model, its numbers not yet accepted.
    Update(RawUpdate),
    /// What a viewer sees.
    Scene(Scene),
    /// What the tool feels.
    Tool(Tool),
    /// Nothing but the envelope.
    Heartbeat,
}

/// Writes a command to the front of `out`; returns its length, at most [`DATAGRAM_MAX`].
///
/// # Errors
/// Says which field breaks a rule, or that `out` is too short; what is in `out` then must not be sent.
pub fn encode_command(
    envelope: &Envelope,
    command: &Command,
    out: &mut [u8],
) -> Result<usize, EncodeError> {
    let Command {
        newest_update,
        samples,
        port,
    } = *command;
    let motion = Motion {
        newest_update,
        samples,
    };
    match port {
        None => write(&Sealed(*envelope, motion), out),
        Some(port) => write(&Sealed(*envelope, CoupledMotion(motion, port)), out),
    }
}

/// Writes an update to the front of `out`; returns its length.
///
/// # Errors
/// As [`encode_command`].
pub fn encode_update(
    envelope: &Envelope,
    update: &Update,
    out: &mut [u8],
) -> Result<usize, EncodeError> {
    write(&Sealed(*envelope, RawUpdate::of(update)), out)
}

/// Writes a scene to the front of `out`; returns its length.
///
/// # Errors
/// As [`encode_command`].
pub fn encode_scene(
    envelope: &Envelope,
    scene: &Scene,
    out: &mut [u8],
) -> Result<usize, EncodeError> {
    write(&Sealed(*envelope, RawScene::of(scene)), out)
}

/// Writes what the tool feels to the front of `out`; returns its length.
///
/// # Errors
/// As [`encode_command`].
pub fn encode_tool(envelope: &Envelope, tool: &Tool, out: &mut [u8]) -> Result<usize, EncodeError> {
    write(&Sealed(*envelope, *tool), out)
}

/// Writes a heartbeat to the front of `out`; returns its length.
///
/// # Errors
/// As [`encode_command`].
pub fn encode_heartbeat(envelope: &Envelope, out: &mut [u8]) -> Result<usize, EncodeError> {
    write(&Sealed(*envelope, Silence), out)
}

/// Reads a datagram that `from` sent.
///
/// # Errors
/// Says why the bytes are not exactly one message that `from` may send in a datagram.
pub fn decode_datagram(bytes: &[u8], from: Side) -> Result<Datagram, DecodeError> {
    let length = bytes.len();
    if length > DATAGRAM_MAX {
        return Err(DecodeError::TooLong { length });
    }
    let (kind, body) = open(bytes, from, Channel::Datagram)?;
    let (envelope, matter) = match kind {
        Kind::Command => {
            let Sealed::<Motion>(envelope, motion) = read(body)?;
            (envelope, Matter::Command(motion.with(None)))
        }
        Kind::CoupledCommand => {
            let Sealed(envelope, CoupledMotion(motion, port)) = read(body)?;
            (envelope, Matter::Command(motion.with(Some(port))))
        }
        Kind::Tool => {
            let Sealed(envelope, tool) = read(body)?;
            (envelope, Matter::Tool(tool))
        }
        Kind::Update => {
            let Sealed(envelope, update) = read(body)?;
            (envelope, Matter::Update(update))
        }
        Kind::Scene => {
            let Sealed::<RawScene>(envelope, scene) = read(body)?;
            (envelope, Matter::Scene(scene.scene()))
        }
        Kind::Heartbeat => {
            let Sealed(envelope, Silence) = read(body)?;
            (envelope, Matter::Heartbeat)
        }
        Kind::Hello
        | Kind::Welcome
        | Kind::Refused
        | Kind::MasterFarewell
        | Kind::SlaveFarewell => return Err(DecodeError::WrongChannel { kind }),
    };
    Ok(Datagram { envelope, matter })
}

/// The body of every datagram: the envelope, then the matter.
#[derive(Serialize, Deserialize)]
struct Sealed<M>(Envelope, M);

/// The matter of a command.
#[derive(Serialize, Deserialize)]
struct Motion {
    newest_update: u32,
    samples: SampleBlock,
}

impl Motion {
    fn with(&self, port: Option<HandPort>) -> Command {
        Command {
            newest_update: self.newest_update,
            samples: self.samples,
            port,
        }
    }
}

/// The matter of a command with the hand's port.
#[derive(Serialize, Deserialize)]
struct CoupledMotion(Motion, HandPort);

/// The matter of a heartbeat: no bytes.
#[derive(Serialize, Deserialize)]
struct Silence;

/// What may stand behind an envelope.
trait Sealable: Serialize {
    const KIND: Kind;
    fn check(&self) -> Result<(), FieldError>;
}

impl<M: Sealable> Body for Sealed<M> {
    const KIND: Kind = M::KIND;

    fn check(&self) -> Result<(), FieldError> {
        let Self(envelope, matter) = self;
        let echoed = envelope.echo.is_none_or(|echo| echo.number > 0);
        demand(envelope.number > 0, "number", "must be 1 or more")?;
        demand(echoed, "echoed number", "must be 1 or more")?;
        matter.check()
    }
}

impl Sealable for Motion {
    const KIND: Kind = Kind::Command;

    fn check(&self) -> Result<(), FieldError> {
        let moves = !self.samples.is_empty();
        demand(moves, "samples", "must be one or more")
    }
}

impl Sealable for CoupledMotion {
    const KIND: Kind = Kind::CoupledCommand;

    fn check(&self) -> Result<(), FieldError> {
        let Self(motion, port) = self;
        motion.check()?;
        energy(port.in_j)
    }
}

impl Sealable for Tool {
    const KIND: Kind = Kind::Tool;

    fn check(&self) -> Result<(), FieldError> {
        energy(self.in_j)?;
        let is_share = (0.0..=1.0).contains(&self.model_error);
        finite("model_error", self.model_error)?;
        demand(is_share, "model_error", "must be 0 to 1")
    }
}

/// What went in at a port.
fn energy(in_j: f64) -> Result<(), FieldError> {
    finite("in_j", in_j)?;
    demand(in_j >= 0.0, "in_j", "must be 0 or more")
}

impl Sealable for RawUpdate {
    const KIND: Kind = Kind::Update;

    fn check(&self) -> Result<(), FieldError> {
        Self::check(self)
    }
}

impl Sealable for RawScene {
    const KIND: Kind = Kind::Scene;

    fn check(&self) -> Result<(), FieldError> {
        Self::check(self)
    }
}

impl Sealable for Silence {
    const KIND: Kind = Kind::Heartbeat;

    fn check(&self) -> Result<(), FieldError> {
        Ok(())
    }
}

/// Writes what was read, accepted or not: the tests hold it against the bytes.
#[cfg(test)]
pub(super) fn encode_read(read: &Datagram, out: &mut [u8]) -> Result<usize, EncodeError> {
    let envelope = read.envelope;
    match &read.matter {
        Matter::Command(command) => encode_command(&envelope, command, out),
        Matter::Update(update) => write(&Sealed(envelope, *update), out),
        Matter::Scene(scene) => encode_scene(&envelope, scene, out),
        Matter::Tool(tool) => encode_tool(&envelope, tool, out),
        Matter::Heartbeat => encode_heartbeat(&envelope, out),
    }
}
