//! The record in compact form: magic and heading, then an entry for each packet, all in postcard.
//!
//! Times are differences: to the offer before, to the own offer, to the own due time.

use mmt_shared::time::Time;
use serde::Serialize;

use super::entry::{Entry, Heading, NO_LINE};
use crate::trace::TraceError;

/// How a record in binary begins, of any version.
pub const MAGIC: &[u8] = b"mmtnetem";
/// What follows in this version.
const VERSION: &[u8] = b"2\n";

/// Writes a record, entry by entry.
#[derive(Clone, Debug, Default)]
pub struct Writer {
    offered: Time,
}

impl Writer {
    /// The bytes before the first packet.
    pub fn heading(&mut self, bytes: &mut Vec<u8>, heading: &Heading) {
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(VERSION);
        add(bytes, heading);
    }

    /// Adds a packet to `bytes`.
    pub fn push(&mut self, bytes: &mut Vec<u8>, entry: &Entry) {
        // nanoseconds since the offer before, since the offer, and since the due time
        let offered = difference(entry.offered, self.offered);
        let row = entry.with_times(offered, |due, sent| {
            (difference(due, entry.offered), difference(sent, due))
        });
        self.offered = entry.offered;
        add(bytes, &row);
    }
}

fn add(bytes: &mut Vec<u8>, value: &impl Serialize) {
    // writing these to memory does not fail
    if let Ok(written) = postcard::to_extend(value, std::mem::take(bytes)) {
        *bytes = written;
    }
}

fn difference(time: Time, from: Time) -> i64 {
    time.as_nanos().wrapping_sub(from.as_nanos()).cast_signed()
}

fn later(from: Time, nanos: i64) -> Time {
    Time::from_nanos(from.as_nanos().wrapping_add(nanos.cast_unsigned()))
}

/// Reads a record.
///
/// # Errors
/// The number of the entry from 1 (0: the heading) in the place of the line, and the reason.
pub fn read(bytes: &[u8]) -> Result<(Heading, Vec<Entry>), TraceError> {
    let rest = bytes.strip_prefix(MAGIC).unwrap_or_default();
    let rest = rest.strip_prefix(VERSION).ok_or_else(|| {
        TraceError::at(0, "a record of another version: this mmt reads version 2")
    })?;
    let (heading, mut rest): (Heading, _) = postcard::take_from_bytes(rest)
        .map_err(|_| TraceError::at(0, "the heading of the record is cut off"))?;
    if !heading.is_of_lines() {
        return Err(TraceError::at(0, NO_LINE));
    }
    let mut entries = Vec::new();
    let mut offered = Time::ZERO;
    while !rest.is_empty() {
        let wrong = |_| TraceError::at(entries.len() + 1, "the entry is cut off or none");
        let (row, after): (Entry<i64>, _) = postcard::take_from_bytes(rest).map_err(wrong)?;
        (rest, offered) = (after, later(offered, row.offered));
        entries.push(row.with_times(offered, |due, late| {
            let due = later(offered, due);
            (due, later(due, late))
        }));
    }
    Ok((heading, entries))
}
