//! The types of messages, which of them may travel where, and the bounds of their lengths.

use serde::Serialize;

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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
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
    pub(super) const fn longest(self) -> usize {
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
    /// The slave accepts; down.
    Welcome = 17,
    /// The slave refuses; down.
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
}
