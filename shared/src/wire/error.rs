//! Why a message was not written or not read.

use super::kind::{DATAGRAM_MAX, HEADER_BYTES, Kind, PROTOCOL_VERSION, STREAM_MESSAGE_MAX, Side};

/// A field that breaks a rule of its message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field} {rule}")]
pub struct FieldError {
    /// Which field.
    pub field: &'static str,
    /// The rule that it breaks: "must …".
    pub rule: &'static str,
}

/// Passes finite numbers; names the field of any other.
pub(super) fn finite(field: &'static str, values: &[f64]) -> Result<(), FieldError> {
    let all_finite = values.iter().all(|value| value.is_finite());
    demand(all_finite, field, "must be finite")
}

/// Passes if `holds`; else names the field and its rule.
pub(super) fn demand(
    holds: bool,
    field: &'static str,
    rule: &'static str,
) -> Result<(), FieldError> {
    if holds {
        Ok(())
    } else {
        Err(FieldError { field, rule })
    }
}

/// Why a message could not be written. Nothing of it may be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EncodeError {
    /// The buffer is shorter than the message.
    #[error("a {} does not fit into a buffer of {length} bytes: give it more", kind.name())]
    BufferTooSmall {
        /// The message.
        kind: Kind,
        /// Length of the buffer, bytes.
        length: usize,
    },
    /// A field breaks a rule, so that the other side would refuse the message.
    #[error("a {} was not written: {why}", kind.name())]
    Field {
        /// The message.
        kind: Kind,
        /// The field and its rule.
        why: FieldError,
    },
}

/// Why bytes are not a message. They are dropped whole and counted; nothing of them is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// Shorter than a header.
    #[error("{length} bytes are no message: the header alone takes {HEADER_BYTES}")]
    TooShort {
        /// Length of the message, bytes.
        length: usize,
    },
    /// Longer than a message on this road may be.
    #[error(
        "{length} bytes are too long for a message: at most {DATAGRAM_MAX} in a datagram and \
         {STREAM_MESSAGE_MAX} on the stream"
    )]
    TooLong {
        /// Claimed or real length of the message, bytes.
        length: usize,
    },
    /// The magic is another's.
    #[error("these bytes do not begin with MMTP: the other side speaks another protocol")]
    NotOurs,
    /// The header is of another version of the protocol.
    #[error(
        "the other side speaks version {theirs} of the protocol, this side version \
         {PROTOCOL_VERSION}: run the same version of mmt on both"
    )]
    OtherVersion {
        /// The version in the header.
        theirs: u8,
    },
    /// No type has this number.
    #[error("no message has the type {number}")]
    UnknownType {
        /// The number in the header.
        number: u8,
    },
    /// Flags are set that this version does not have, or that the sender may not set.
    #[error("a {} has the flags {flags:#06x}, which its sender may not set", kind.name())]
    Flags {
        /// The message.
        kind: Kind,
        /// The flags in the header.
        flags: u16,
    },
    /// A stream message came in a datagram, or a datagram message on the stream.
    #[error("a {} came by the wrong road: stream messages never come in datagrams, nor the reverse", kind.name())]
    WrongChannel {
        /// The message.
        kind: Kind,
    },
    /// This side never sends this message.
    #[error("a {} came from the {}, which never sends one", kind.name(), from.name())]
    WrongDirection {
        /// The message.
        kind: Kind,
        /// Who sent it.
        from: Side,
    },
    /// The body does not follow the layout of its type.
    #[error("a {} is malformed: {reason}", kind.name())]
    Malformed {
        /// The message.
        kind: Kind,
        /// What is wrong.
        reason: &'static str,
    },
    /// Bytes are left after the body.
    #[error("a {} has {extra} bytes too many", kind.name())]
    Trailing {
        /// The message.
        kind: Kind,
        /// How many.
        extra: usize,
    },
    /// Shorter bytes would mean the same: an over-long varint.
    #[error("a {} is not in its one canonical form", kind.name())]
    NotCanonical {
        /// The message.
        kind: Kind,
    },
    /// A field breaks a rule.
    #[error("a {} was not read: {why}", kind.name())]
    Field {
        /// The message.
        kind: Kind,
        /// The field and its rule.
        why: FieldError,
    },
}

/// What postcard's reader found wrong, in words.
pub(super) fn reason(error: &postcard::Error) -> &'static str {
    match error {
        postcard::Error::DeserializeUnexpectedEnd => "it ends too early",
        postcard::Error::DeserializeBadVarint => "a varint is longer than its type allows",
        postcard::Error::DeserializeBadBool => "a truth value is neither 0 nor 1",
        postcard::Error::DeserializeBadOption => "an option is neither 0 nor 1",
        postcard::Error::DeserializeBadUtf8 => "a text is not UTF-8",
        postcard::Error::SerdeDeCustom => {
            "a choice has an unknown number, or samples or a text break their rules"
        }
        _ => "its bytes do not follow the layout",
    }
}
