//! The record of every packet: when it came, when it left or why it did not.
//!
//! Two forms, CSV for people and a compact binary one, hold the same and read back to the same. It
//! opens no file: text and bytes go in and out.

use mmt_shared::time::Time;
use serde::{Deserialize, Serialize};

use crate::link::{Direction, DropCause};
use crate::trace::TraceError;

pub mod binary;
pub mod csv;
pub mod summary;
#[cfg(test)]
mod tests;

/// What a record says of the run it is of.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Heading {
    /// The seed of both links.
    pub seed: u64,
    /// The link up, in words.
    pub up: String,
    /// The link down, in words.
    pub down: String,
}

/// One packet, or one copy of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Which way it went.
    pub direction: Direction,
    /// The how-manieth offer it was, from 0.
    pub number: u64,
    /// When it was offered, counted from the start of the record.
    pub offered: Time,
    /// Its length, bytes.
    pub bytes: u32,
    /// Packets in flight and waiting in this direction when it came.
    pub backlog: u32,
    /// What became of it.
    pub end: End,
}

/// What became of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It was sent on.
    Sent {
        /// When it was due by the settings.
        due: Time,
        /// When it really was sent; the difference is the lateness of the host.
        sent: Time,
        /// Whether it is a copy.
        copy: bool,
        /// Whether a bit of it was turned over.
        corrupted: bool,
    },
    /// The link dropped it.
    Dropped(DropCause),
    /// It came through the link, and the host could not send it.
    Unsent,
}

impl End {
    /// Fate and reason as the CSV spells them.
    fn words(&self) -> (&'static str, &'static str) {
        match self {
            Self::Sent {
                copy, corrupted, ..
            } => match (copy, corrupted) {
                (false, false) => ("sent", ""),
                (true, false) => ("copy", ""),
                (false, true) => ("sent", "corrupt"),
                (true, true) => ("copy", "corrupt"),
            },
            Self::Dropped(cause) => ("dropped", cause.name()),
            Self::Unsent => ("dropped", "socket"),
        }
    }

    fn from_words(fate: &str, reason: &str, due: Option<Time>, sent: Option<Time>) -> Option<Self> {
        if fate == "dropped" {
            if reason == "socket" {
                return Some(Self::Unsent);
            }
            let mut causes = DropCause::ALL.into_iter();
            return causes
                .find(|cause| cause.name() == reason)
                .map(Self::Dropped);
        }
        let copy = match fate {
            "sent" => false,
            "copy" => true,
            _ => return None,
        };
        let corrupted = match reason {
            "" => false,
            "corrupt" => true,
            _ => return None,
        };
        let (due, sent) = (due?, sent?);
        Some(Self::Sent {
            due,
            sent,
            copy,
            corrupted,
        })
    }
}

/// Reads a record of either form.
///
/// # Errors
/// Line (or, of the binary form, number of the entry) and reason.
pub fn read(bytes: &[u8]) -> Result<(Heading, Vec<Entry>), TraceError> {
    if bytes.starts_with(binary::MAGIC) {
        return binary::read(bytes);
    }
    let text = std::str::from_utf8(bytes)
        .map_err(|_| TraceError::at(1, "neither a record in text nor one in binary"))?;
    csv::read(text)
}

/// The text of a file that the words of a link name: a record in binary becomes the same record as CSV,
/// anything else stays as it is.
///
/// # Errors
/// Neither text nor a record.
pub fn as_text(bytes: Vec<u8>) -> Result<String, TraceError> {
    if !bytes.starts_with(binary::MAGIC) {
        let why = |_| TraceError::at(1, "neither text nor a record in binary");
        return String::from_utf8(bytes).map_err(why);
    }
    let (heading, entries) = binary::read(&bytes)?;
    let mut text = csv::heading(&heading);
    entries.iter().for_each(|entry| csv::push(&mut text, entry));
    Ok(text)
}
