//! The digest of a run: whether two runs gave the same bits.
//!
//! FNV-1a of 64 bits (Fowler, Noll, Vo 1991) over the text of each tick, in which every number reads back to the same bits,
//! and over the bytes of each datagram that left. It shows a slip and is no proof against an adversary.

use std::fmt::{self, Debug, Write as _};

use crate::wire::DATAGRAM_MAX;

const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0100_0000_01b3;

/// What a run gave so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunDigest(u64);

impl Default for RunDigest {
    fn default() -> Self {
        Self(OFFSET)
    }
}

impl RunDigest {
    /// The digest so far.
    pub fn value(self) -> u64 {
        self.0
    }

    /// Adds what a tick gave.
    pub fn tick(&mut self, gave: &impl Debug) {
        // writing to it cannot fail
        let _ = write!(self, "{gave:?}");
    }

    /// Adds all datagrams that leave an end now, and returns them: `poll` writes the next one and returns its length.
    pub fn datagrams(&mut self, mut poll: impl FnMut(&mut [u8]) -> Option<usize>) -> Vec<Vec<u8>> {
        let (mut out, mut left) = ([0; DATAGRAM_MAX], Vec::new());
        while let Some(length) = poll(&mut out) {
            let datagram = out.get(..length).unwrap_or_default();
            self.datagram(datagram);
            left.push(datagram.to_vec());
        }
        left
    }

    /// Adds a datagram that left.
    pub fn datagram(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(PRIME);
        }
    }
}

impl fmt::Write for RunDigest {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.datagram(text.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_is_fnv_1a_and_sees_the_last_bit_of_a_number() {
        let of = |bytes: &[u8]| {
            let mut digest = RunDigest::default();
            digest.datagram(bytes);
            digest.value()
        };
        // the vector "foobar" of the FNV draft (draft-eastlake-fnv)
        assert_eq!(of(b"foobar"), 0x8594_4171_f739_67e8);
        let [mut a, mut b] = [RunDigest::default(); 2];
        a.tick(&Some(0.1_f64));
        b.tick(&Some(0.1_f64.next_up()));
        assert_ne!(a, b);
    }
}
