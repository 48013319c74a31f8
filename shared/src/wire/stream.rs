//! Messages on the one stream: hello, then welcome or refused, then a farewell from each side.
//!
//! Each is a length (four bytes, little endian) and a message of that length. A length beyond
//! [`STREAM_MESSAGE_MAX`] is refused before a byte of the message is waited for.

use super::body::{Body, read, write};
use super::error::{DecodeError, EncodeError, FieldError};
use super::header::{Channel, HEADER_BYTES, Kind, PREFIX_BYTES, STREAM_MESSAGE_MAX, Side, open};
use super::message::{Farewell, Hello, Refusal, Welcome};
use super::raw::{RawHello, RawWelcome};
use super::totals::{MasterTotals, SlaveTotals};

/// Room for the longest message on the stream with its prefix, bytes.
pub const STREAM_FRAME_MAX: usize = PREFIX_BYTES + STREAM_MESSAGE_MAX;

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

/// Writes prefix and hello to the front of `out`; returns how many bytes that took, at most
/// [`STREAM_FRAME_MAX`].
///
/// # Errors
/// Says which field breaks a rule, or that `out` is too short; what is in `out` then must not be sent.
pub fn encode_hello(hello: &Hello, out: &mut [u8]) -> Result<usize, EncodeError> {
    frame(&RawHello::of(hello), out)
}

/// Writes prefix and welcome.
///
/// # Errors
/// As [`encode_hello`].
pub fn encode_welcome(welcome: &Welcome, out: &mut [u8]) -> Result<usize, EncodeError> {
    frame(&RawWelcome::of(welcome), out)
}

/// Writes prefix and refusal.
///
/// # Errors
/// As [`encode_hello`].
pub fn encode_refused(refusal: Refusal, out: &mut [u8]) -> Result<usize, EncodeError> {
    frame(&refusal, out)
}

/// Writes prefix and the master's farewell.
///
/// # Errors
/// As [`encode_hello`].
pub fn encode_master_farewell(
    farewell: &Farewell<MasterTotals>,
    out: &mut [u8],
) -> Result<usize, EncodeError> {
    frame(farewell, out)
}

/// Writes prefix and the slave's farewell.
///
/// # Errors
/// As [`encode_hello`].
pub fn encode_slave_farewell(
    farewell: &Farewell<SlaveTotals>,
    out: &mut [u8],
) -> Result<usize, EncodeError> {
    frame(farewell, out)
}

/// Reads the first message of what has arrived on the stream from `from`, and how many bytes it took;
/// none if more must arrive first.
///
/// # Errors
/// Says why the bytes do not begin with a message that `from` may send on the stream. The stream cannot
/// be read any further then.
pub fn decode_stream(
    arrived: &[u8],
    from: Side,
) -> Result<Option<(StreamMessage, usize)>, DecodeError> {
    let Some((prefix, rest)) = arrived.split_first_chunk::<PREFIX_BYTES>() else {
        return Ok(None);
    };
    let length = usize::try_from(u32::from_le_bytes(*prefix)).unwrap_or(usize::MAX);
    if length > STREAM_MESSAGE_MAX {
        return Err(DecodeError::TooLong { length });
    }
    if length < HEADER_BYTES {
        return Err(DecodeError::TooShort { length });
    }
    let Some(message) = rest.get(..length) else {
        return Ok(None);
    };
    Ok(Some((
        decode_message(message, from)?,
        PREFIX_BYTES + length,
    )))
}

fn decode_message(message: &[u8], from: Side) -> Result<StreamMessage, DecodeError> {
    let (kind, body) = open(message, from, Channel::Stream)?;
    match kind {
        Kind::Hello => read(body).map(StreamMessage::Hello),
        Kind::Welcome => read(body).map(StreamMessage::Welcome),
        Kind::Refused => read(body).map(StreamMessage::Refused),
        Kind::MasterFarewell => read(body).map(StreamMessage::MasterFarewell),
        Kind::SlaveFarewell => read(body).map(StreamMessage::SlaveFarewell),
        Kind::Command | Kind::Update | Kind::Scene | Kind::Heartbeat => {
            Err(DecodeError::WrongChannel { kind })
        }
    }
}

fn frame<B: Body>(body: &B, out: &mut [u8]) -> Result<usize, EncodeError> {
    let (kind, length) = (B::KIND, out.len());
    let too_small = EncodeError::BufferTooSmall { kind, length };
    let (prefix, rest) = out
        .split_first_chunk_mut::<PREFIX_BYTES>()
        .ok_or(too_small)?;
    let used = write(body, rest)?;
    *prefix = u32::try_from(used).map_err(|_| too_small)?.to_le_bytes();
    Ok(PREFIX_BYTES + used)
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
        StreamMessage::Hello(hello) => frame(hello, out),
        StreamMessage::Welcome(welcome) => frame(welcome, out),
        StreamMessage::Refused(refusal) => frame(refusal, out),
        StreamMessage::MasterFarewell(farewell) => frame(farewell, out),
        StreamMessage::SlaveFarewell(farewell) => frame(farewell, out),
    }
}
