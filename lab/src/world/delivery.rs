//! What comes through of a world's datagrams, and who keeps them all.

use mmt_netem::{Departure, Direction};

use super::World;
use super::datagram::Datagram;
use super::packets::{WorldPacket, WorldPackets};

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
        self.packets = Some(Box::default());
        self
    }

    /// The datagrams in the order of sending; none where they are not kept.
    #[must_use]
    pub fn packets(&self) -> Vec<WorldPacket> {
        let packets = self.packets.as_ref();
        packets.map_or_else(Vec::new, |packets| packets.read())
    }

    /// The same, handed out; from now on none is kept.
    pub fn take_packets(&mut self) -> WorldPackets {
        let packets = self.packets.take();
        packets.map_or_else(WorldPackets::default, |packets| *packets)
    }
}
