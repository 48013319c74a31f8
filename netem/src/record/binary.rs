//! The record in compact form: the heading, then for each packet a tag and numbers in LEB128.
//!
//! Times are differences: to the offer before, to the own offer, to the own due time.

use mmt_shared::time::Time;

use super::entry::{End, Entry, Heading};
use crate::direction::Direction;
use crate::packet::DropCause;
use crate::trace::TraceError;

/// How a record in binary begins.
pub const MAGIC: &[u8] = b"mmtnetem1\n";

const DOWN: u8 = 1;
const SENT: u8 = 0;
const UNSENT: u8 = 1;
/// The first of the drop causes, in the order of [`DropCause::ALL`].
const DROPPED: u8 = 2;
const COPY: u8 = 0x40;
const CORRUPTED: u8 = 0x80;

/// Writes a record, entry by entry.
#[derive(Clone, Debug, Default)]
pub struct Writer {
    offered: u64,
}

impl Writer {
    /// The bytes before the first packet: magic, seed, both links in words, each with its length.
    pub fn heading(&mut self, bytes: &mut Vec<u8>, heading: &Heading) {
        bytes.extend_from_slice(MAGIC);
        unsigned(bytes, heading.seed);
        for words in [&heading.up, &heading.down] {
            unsigned(bytes, words.len() as u64);
            bytes.extend_from_slice(words.as_bytes());
        }
    }

    /// Adds a packet to `bytes`.
    pub fn push(&mut self, bytes: &mut Vec<u8>, entry: &Entry) {
        let (kind, flags) = match entry.end {
            End::Sent {
                copy, corrupted, ..
            } => {
                let copy = if copy { COPY } else { 0 };
                (SENT, copy | if corrupted { CORRUPTED } else { 0 })
            }
            End::Unsent => (UNSENT, 0),
            End::Dropped(cause) => {
                let mut causes = DropCause::ALL.iter();
                let at = causes.position(|known| *known == cause).unwrap_or(0);
                (DROPPED + at as u8, 0)
            }
        };
        let direction = match entry.direction {
            Direction::Up => 0,
            Direction::Down => DOWN,
        };
        bytes.push(direction | kind << 1 | flags);
        unsigned(bytes, entry.number);
        let offered = entry.offered.as_nanos();
        signed(bytes, offered.wrapping_sub(self.offered).cast_signed());
        self.offered = offered;
        unsigned(bytes, entry.bytes.into());
        unsigned(bytes, entry.backlog.into());
        if let End::Sent { due, sent, .. } = entry.end {
            signed(bytes, due.as_nanos().wrapping_sub(offered).cast_signed());
            let late = sent.as_nanos().wrapping_sub(due.as_nanos());
            signed(bytes, late.cast_signed());
        }
    }
}

fn unsigned(bytes: &mut Vec<u8>, mut number: u64) {
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
}

/// Zigzag: small numbers of either sign are short.
fn signed(bytes: &mut Vec<u8>, number: i64) {
    unsigned(bytes, (number << 1 ^ number >> 63).cast_unsigned());
}

/// Reads a record.
///
/// # Errors
/// The number of the entry from 1 (0: the heading) in the place of the line, and the reason.
pub fn read(bytes: &[u8]) -> Result<(Heading, Vec<Entry>), TraceError> {
    let mut reader = Reader {
        rest: bytes.strip_prefix(MAGIC).unwrap_or_default(),
        offered: 0,
    };
    let heading = reader
        .heading()
        .ok_or_else(|| TraceError::at(0, "the heading of the record is cut off"))?;
    let mut entries = Vec::new();
    while !reader.rest.is_empty() {
        let entry = reader.entry();
        let wrong = || TraceError::at(entries.len() + 1, "the entry is cut off or none");
        entries.push(entry.ok_or_else(wrong)?);
    }
    Ok((heading, entries))
}

struct Reader<'a> {
    rest: &'a [u8],
    offered: u64,
}

impl Reader<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.rest.split_first()?;
        self.rest = rest;
        Some(*first)
    }

    fn unsigned(&mut self) -> Option<u64> {
        let mut number = 0_u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            let bits = u64::from(byte & 0x7f);
            if bits << shift >> shift != bits {
                return None;
            }
            number |= bits << shift;
            if byte & 0x80 == 0 {
                return Some(number);
            }
        }
        None
    }

    fn signed(&mut self) -> Option<i64> {
        let zigzag = self.unsigned()?;
        Some((zigzag >> 1).cast_signed() ^ -(zigzag & 1).cast_signed())
    }

    fn words(&mut self) -> Option<String> {
        let length = usize::try_from(self.unsigned()?).ok()?;
        let (words, rest) = self.rest.split_at_checked(length)?;
        self.rest = rest;
        String::from_utf8(words.to_owned()).ok()
    }

    fn heading(&mut self) -> Option<Heading> {
        Some(Heading {
            seed: self.unsigned()?,
            up: self.words()?,
            down: self.words()?,
        })
    }

    fn entry(&mut self) -> Option<Entry> {
        let tag = self.byte()?;
        let number = self.unsigned()?;
        let offered = self.offered.wrapping_add(self.signed()?.cast_unsigned());
        self.offered = offered;
        let bytes = u32::try_from(self.unsigned()?).ok()?;
        let backlog = u32::try_from(self.unsigned()?).ok()?;
        let end = match tag >> 1 & 0x1f {
            SENT => {
                let due = offered.wrapping_add(self.signed()?.cast_unsigned());
                let sent = due.wrapping_add(self.signed()?.cast_unsigned());
                End::Sent {
                    due: Time::from_nanos(due),
                    sent: Time::from_nanos(sent),
                    copy: tag & COPY != 0,
                    corrupted: tag & CORRUPTED != 0,
                }
            }
            UNSENT => End::Unsent,
            kind => {
                let cause = usize::from(kind - DROPPED);
                End::Dropped(DropCause::ALL.get(cause).copied()?)
            }
        };
        let direction = match tag & DOWN {
            0 => Direction::Up,
            _ => Direction::Down,
        };
        Some(Entry {
            direction,
            number,
            offered: Time::from_nanos(offered),
            bytes,
            backlog,
            end,
        })
    }
}
