//! What both plugs have in common: the packets between mmt and a device or a plant of somebody else's, and who is plugged in.
//!
//! Pure. A packet is a head of 40 bytes and numbers, all little endian (`docs/plugs.md`). Whoever shows the token is plugged in
//! until it is silent; packets of anybody else are dropped and counted. Nothing of a packet is believed before its length,
//! its kind and its token are right.

use std::fmt;
use std::hint::black_box;
use std::net::SocketAddr;
use std::str::FromStr;
use std::time::Duration;

use crate::time::Time;

#[cfg(test)]
mod tests;

/// Bytes of the head.
pub const HEAD_BYTES: usize = 40;
/// Bytes of a packet between master and device: the head and six single-precision numbers.
pub const DEVICE_BYTES: usize = 64;
/// Bytes of a packet between slave and plant: the head and ten double-precision numbers.
pub const PLANT_BYTES: usize = 120;
/// The four bytes that a packet begins with.
const MAGIC: [u8; 4] = *b"MMTL";
/// The version of both protocols.
const VERSION: u8 = 1;
/// Bytes of the token: 128 bits.
const TOKEN_BYTES: usize = 16;

/// What a packet is, and who sends it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum PlugKind {
    /// Where the device is: device to master.
    Reading = 1,
    /// The force on the hand: master to device.
    Force = 2,
    /// Where the tool has to go: slave to plant.
    Tool = 3,
    /// What the plant measured: plant to slave.
    Answer = 4,
}

/// The secret that a device or a plant shows in each packet: 32 hexadecimal digits. `Debug` hides it.
#[derive(Clone, Copy, Eq)]
pub struct PlugToken([u8; TOKEN_BYTES]);

/// A text is no token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a token has 32 hexadecimal digits: copy it whole")]
pub struct NoToken;

impl PlugToken {
    /// A token of these bytes; they must come from the system's source of randomness.
    pub const fn new(bytes: [u8; TOKEN_BYTES]) -> Self {
        Self(bytes)
    }

    /// The digits: for whoever is to plug in.
    pub fn reveal(&self) -> impl fmt::Display {
        hex::encode(self.0)
    }
}

impl PartialEq for PlugToken {
    /// In a time that does not depend on where they differ.
    fn eq(&self, other: &Self) -> bool {
        let pairs = self.0.iter().zip(&other.0);
        black_box(pairs.fold(0, |bits, (a, b)| black_box(bits | (a ^ b)))) == 0
    }
}

impl fmt::Debug for PlugToken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("PlugToken(secret)")
    }
}

impl FromStr for PlugToken {
    type Err = NoToken;

    fn from_str(text: &str) -> Result<Self, NoToken> {
        let mut bytes = [0; TOKEN_BYTES];
        hex::decode_to_slice(text, &mut bytes).map_err(|_| NoToken)?;
        Ok(Self(bytes))
    }
}

/// The head of a packet without what is the same in all: magic, version, kind and token.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlugHead {
    /// Buttons of a device, states of the others: bits.
    pub flags: u16,
    /// Number of the packet; the sender adds 1 for each, and goes round after 2³² − 1.
    pub sequence: u32,
    /// The other side's newest packet when this one left; 0 before the first.
    pub answers: u32,
    /// When it left, ns, by the sender's own clock, which may begin anywhere.
    pub stamp_ns: u64,
}

/// Why a packet is dropped before anybody looks at its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotTaken {
    /// Another length, magic, version or kind.
    Malformed,
    /// Another token.
    Stranger,
}

/// Writes a packet of `BYTES` bytes; numbers that find no room are left out.
pub fn encode<const BYTES: usize, const N: usize>(
    kind: PlugKind,
    token: &PlugToken,
    head: &PlugHead,
    numbers: impl IntoIterator<Item = [u8; N]>,
) -> [u8; BYTES] {
    let mut packet = [0; BYTES];
    let [version, kind] = [VERSION, kind as u8];
    let parts: [&[u8]; 7] = [
        &MAGIC,
        &[version, kind],
        &head.flags.to_le_bytes(),
        &head.sequence.to_le_bytes(),
        &head.answers.to_le_bytes(),
        &head.stamp_ns.to_le_bytes(),
        &token.0,
    ];
    let bytes = parts.into_iter().flatten().copied();
    let bytes = bytes.chain(numbers.into_iter().flatten());
    for (place, byte) in packet.iter_mut().zip(bytes) {
        *place = byte;
    }
    packet
}

/// Reads a packet of this kind, length and token: its head and the bytes of its numbers.
///
/// # Errors
/// It is none.
pub fn decode<'a>(
    kind: PlugKind,
    length: usize,
    token: &PlugToken,
    packet: &'a [u8],
) -> Result<(PlugHead, &'a [u8]), NotTaken> {
    let Some((head, numbers)) = packet.split_first_chunk::<HEAD_BYTES>() else {
        return Err(NotTaken::Malformed);
    };
    let (about, rest) = head.split_at(8);
    let [m, a, g, i, version, of, low, high] = about else {
        return Err(NotTaken::Malformed);
    };
    let known = [*m, *a, *g, *i] == MAGIC && *version == VERSION && *of == kind as u8;
    if !known || packet.len() != length {
        return Err(NotTaken::Malformed);
    }
    let (sequence, rest) = four(rest);
    let (answers, rest) = four(rest);
    let (low_ns, rest) = four(rest);
    let (high_ns, shown) = four(rest);
    let shown = <[u8; TOKEN_BYTES]>::try_from(shown).map(PlugToken);
    if shown.ok().as_ref() != Some(token) {
        return Err(NotTaken::Stranger);
    }
    let head = PlugHead {
        flags: u16::from_le_bytes([*low, *high]),
        sequence,
        answers,
        stamp_ns: u64::from(high_ns) << 32 | u64::from(low_ns),
    };
    Ok((head, numbers))
}

/// A number of four bytes, and what follows; 0 where there are too few.
fn four(bytes: &[u8]) -> (u32, &[u8]) {
    match bytes.split_first_chunk::<4>() {
        Some((number, rest)) => (u32::from_le_bytes(*number), rest),
        None => (0, bytes),
    }
}

/// The single-precision numbers of a packet; 0 where there are too few.
pub fn singles<const N: usize>(bytes: &[u8]) -> [f64; N] {
    let (chunks, _) = bytes.as_chunks::<4>();
    let mut numbers = chunks.iter().map(|chunk| f32::from_le_bytes(*chunk).into());
    std::array::from_fn(|_| numbers.next().unwrap_or_default())
}

/// The double-precision numbers of a packet; 0 where there are too few.
pub fn doubles<const N: usize>(bytes: &[u8]) -> [f64; N] {
    let (chunks, _) = bytes.as_chunks::<8>();
    let mut numbers = chunks.iter().map(|chunk| f64::from_le_bytes(*chunk));
    std::array::from_fn(|_| numbers.next().unwrap_or_default())
}

/// What became of the packets of a plug.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlugCounts {
    /// Taken.
    pub taken: u64,
    /// Never came, by the gaps in the numbers.
    pub lost: u64,
    /// No newer than the newest.
    pub late: u64,
    /// Of another length, magic, version or kind.
    pub malformed: u64,
    /// With another token.
    pub stranger: u64,
    /// With the token, from another address than the one that is plugged in.
    pub second: u64,
    /// Numbers that cannot be, or a place where nobody may be.
    pub nonsense: u64,
}

impl PlugCounts {
    /// What was dropped or never came, by name.
    pub fn dropped(&self) -> [(&'static str, u64); 6] {
        [
            ("lost", self.lost),
            ("late", self.late),
            ("malformed", self.malformed),
            ("stranger", self.stranger),
            ("second", self.second),
            ("nonsense", self.nonsense),
        ]
    }
}

/// A packet of whoever is plugged in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Admitted {
    /// The first of somebody, or the first after a silence.
    First,
    /// One after another.
    Next,
}

/// Who is plugged in.
#[derive(Clone, Debug)]
pub struct PlugPeer {
    silence: Duration,
    newest: Option<(SocketAddr, u32, Time)>,
    /// What became of the packets.
    pub counts: PlugCounts,
}

impl PlugPeer {
    /// Nobody yet; who is silent for so long is plugged out.
    pub fn new(silence: Duration) -> Self {
        Self {
            silence,
            newest: None,
            counts: PlugCounts::default(),
        }
    }

    /// Counts a packet that was not taken.
    pub fn refuse(&mut self, why: NotTaken) {
        match why {
            NotTaken::Malformed => self.counts.malformed += 1,
            NotTaken::Stranger => self.counts.stranger += 1,
        }
    }

    /// Admits a packet with the token that came from there at `now`; none if it is late or a second one's.
    pub fn admit(&mut self, now: Time, from: SocketAddr, sequence: u32) -> Option<Admitted> {
        let (admitted, gap) = match self.newest.filter(|_| self.is_plugged_in(now)) {
            Some((address, _, _)) if address != from => {
                self.counts.second += 1;
                return None;
            }
            Some((_, newest, _)) => {
                // it goes round: less than half of all numbers ahead is newer
                let ahead = sequence.wrapping_sub(newest);
                if ahead == 0 || ahead > u32::MAX / 2 {
                    self.counts.late += 1;
                    return None;
                }
                (Admitted::Next, ahead - 1)
            }
            None => (Admitted::First, 0),
        };
        self.counts.lost += u64::from(gap);
        self.counts.taken += 1;
        self.newest = Some((from, sequence, now));
        Some(admitted)
    }

    /// Whether somebody is there at `now`.
    pub fn is_plugged_in(&self, now: Time) -> bool {
        self.newest
            .is_some_and(|(_, _, at)| now.saturating_since(at) < self.silence)
    }

    /// Where whoever is or was plugged in is to be found.
    pub fn address(&self) -> Option<SocketAddr> {
        self.newest.map(|(address, _, _)| address)
    }

    /// Number of the newest packet that was taken; 0 before the first.
    pub fn newest(&self) -> u32 {
        self.newest.map_or(0, |(_, sequence, _)| sequence)
    }
}
