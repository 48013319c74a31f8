//! What becomes of each datagram at one end, for a record.

use super::messages::{Packet, Stamp};
use crate::channel::peer::{Arrival, Peer};
use crate::time::Time;
use crate::wire::{Datagram, Message, Side};

/// Follows the datagrams of one session at one end.
#[derive(Clone, Debug)]
pub struct PacketWatch {
    side: Side,
    session: u32,
    peer: Peer,
    newest_update: u32,
}

impl PacketWatch {
    /// At the end of `side`, in this session of the record.
    pub fn new(side: Side, session: u32) -> Self {
        Self {
            side,
            session,
            peer: Peer::default(),
            newest_update: 0,
        }
    }

    /// A datagram that arrived at `at`.
    pub fn arrived(&mut self, stamp: Stamp, at: Time, bytes: &[u8]) -> Packet {
        let from = self.side.other();
        let decoded = Datagram::decode(bytes, from);
        let fate = match &decoded {
            Err(_) => "malformed",
            Ok(datagram) => match self.peer.handle(at, &datagram.envelope) {
                Arrival::Newest => "newest",
                Arrival::Reordered => "reordered",
                Arrival::Duplicate => "duplicate",
                Arrival::TooOld => "too_old",
                Arrival::Implausible => "implausible",
            },
        };
        self.packet(stamp, from, bytes, decoded.ok().as_ref(), fate)
    }

    /// A datagram that was handed to the network.
    pub fn sent(&mut self, stamp: Stamp, bytes: &[u8]) -> Packet {
        let decoded = Datagram::decode(bytes, self.side).ok();
        let mut fate = "sent";
        if let Some(Message::Update(update)) = decoded.as_ref().map(|of| &of.message) {
            if update.sequence <= self.newest_update {
                fate = "repeated";
            }
            self.newest_update = self.newest_update.max(update.sequence);
        }
        self.packet(stamp, self.side, bytes, decoded.as_ref(), fate)
    }

    fn packet(
        &self,
        stamp: Stamp,
        from: Side,
        bytes: &[u8],
        decoded: Option<&Datagram>,
        fate: &str,
    ) -> Packet {
        let update = decoded.and_then(|datagram| match &datagram.message {
            Message::Update(update) => Some((update.sequence, update.cause.name())),
            _ => None,
        });
        let (update, cause) = update.unwrap_or_default();
        let envelope = decoded.map(|datagram| datagram.envelope);
        let direction = match from {
            Side::Master => "up",
            Side::Slave => "down",
        };
        Packet {
            stamp,
            session: self.session,
            direction: direction.to_owned(),
            number: envelope.map_or(0, |envelope| envelope.number),
            sent_ns: envelope.map_or(0, |envelope| envelope.sent.as_nanos()),
            bytes: bytes.len() as u32,
            kind: decoded.map_or("", |of| kind(&of.message)).to_owned(),
            update,
            cause: cause.to_owned(),
            fate: fate.to_owned(),
        }
    }
}

fn kind(message: &Message) -> &'static str {
    match message {
        Message::Command(_) => "command",
        Message::Update(_) => "update",
        Message::Scene(_) => "scene",
        Message::Tool(_) => "tool",
        Message::Heartbeat => "heartbeat",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{DATAGRAM_MAX, Envelope, Flags};

    fn heartbeat(number: u32) -> Vec<u8> {
        let datagram = Datagram {
            flags: Flags::default(),
            envelope: Envelope {
                number,
                sent: Time::from_millis(3),
                echo: None,
            },
            message: Message::Heartbeat,
        };
        let mut out = [0; DATAGRAM_MAX];
        let length = datagram.encode(&mut out).unwrap();
        out.get(..length).unwrap().to_vec()
    }

    #[test]
    fn every_datagram_has_one_fate() {
        let mut watch = PacketWatch::new(Side::Slave, 1);
        let fates: Vec<String> = [1, 3, 2, 3]
            .iter()
            .map(|n| watch.arrived(Stamp(1), Time::from_millis(9), &heartbeat(*n)))
            .map(|packet| packet.fate)
            .collect();
        assert_eq!(fates, ["newest", "newest", "reordered", "duplicate"]);
        let junk = watch.arrived(Stamp(1), Time::ZERO, b"junk");
        assert_eq!((junk.fate.as_str(), junk.number), ("malformed", 0));
        let sent = watch.sent(Stamp(1), &heartbeat(4));
        assert_eq!((sent.direction.as_str(), sent.number), ("down", 4));
        assert_eq!((sent.kind.as_str(), sent.sent_ns), ("heartbeat", 3_000_000));
    }
}
