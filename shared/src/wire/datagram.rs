//! Messages in QUIC datagrams: an envelope and a command, update, scene or heartbeat.
//!
//! One datagram is exactly one message. Nothing here allocates.

use serde::{Deserialize, Serialize};

use super::body::{Body, read, write};
use super::error::{DecodeError, EncodeError, FieldError, demand};
use super::header::{Channel, DATAGRAM_MAX, Kind, Side, open};
use super::message::{Command, Envelope, Scene, Update};
use super::raw::{RawScene, RawUpdate};

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
    write(&Sealed(*envelope, command), out)
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
            let Sealed(envelope, command) = read(body)?;
            (envelope, Matter::Command(command))
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

impl Sealable for Command {
    const KIND: Kind = Kind::Command;

    fn check(&self) -> Result<(), FieldError> {
        let moves = !self.samples.is_empty();
        demand(moves, "samples", "must be one or more")
    }
}

impl Sealable for &Command {
    const KIND: Kind = Kind::Command;

    fn check(&self) -> Result<(), FieldError> {
        (*self).check()
    }
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
        Matter::Heartbeat => encode_heartbeat(&envelope, out),
    }
}
