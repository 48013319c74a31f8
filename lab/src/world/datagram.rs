//! A datagram on its way between the ends of a world.

use mmt_shared::wire::DATAGRAM_MAX;

/// Its bytes, and how many they are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Datagram {
    pub(super) bytes: [u8; DATAGRAM_MAX],
    pub(super) length: usize,
}

impl Datagram {
    pub(super) fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }
}
