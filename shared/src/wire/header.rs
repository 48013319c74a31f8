//! The fixed 8-byte header: magic (4 bytes), version (1), type (1), flags (2, little endian).
//!
//! The places of magic and version never change, so that every version can name every other. Holds no body.

use super::error::DecodeError;
use super::flags::Flags;
use super::kind::{Channel, HEADER_BYTES, Kind, MAGIC, PROTOCOL_VERSION, Side};

/// The header of a message of this type with these flags: datagrams alone have any.
pub(super) const fn header(kind: Kind, flags: Flags) -> [u8; HEADER_BYTES] {
    let [m, t, u, v] = MAGIC;
    let [low, high] = flags.to_bits().to_le_bytes();
    [m, t, u, v, PROTOCOL_VERSION, kind.number(), low, high]
}

/// Reads a header that came from `from` on `channel`; returns the type, the flags and the body.
pub(super) fn open(
    message: &[u8],
    from: Side,
    channel: Channel,
) -> Result<(Kind, Flags, &[u8]), DecodeError> {
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
    let bits = u16::from_le_bytes([low, high]);
    let on_datagrams = |_: &Flags| bits == 0 || kind.channel() == Channel::Datagram;
    let of_sender = |flags: &Flags| from == Side::Slave || flags.are_a_masters();
    let flags = Flags::from_bits(bits)
        .filter(on_datagrams)
        .filter(of_sender)
        .ok_or(DecodeError::Flags { kind, flags: bits })?;
    if kind.channel() != channel {
        return Err(DecodeError::WrongChannel { kind });
    }
    if !kind.is_sent_by(from) {
        return Err(DecodeError::WrongDirection { kind, from });
    }
    Ok((kind, flags, body))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::ToolState;
    use crate::wire::kind::ALPN;

    #[test]
    fn header_is_readable_by_eye() {
        assert_eq!(
            &header(Kind::Welcome, Flags::default()),
            b"MMTP\x03\x11\x00\x00"
        );
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
            let bytes = header(kind, Flags::default());
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
        let opened = open(b"MMTP\x03\x01\x01\0", Side::Master, Channel::Datagram);
        let stopped = Flags {
            stopped: true,
            ..Flags::default()
        };
        assert_eq!(opened, Ok((kind, stopped, &[][..])));
        // a master has no tool
        let flags = 2;
        assert_eq!(
            read(b"MMTP\x03\x01\x02\0"),
            DecodeError::Flags { kind, flags }
        );
        let opened = open(b"MMTP\x03\x04\x0a\0", Side::Slave, Channel::Datagram);
        let (_, flags, _) = opened.unwrap();
        assert_eq!((flags.tool, flags.energy_holds), (ToolState::Hold, true));
        let on_stream = open(b"MMTP\x03\x10\x01\0", Side::Master, Channel::Stream);
        let (kind, flags) = (Kind::Hello, 1);
        assert_eq!(on_stream, Err(DecodeError::Flags { kind, flags }));
    }
}
