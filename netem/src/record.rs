//! The record of every packet: when it came, when it left or why it did not.
//!
//! Two forms, CSV for people and a compact binary one, hold the same and read back to the same. It
//! opens no file: text and bytes go in and out.

use crate::trace::TraceError;

pub mod binary;
pub mod csv;
mod entry;
pub mod summary;
#[cfg(test)]
mod tests;

pub use entry::{End, Entry, Heading};

/// Whether bytes begin as a record of either form does.
#[must_use]
pub fn is_record(head: &[u8]) -> bool {
    head.starts_with(binary::MAGIC) || head.starts_with(csv::RECORD.as_bytes())
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
