//! The fixed 8-byte header, and which message may travel where.
//!
//! Layout: magic (4 bytes), version (1), type (1), flags (2, little endian). The places of magic and
//! version never change, so that every version can name every other. Holds no body.

use super::error::DecodeError;

/// The first four bytes of every message: ASCII `MMTP`.
pub const MAGIC: [u8; 4] = *b"MMTP";

/// The version of the protocol that this code speaks.
pub const PROTOCOL_VERSION: u8 = 3;

/// The protocol's name in the TLS handshake (ALPN, RFC 7301); it carries the version.
pub const ALPN: &str = "mmt/3";

/// Length of the header, bytes.
pub const HEADER_BYTES: usize = 8;

/// The longest datagram message, header included, bytes: fits QUIC's least path with room to spare.
pub const DATAGRAM_MAX: usize = 1024;

/// The longest stream message, header included and length prefix excluded, bytes: a bound for readers.
pub const STREAM_MESSAGE_MAX: usize = 4096;

/// One of the two ends of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The operator's end: opens the connection and the stream. It sends "up".
    Master,
    /// The robot's end. It sends "down".
    Slave,
}

impl Side {
    /// The name used in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Master => "master",
            Self::Slave => "slave",
        }
    }

    /// The end across.
    pub const fn other(self) -> Self {
        match self {
            Self::Master => Self::Slave,
            Self::Slave => Self::Master,
        }
    }
}

/// The two roads of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// QUIC datagrams (RFC 9221): may be lost, reordered, duplicated.
    Datagram,
    /// The one bidirectional stream: in order, complete.
    Stream,
}

impl Channel {
    /// The longest message on it, header included, bytes.
    const fn longest(self) -> usize {
        match self {
            Self::Datagram => DATAGRAM_MAX,
            Self::Stream => STREAM_MESSAGE_MAX,
        }
    }
}

/// The type of a message, with its number on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Kind {
    /// HIP samples and the newest update accepted; up.
    Command = 1,
    /// The whole state of the model; down.
    Update = 2,
    /// What a viewer sees; down.
    Scene = 3,
    /// A sign of life; both ways.
    Heartbeat = 4,
    /// What the tool feels, where the hand feels it too; down.
    Tool = 5,
    /// First message on the stream; up.
    Hello = 16,
    /// The slave's yes; down.
    Welcome = 17,
    /// The slave's no; down.
    Refused = 18,
    /// The last message of a side, with its report; both ways.
    Farewell = 19,
}

impl Kind {
    /// All types, in the order of their numbers.
    pub const ALL: [Self; 9] = [
        Self::Command,
        Self::Update,
        Self::Scene,
        Self::Heartbeat,
        Self::Tool,
        Self::Hello,
        Self::Welcome,
        Self::Refused,
        Self::Farewell,
    ];

    /// The number in the header.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The type with this number.
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.number() == number)
    }

    /// The name used in messages and golden vectors.
    pub const fn name(self) -> &'static str {
        self.properties().0
    }

    /// The road that it travels.
    pub const fn channel(self) -> Channel {
        self.properties().1
    }

    /// Whether `side` may send it.
    pub fn is_sent_by(self, side: Side) -> bool {
        self.properties().2.is_none_or(|sender| sender == side)
    }

    /// Name, road and sender; no sender where both sides send it.
    const fn properties(self) -> (&'static str, Channel, Option<Side>) {
        use Channel::{Datagram, Stream};
        const UP: Option<Side> = Some(Side::Master);
        const DOWN: Option<Side> = Some(Side::Slave);
        match self {
            Self::Command => ("command", Datagram, UP),
            Self::Update => ("update", Datagram, DOWN),
            Self::Scene => ("scene", Datagram, DOWN),
            Self::Heartbeat => ("heartbeat", Datagram, None),
            Self::Tool => ("tool", Datagram, DOWN),
            Self::Hello => ("hello", Stream, UP),
            Self::Welcome => ("welcome", Stream, DOWN),
            Self::Refused => ("refused", Stream, DOWN),
            Self::Farewell => ("farewell", Stream, None),
        }
    }
}

/// The header of a message of this type. The flags are all zero in this version.
pub(super) const fn header(kind: Kind) -> [u8; HEADER_BYTES] {
    let [m, t, u, v] = MAGIC;
    [m, t, u, v, PROTOCOL_VERSION, kind.number(), 0, 0]
}

/// Reads a header that came from `from` on `channel`; returns the type and the body.
pub(super) fn open(
    message: &[u8],
    from: Side,
    channel: Channel,
) -> Result<(Kind, &[u8]), DecodeError> {
    let length = message.len();
    if length > channel.longest() {
        return Err(DecodeError::TooLong { length });
    }
    let Some((&[m, t, u, v, theirs, number, low, high], body)) =
        message.split_first_chunk::<HEADER_BYTES>()
    else {
        return Err(DecodeError::TooShort { length });
    };
    if [m, t, u, v] != MAGIC {
        return Err(DecodeError::NotOurs);
    }
    if theirs != PROTOCOL_VERSION {
        return Err(DecodeError::OtherVersion { theirs });
    }
    let kind = Kind::from_number(number).ok_or(DecodeError::UnknownType { number })?;
    let flags = u16::from_le_bytes([low, high]);
    if flags != 0 {
        return Err(DecodeError::Flags { kind, flags });
    }
    if kind.channel() != channel {
        return Err(DecodeError::WrongChannel { kind });
    }
    if !kind.is_sent_by(from) {
        return Err(DecodeError::WrongDirection { kind, from });
    }
    Ok((kind, body))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_types_are_pinned() {
        let numbers = Kind::ALL.map(Kind::number);
        assert_eq!(numbers, [1, 2, 3, 4, 5, 16, 17, 18, 19]);
        for number in 0..=u8::MAX {
            let kind = Kind::from_number(number);
            assert_eq!(kind.is_some(), numbers.contains(&number));
            assert!(kind.is_none_or(|kind| kind.number() == number));
        }
    }

    #[test]
    fn header_is_readable_by_eye() {
        assert_eq!(&header(Kind::Welcome), b"MMTP\x03\x11\x00\x00");
        assert!(ALPN.ends_with(&PROTOCOL_VERSION.to_string()));
    }

    #[test]
    fn another_version_is_named_beside_ours_even_if_all_else_differs() {
        for theirs in [2, 7] {
            let message = [b'M', b'M', b'T', b'P', theirs, 0xff, 0xff, 0xff];
            let error = open(&message, Side::Master, Channel::Stream).unwrap_err();
            assert_eq!(error, DecodeError::OtherVersion { theirs });
            let text = error.to_string();
            let named = format!("version {theirs}");
            assert!(
                text.contains(&named) && text.contains("version 3"),
                "{text}"
            );
        }
    }

    #[test]
    fn each_type_is_taken_on_its_own_road_and_in_its_own_direction_only() {
        for kind in Kind::ALL {
            let bytes = header(kind);
            for from in [Side::Master, Side::Slave] {
                for channel in [Channel::Datagram, Channel::Stream] {
                    let opened = open(&bytes, from, channel);
                    let allowed = kind.channel() == channel && kind.is_sent_by(from);
                    assert_eq!(opened.is_ok(), allowed, "{kind:?} {from:?} {channel:?}");
                }
            }
        }
    }

    #[test]
    fn flags_short_headers_foreign_magic_and_unknown_types_are_refused() {
        let read = |bytes: &[u8]| open(bytes, Side::Master, Channel::Datagram).unwrap_err();
        let length = 7;
        assert_eq!(read(b"MMTP\x03\x01\0"), DecodeError::TooShort { length });
        assert_eq!(read(b"MMTQ\x03\x01\0\0"), DecodeError::NotOurs);
        let number = 99;
        assert_eq!(
            read(b"MMTP\x03\x63\0\0"),
            DecodeError::UnknownType { number }
        );
        let (kind, flags) = (Kind::Command, 0x0100);
        assert_eq!(
            read(b"MMTP\x03\x01\0\x01"),
            DecodeError::Flags { kind, flags }
        );
    }
}
