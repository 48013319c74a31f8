//! Reads a record message by message; one that was cut off reads up to there.
//!
//! No length in the file is believed before the bytes are there: the parser of the MCAP crate makes room for as many as a text
//! announces, 4 GiB for a few bytes, so that what is needed of a channel and a message is taken out here.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
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
    /// A channel or a message is shorter than its own fields, or a topic is no text.
    #[error("it is no sound MCAP file: a {of} in it is malformed")]
    Malformed {
        /// Which of them.
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
    let options = LinearReaderOptions::default()
        .with_validate_chunk_crcs(true)
        .with_record_length_limit(length_max);
    let mut reader = LinearReader::new_with_options(options);
    let mut topics = BTreeMap::new();
    while let Some(event) = reader.next_event() {
        match event {
            Err(McapError::UnexpectedEof) => return Ok(Ended::CutOff),
            Err(error) => return Err(RecordError::from(error).into()),
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let read = file.read(reader.insert(wanted));
                reader.notify_read(read.map_err(RecordError::from)?);
            }
            Ok(LinearReadEvent::Record { opcode, data }) => match opcode {
                op::CHANNEL => {
                    let (id, topic) =
                        channel(data).ok_or(RecordError::Malformed { of: "channel" })?;
                    topics.insert(id, topic.to_owned());
                }
                op::MESSAGE => {
                    let (id, message) =
                        message(data).ok_or(RecordError::Malformed { of: "message" })?;
                    if let Some(topic) = topics.get(&id) {
                        each(topic, message)?;
                    }
                }
                _ => {}
            },
        }
    }
    Ok(Ended::Whole)
}

/// Number and topic of a channel; the number of its schema stands between them, the rest behind.
fn channel(record: &[u8]) -> Option<(u16, &str)> {
    let (id, rest) = record.split_first_chunk()?;
    let (_schema, rest) = rest.split_first_chunk::<2>()?;
    let (length, rest) = rest.split_first_chunk()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    let topic = std::str::from_utf8(rest.get(..length)?).ok()?;
    Some((u16::from_le_bytes(*id), topic))
}

/// The channel of a message and its bytes; its number and two times stand between them.
fn message(record: &[u8]) -> Option<(u16, &[u8])> {
    let (id, rest) = record.split_first_chunk()?;
    let (_numbers, message) = rest.split_first_chunk::<20>()?;
    Some((u16::from_le_bytes(*id), message))
}
