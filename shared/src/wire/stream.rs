//! Messages on the one stream: hello, then welcome or refused, then a farewell from each side.
//!
//! On the stream each stands behind its length (four bytes, little endian): framing is the transport's
//! business, which reads no more than [`STREAM_MESSAGE_MAX`] bytes. Here a message is without that prefix.

use super::body::{Body, read, write};
use super::error::{DecodeError, EncodeError, FieldError};
use super::header::{Channel, Kind, STREAM_MESSAGE_MAX, Side, open};
use super::message::{Farewell, Hello, Refusal, Welcome};
use super::raw::{RawHello, RawWelcome};
use super::totals::{MasterTotals, SlaveTotals};

/// A stream message that was read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StreamMessage {
    /// The master asks.
    Hello(RawHello),
    /// The slave says yes.
    Welcome(RawWelcome),
    /// The slave says no.
    Refused(Refusal),
    /// The master ends.
    MasterFarewell(Farewell<MasterTotals>),
    /// The slave ends.
    SlaveFarewell(Farewell<SlaveTotals>),
}

impl StreamMessage {
    /// Its type.
    #[must_use]
    pub fn kind(&self) -> Kind {
        match self {
            Self::Hello(_) => Kind::Hello,
            Self::Welcome(_) => Kind::Welcome,
            Self::Refused(_) => Kind::Refused,
            Self::MasterFarewell(_) => Kind::MasterFarewell,
            Self::SlaveFarewell(_) => Kind::SlaveFarewell,
        }
    }
}

/// Writes a hello to the front of `out`; returns its length, at most [`STREAM_MESSAGE_MAX`].
///
/// # Errors
/// Says which field breaks a rule, or that `out` is too short; what is in `out` then must not be sent.
pub fn encode_hello(hello: &Hello, out: &mut [u8]) -> Result<usize, EncodeError> {
    write(&RawHello::of(hello), out)
}

/// Writes a welcome to the front of `out`; returns its length.
///
/// # Errors
/// As [`encode_hello`].
pub fn encode_welcome(welcome: &Welcome, out: &mut [u8]) -> Result<usize, EncodeError> {
    write(&RawWelcome::of(welcome), out)
}

/// Writes a refusal to the front of `out`; returns its length.
///
/// # Errors
/// As [`encode_hello`].
pub fn encode_refused(refusal: Refusal, out: &mut [u8]) -> Result<usize, EncodeError> {
    write(&refusal, out)
}

/// Writes the master's farewell to the front of `out`; returns its length.
///
/// # Errors
/// As [`encode_hello`].
pub fn encode_master_farewell(
    farewell: &Farewell<MasterTotals>,
    out: &mut [u8],
) -> Result<usize, EncodeError> {
    write(farewell, out)
}

/// Writes the slave's farewell to the front of `out`; returns its length.
///
/// # Errors
/// As [`encode_hello`].
pub fn encode_slave_farewell(
    farewell: &Farewell<SlaveTotals>,
    out: &mut [u8],
) -> Result<usize, EncodeError> {
    write(farewell, out)
}

/// Reads a message that `from` sent on the stream, its length prefix taken off.
///
/// # Errors
/// Says why the bytes are not exactly one message that `from` may send on the stream. The stream must
/// not be read any further then.
pub fn decode_stream_message(message: &[u8], from: Side) -> Result<StreamMessage, DecodeError> {
    let length = message.len();
    if length > STREAM_MESSAGE_MAX {
        return Err(DecodeError::TooLong { length });
    }
    let (kind, body) = open(message, from, Channel::Stream)?;
    match kind {
        Kind::Hello => read(body).map(StreamMessage::Hello),
        Kind::Welcome => read(body).map(StreamMessage::Welcome),
        Kind::Refused => read(body).map(StreamMessage::Refused),
        Kind::MasterFarewell => read(body).map(StreamMessage::MasterFarewell),
        Kind::SlaveFarewell => read(body).map(StreamMessage::SlaveFarewell),
        Kind::Command
        | Kind::Update
        | Kind::Scene
        | Kind::Heartbeat
        | Kind::Tool
        | Kind::CoupledCommand => Err(DecodeError::WrongChannel { kind }),
    }
}

impl Body for RawHello {
    const KIND: Kind = Kind::Hello;

    fn check(&self) -> Result<(), FieldError> {
        Self::check(self)
    }
}

impl Body for RawWelcome {
    const KIND: Kind = Kind::Welcome;

    fn check(&self) -> Result<(), FieldError> {
        Self::check(self)
    }
}

impl Body for Refusal {
    const KIND: Kind = Kind::Refused;

    fn check(&self) -> Result<(), FieldError> {
        Ok(())
    }
}

impl Body for Farewell<MasterTotals> {
    const KIND: Kind = Kind::MasterFarewell;

    fn check(&self) -> Result<(), FieldError> {
        self.totals.check()
    }
}

impl Body for Farewell<SlaveTotals> {
    const KIND: Kind = Kind::SlaveFarewell;

    fn check(&self) -> Result<(), FieldError> {
        self.totals.check()
    }
}

/// Writes what was read, accepted or not: the tests hold it against the bytes.
#[cfg(test)]
pub(super) fn encode_read(read: &StreamMessage, out: &mut [u8]) -> Result<usize, EncodeError> {
    match read {
        StreamMessage::Hello(hello) => write(hello, out),
        StreamMessage::Welcome(welcome) => write(welcome, out),
        StreamMessage::Refused(refusal) => write(refusal, out),
        StreamMessage::MasterFarewell(farewell) => write(farewell, out),
        StreamMessage::SlaveFarewell(farewell) => write(farewell, out),
    }
}
