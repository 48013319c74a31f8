//! Reads a record message by message; one that was cut off reads up to there.
//!
//! Of MCAP it reads what a record has: chunks without compression, channels, messages (mcap.dev/spec). No length in the file is
//! believed before the bytes are there, and none leads out of what it stands in. The reader of the MCAP crate does not bear a
//! hostile file: for a text it makes room for as many bytes as the file announces, up to 4 GiB, and a record that is longer than
//! its chunk overflows.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use mcap::records::op;
use mcap::{MAGIC, McapError};

use crate::record::cdr::CdrError;

/// No chunk or message of ours is longer, bytes.
const LENGTH_MAX: usize = 64 << 20;

/// How a record ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// With its own end.
    Whole,
    /// In the middle: the writer was killed, or the disk was full.
    CutOff,
}

/// Why a record cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be read.
    #[error("cannot read it: {0}")]
    Io(#[from] io::Error),
    /// It is no MCAP file, or a broken one.
    #[error("it is no sound MCAP file: {0}")]
    Mcap(#[from] McapError),
    /// A part is shorter than its own fields or longer than what it stands in, or a text is none.
    #[error("it is no sound MCAP file: a {of} in it is malformed")]
    Malformed {
        /// What sort of part.
        of: &'static str,
    },
    /// A message of it is broken.
    #[error("a message on {topic} is broken: {why}")]
    Message {
        /// Where.
        topic: String,
        /// Why.
        why: CdrError,
    },
}

/// Whether a file begins as a record does.
///
/// # Errors
/// It cannot be read.
pub fn is_record(path: &Path) -> io::Result<bool> {
    let mut begin = Vec::new();
    let length = MAGIC.len() as u64;
    File::open(path)?.take(length).read_to_end(&mut begin)?;
    Ok(begin == MAGIC)
}

/// Hands over each message with its topic, in the order in which they were written. The first error of `each` ends it.
///
/// # Errors
/// The file cannot be read or is no record; or what `each` fails of.
pub fn read<E: From<RecordError>>(
    path: &Path,
    each: impl FnMut(&str, &[u8]) -> Result<(), E>,
) -> Result<Ended, E> {
    let file = File::open(path).map_err(RecordError::from)?;
    read_from(file, LENGTH_MAX, each)
}

/// The same of a record that comes from wherever; one with a chunk or message of more than `length_max` bytes is none.
///
/// # Errors
/// As [`read`].
pub fn read_from<E: From<RecordError>>(
    mut file: impl Read,
    length_max: usize,
    mut each: impl FnMut(&str, &[u8]) -> Result<(), E>,
) -> Result<Ended, E> {
    let mut topics = Topics::new();
    let mut part = Vec::new();
    if !fill(&mut file, MAGIC.len(), &mut part)? {
        return Ok(Ended::CutOff);
    }
    if part != MAGIC {
        return Err(RecordError::Mcap(McapError::BadMagic).into());
    }
    loop {
        if !fill(&mut file, HEAD, &mut part)? {
            return Ok(Ended::CutOff);
        }
        let Some(((opcode, length), _)) = head(&part) else {
            return Ok(Ended::CutOff);
        };
        let Some(room) = usize::try_from(length).ok().filter(|n| *n <= length_max) else {
            let long = McapError::RecordTooLarge {
                opcode,
                len: length,
            };
            return Err(RecordError::Mcap(long).into());
        };
        let whole = fill(&mut file, room, &mut part)?;
        match opcode {
            op::CHUNK => {
                let records = chunk(&part, whole)?;
                records_in(records, whole, |opcode, record| {
                    topics.take(opcode, record, &mut each)
                })?;
            }
            _ if !whole => {}
            _ => topics.take(opcode, &part, &mut each)?,
        }
        if !whole {
            return Ok(Ended::CutOff);
        }
        if opcode == op::FOOTER {
            let whole = fill(&mut file, MAGIC.len(), &mut part)?;
            return Ok(if whole { Ended::Whole } else { Ended::CutOff });
        }
    }
}

/// What stands before each record: its kind and its length.
const HEAD: usize = 9;

/// Reads so many bytes, or as many as there are; whether all were there.
fn fill(file: &mut impl Read, length: usize, part: &mut Vec<u8>) -> Result<bool, RecordError> {
    part.clear();
    // grows as bytes come
    file.take(length as u64).read_to_end(part)?;
    Ok(part.len() == length)
}

/// Kind and length of a record, and what follows its head.
fn head(bytes: &[u8]) -> Option<((u8, u64), &[u8])> {
    let ([opcode, length @ ..], rest) = bytes.split_first_chunk::<HEAD>()?;
    Some(((*opcode, u64::from_le_bytes(*length)), rest))
}

/// The records of a chunk, checked; of one that is cut off those bytes that are there.
fn chunk(part: &[u8], whole: bool) -> Result<&[u8], RecordError> {
    let malformed = || RecordError::Malformed { of: "chunk" };
    let Some(fields) = ChunkFields::of(part) else {
        return if whole { Err(malformed()) } else { Ok(&[]) };
    };
    let ChunkFields {
        crc,
        compression,
        length,
        records,
    } = fields;
    if !compression.is_empty() {
        let name = String::from_utf8_lossy(compression).into_owned();
        return Err(McapError::UnsupportedCompression(name).into());
    }
    let length = usize::try_from(length).map_err(|_| malformed())?;
    let Some(records) = records.get(..length) else {
        return if whole { Err(malformed()) } else { Ok(records) };
    };
    let calculated = crc32fast::hash(records);
    if crc != 0 && crc != calculated {
        let saved = crc;
        return Err(McapError::BadChunkCrc { saved, calculated }.into());
    }
    Ok(records)
}

/// The fields of a chunk.
struct ChunkFields<'a> {
    crc: u32,
    compression: &'a [u8],
    /// Of the records as they stand in the file, bytes.
    length: u64,
    /// These, and whatever may follow.
    records: &'a [u8],
}

impl<'a> ChunkFields<'a> {
    /// Two times and the length without compression stand in front.
    fn of(part: &'a [u8]) -> Option<Self> {
        let (_times_and_length, rest) = part.split_first_chunk::<24>()?;
        let (crc, rest) = rest.split_first_chunk()?;
        let (compression, rest) = text(rest)?;
        let (length, records) = rest.split_first_chunk()?;
        Some(Self {
            crc: u32::from_le_bytes(*crc),
            compression,
            length: u64::from_le_bytes(*length),
            records,
        })
    }
}

/// Hands over each record of a chunk.
fn records_in<E: From<RecordError>>(
    mut records: &[u8],
    whole: bool,
    mut each: impl FnMut(u8, &[u8]) -> Result<(), E>,
) -> Result<(), E> {
    while !records.is_empty() {
        let split = head(records).and_then(|((opcode, length), rest)| {
            let length = usize::try_from(length).ok()?;
            Some((opcode, rest.split_at_checked(length)?))
        });
        match split {
            Some((opcode, (record, rest))) => {
                each(opcode, record)?;
                records = rest;
            }
            // where the file ends
            None if !whole => return Ok(()),
            None => return Err(RecordError::Malformed { of: "chunk" }.into()),
        }
    }
    Ok(())
}

/// A text and what follows it.
fn text(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk()?;
    rest.split_at_checked(usize::try_from(u32::from_le_bytes(*length)).ok()?)
}

/// The topics of the channels so far.
struct Topics(BTreeMap<u16, String>);

impl Topics {
    fn new() -> Self {
        Self(BTreeMap::new())
    }

    /// Takes note of a channel, and hands over a message.
    fn take<E: From<RecordError>>(
        &mut self,
        opcode: u8,
        record: &[u8],
        each: &mut impl FnMut(&str, &[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        match opcode {
            op::CHANNEL => {
                let channel = channel(record);
                let (id, topic) = channel.ok_or(RecordError::Malformed { of: "channel" })?;
                self.0.insert(id, topic.to_owned());
            }
            op::MESSAGE => {
                let message = message(record);
                let (id, message) = message.ok_or(RecordError::Malformed { of: "message" })?;
                if let Some(topic) = self.0.get(&id) {
                    each(topic, message)?;
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// Number and topic of a channel; the number of its schema stands between them, the rest behind.
fn channel(record: &[u8]) -> Option<(u16, &str)> {
    let (id, rest) = record.split_first_chunk()?;
    let (_schema, rest) = rest.split_first_chunk::<2>()?;
    let (topic, _) = text(rest)?;
    Some((u16::from_le_bytes(*id), std::str::from_utf8(topic).ok()?))
}

/// The channel of a message and its bytes; its number and two times stand between them.
fn message(record: &[u8]) -> Option<(u16, &[u8])> {
    let (id, rest) = record.split_first_chunk()?;
    let (_numbers, message) = rest.split_first_chunk::<20>()?;
    Some((u16::from_le_bytes(*id), message))
}
