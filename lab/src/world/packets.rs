//! Every datagram of a world, what it carries and what became of it; kept where somebody asks for it.

use mmt_netem::record::{End, Entry};
use mmt_netem::{Departure, Direction};
use mmt_shared::record::messages::{Packet, Stamp};
use mmt_shared::record::packet::PacketWatch;
use mmt_shared::time::Time;
use mmt_shared::wire::Side;

use super::World;
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

/// The datagrams in the order of sending.
#[derive(Debug)]
pub(super) struct Packets {
    watches: [PacketWatch; 2],
    packets: Vec<WorldPacket>,
    /// Of each direction the places of its datagrams, by the number of the offer.
    places: [Vec<usize>; 2],
}

impl Packets {
    fn new() -> Self {
        Self {
            watches: [Side::Master, Side::Slave].map(|side| PacketWatch::new(side, 1)),
            packets: Vec::new(),
            places: [Vec::new(), Vec::new()],
        }
    }

    /// An end hands over a datagram.
    pub(super) fn left(&mut self, direction: Direction, now: Time, bytes: &[u8]) {
        let ([up, down], [ups, downs]) = (&mut self.watches, &mut self.places);
        let (watch, places) = match direction {
            Direction::Up => (up, ups),
            Direction::Down => (down, downs),
        };
        places.push(self.packets.len());
        self.packets.push(WorldPacket {
            packet: watch.sent(Stamp::default(), bytes),
            sent: now,
            end: None,
        });
    }

    /// The network is done with it.
    fn ended(&mut self, direction: Direction, departure: &Departure<Datagram>) {
        let [ups, downs] = &self.places;
        let places = match direction {
            Direction::Up => ups,
            Direction::Down => downs,
        };
        let number = usize::try_from(departure.number).unwrap_or(usize::MAX);
        let place = places.get(number).copied();
        if let Some(packet) = place.and_then(|place| self.packets.get_mut(place)) {
            // of an offer that was lost a copy may still come
            if !matches!(packet.end, Some(End::Sent { .. })) {
                packet.end = Some(Entry::of(direction, departure).end);
            }
        }
    }
}

impl World {
    /// What comes through next in a direction by now; what is dropped before it is noted.
    pub(super) fn next(&mut self, direction: Direction) -> Option<Departure<Datagram>> {
        let link = match direction {
            Direction::Up => &mut self.up,
            Direction::Down => &mut self.down,
        };
        while let Some(departure) = link.poll(self.now) {
            if let Some(packets) = &mut self.packets {
                packets.ended(direction, &departure);
            }
            if departure.is_delivered() {
                return Some(departure);
            }
        }
        None
    }

    /// The same, keeping every datagram from now on.
    #[must_use]
    pub fn with_packets(mut self) -> Self {
        self.packets = Some(Box::new(Packets::new()));
        self
    }

    /// The datagrams in the order of sending; none where they are not kept.
    #[must_use]
    pub fn packets(&self) -> &[WorldPacket] {
        let packets = self.packets.as_ref();
        packets.map_or(&[], |packets| &packets.packets)
    }

    /// The same, handed out; from now on none is kept.
    pub fn take_packets(&mut self) -> Vec<WorldPacket> {
        let packets = self.packets.take();
        packets.map_or_else(Vec::new, |packets| packets.packets)
    }
}
