//! Every datagram of a world, what it carries and what became of it; kept where somebody asks for it.

use mmt_netem::record::{End, Entry};
use mmt_netem::{Departure, Direction};
use mmt_shared::record::messages::{Packet, Stamp};
use mmt_shared::record::packet::PacketWatch;
use mmt_shared::time::Time;
use mmt_shared::wire::Side;

use super::datagram::Datagram;

/// A datagram that an end handed to the network.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldPacket {
    /// Its content; the stamp is 0, and the fate that of the sender: `sent` or `repeated`.
    pub packet: Packet,
    /// When it was handed over, since the start.
    pub sent: Time,
    /// What the network did with it, of its copies with the first that came through; none while it is under way.
    pub end: Option<End>,
}

/// The datagrams in the order of sending, as they were: nobody reads them before they are asked for.
#[derive(Debug, Default)]
pub struct WorldPackets {
    kept: Vec<Kept>,
    /// Their bytes, one after the other.
    bytes: Vec<u8>,
    /// Of each direction the places of its datagrams, by the number of the offer.
    places: [Vec<usize>; 2],
}

/// A datagram as it was.
#[derive(Debug)]
struct Kept {
    direction: Direction,
    sent: Time,
    length: usize,
    end: Option<End>,
}

impl WorldPackets {
    /// Each with its content.
    #[must_use]
    pub fn read(&self) -> Vec<WorldPacket> {
        let [mut up, mut down] = [Side::Master, Side::Slave].map(|side| PacketWatch::new(side, 1));
        let mut rest = self.bytes.as_slice();
        let kept = self.kept.iter().map(|kept| {
            let (bytes, behind) = rest.split_at_checked(kept.length).unwrap_or_default();
            rest = behind;
            let watch = match kept.direction {
                Direction::Up => &mut up,
                Direction::Down => &mut down,
            };
            WorldPacket {
                packet: watch.sent(Stamp::default(), bytes),
                sent: kept.sent,
                end: kept.end,
            }
        });
        kept.collect()
    }

    /// An end hands over a datagram.
    pub(super) fn left(&mut self, direction: Direction, now: Time, bytes: &[u8]) {
        let [ups, downs] = &mut self.places;
        let places = match direction {
            Direction::Up => ups,
            Direction::Down => downs,
        };
        places.push(self.kept.len());
        self.bytes.extend_from_slice(bytes);
        self.kept.push(Kept {
            direction,
            sent: now,
            length: bytes.len(),
            end: None,
        });
    }

    /// The network is done with it.
    pub(super) fn ended(&mut self, direction: Direction, departure: &Departure<Datagram>) {
        let [ups, downs] = &self.places;
        let places = match direction {
            Direction::Up => ups,
            Direction::Down => downs,
        };
        let number = usize::try_from(departure.number).unwrap_or(usize::MAX);
        let place = places.get(number).copied();
        if let Some(packet) = place.and_then(|place| self.kept.get_mut(place)) {
            // of an offer that was lost a copy may still come
            if !matches!(packet.end, Some(End::Sent { .. })) {
                packet.end = Some(Entry::of(direction, departure).end);
            }
        }
    }
}
