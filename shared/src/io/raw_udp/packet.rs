//! The packets of raw UDP: 5 bytes, then a message.
//!
//! A kind and the number of the connection, little endian. The kinds leave the second bit of the first byte clear,
//! which QUIC sets in every packet (RFC 9000, section 17): each side of a mix-up drops what the other sends.

/// What stands before every message, bytes.
pub const HEADER: usize = 5;
/// What a letter has beyond that, bytes: its number.
pub const NUMBER: usize = 4;
/// The longest packet, bytes of UDP payload: what every IPv6 path carries (RFC 8200, section 5), as in QUIC.
pub const PACKET_MAX: usize = 1200;

const DATAGRAM: u8 = 1;
const LETTER: u8 = 2;
const RECEIPT: u8 = 3;
const CLOSE: u8 = 4;

/// What a packet holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Body<'a> {
    /// A message that may be lost.
    Datagram(&'a [u8]),
    /// A message that is repeated until there is a receipt. Letter 0 opens the connection and holds the protocol's
    /// name.
    Letter {
        /// Counts up from 0 in each direction.
        number: u32,
        /// The message.
        message: &'a [u8],
    },
    /// The letter of that number has come, and so have all before it.
    Receipt {
        /// Whose.
        number: u32,
    },
    /// The connection is over.
    Close {
        /// Why, for the program: the codes of [`versions`](crate::io::versions).
        code: u8,
        /// Why, for people.
        reason: &'a [u8],
    },
}

/// A packet for a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet<'a> {
    /// The connection, numbered by the master.
    pub connection: u32,
    /// What it holds.
    pub body: Body<'a>,
}

impl<'a> Packet<'a> {
    /// Reads a packet; none if it is not one. Whatever the bytes, it does not fail otherwise.
    #[must_use]
    pub fn read(bytes: &'a [u8]) -> Option<Self> {
        let ([kind, connection @ ..], rest) = bytes.split_first_chunk::<HEADER>()?;
        let body = match *kind {
            DATAGRAM => Body::Datagram(rest),
            LETTER => {
                let (number, message) = rest.split_first_chunk::<NUMBER>()?;
                let number = u32::from_le_bytes(*number);
                Body::Letter { number, message }
            }
            RECEIPT => Body::Receipt {
                number: u32::from_le_bytes(rest.try_into().ok()?),
            },
            CLOSE => {
                let (code, reason) = rest.split_first()?;
                let code = *code;
                Body::Close { code, reason }
            }
            _ => return None,
        };
        let connection = u32::from_le_bytes(*connection);
        Some(Self { connection, body })
    }

    /// The packet's bytes, appended to `out`.
    pub fn write(&self, out: &mut Vec<u8>) {
        let head = |out: &mut Vec<u8>, kind: u8| {
            out.push(kind);
            out.extend_from_slice(&self.connection.to_le_bytes());
        };
        match self.body {
            Body::Datagram(message) => {
                head(out, DATAGRAM);
                out.extend_from_slice(message);
            }
            Body::Letter { number, message } => {
                head(out, LETTER);
                out.extend_from_slice(&number.to_le_bytes());
                out.extend_from_slice(message);
            }
            Body::Receipt { number } => {
                head(out, RECEIPT);
                out.extend_from_slice(&number.to_le_bytes());
            }
            Body::Close { code, reason } => {
                head(out, CLOSE);
                out.push(code);
                out.extend_from_slice(reason);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn written(packet: &Packet<'_>) -> Vec<u8> {
        let mut out = Vec::new();
        packet.write(&mut out);
        out
    }

    #[test]
    fn the_bytes_are_those_of_the_document() {
        let letter = Packet {
            connection: 0x0403_0201,
            body: Body::Letter {
                number: 7,
                message: b"hi",
            },
        };
        assert_eq!(written(&letter), b"\x02\x01\x02\x03\x04\x07\0\0\0hi");
        let datagram = Packet {
            connection: 1,
            body: Body::Datagram(b"x"),
        };
        assert_eq!(written(&datagram).len(), HEADER + 1);
    }

    #[test]
    fn no_packet_is_one_of_quic() {
        for kind in [DATAGRAM, LETTER, RECEIPT, CLOSE] {
            assert_eq!(kind & 0x40, 0);
        }
        // a QUIC packet with a short header, and one with a long one
        assert_eq!(Packet::read(&[0x40; 40]), None);
        assert_eq!(Packet::read(&[0xc0; 1200]), None);
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(
            connection: u32, number: u32, code: u8, kind in 0..4,
            message in prop::collection::vec(any::<u8>(), 0..50),
        ) {
            let body = match kind {
                0 => Body::Datagram(&message),
                1 => Body::Letter { number, message: &message },
                2 => Body::Receipt { number },
                _ => Body::Close { code, reason: &message },
            };
            let packet = Packet { connection, body };
            let bytes = written(&packet);
            prop_assert_eq!(Packet::read(&bytes), Some(packet));
        }

        #[test]
        fn what_is_read_is_written_the_same(bytes in prop::collection::vec(any::<u8>(), 0..50)) {
            if let Some(packet) = Packet::read(&bytes) {
                prop_assert_eq!(written(&packet), bytes);
            }
        }
    }
}
