//! Reads a record message by message; one that was cut off reads up to there.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError, parse_record};

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
    mut each: impl FnMut(&str, &[u8]) -> Result<(), E>,
) -> Result<Ended, E> {
    let mut file = File::open(path).map_err(RecordError::from)?;
    let options = LinearReaderOptions::default()
        .with_validate_chunk_crcs(true)
        .with_record_length_limit(LENGTH_MAX);
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
            Ok(LinearReadEvent::Record { opcode, data }) => {
                match parse_record(opcode, data).map_err(RecordError::from)? {
                    Record::Channel(channel) => {
                        topics.insert(channel.id, channel.topic);
                    }
                    Record::Message { header, data } => {
                        if let Some(topic) = topics.get(&header.channel_id) {
                            each(topic, &data)?;
                        }
                    }
                    _ => {}
                }
            }
        }
    }
    Ok(Ended::Whole)
}
