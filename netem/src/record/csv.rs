//! The record as CSV: comment lines with the heading, names of columns, a line for each packet.

use std::fmt::Write;

use mmt_shared::time::Time;

use super::entry::{End, Entry, Heading, NO_LINE};
use crate::direction::Direction;
use crate::trace::TraceError;

/// The first line.
pub(super) const RECORD: &str = "# mmt netem record 1";
const COLUMNS: &str = "direction,number,offered_ns,due_ns,sent_ns,bytes,backlog,fate,reason";

/// The lines before the first packet.
#[must_use]
pub fn heading(heading: &Heading) -> String {
    format!(
        "{RECORD}\n# seed {}\n# up {}\n# down {}\n{COLUMNS}\n",
        heading.seed, heading.up, heading.down
    )
}

/// Adds the line of a packet to `text`.
pub fn push(text: &mut String, entry: &Entry) {
    let (fate, reason) = entry.end.words();
    let times = match entry.end {
        End::Sent { due, sent, .. } => format!("{},{}", due.as_nanos(), sent.as_nanos()),
        End::Dropped(_) | End::Unsent => ",".to_owned(),
    };
    // writing to a string does not fail
    let _ = writeln!(
        text,
        "{},{},{},{times},{},{},{fate},{reason}",
        entry.direction.name(),
        entry.number,
        entry.offered.as_nanos(),
        entry.bytes,
        entry.backlog,
    );
}

/// Reads a record.
///
/// # Errors
/// Line and reason.
pub fn read(text: &str) -> Result<(Heading, Vec<Entry>), TraceError> {
    let mut heading = Heading::default();
    let mut entries = Vec::new();
    let mut opened = false;
    for (at, line) in text.lines().enumerate() {
        let wrong = |what| TraceError::at(at + 1, what);
        if at == 0 {
            opened = line == RECORD;
        } else if let Some(comment) = line.strip_prefix("# ") {
            let (name, rest) = comment.split_once(' ').unwrap_or((comment, ""));
            match name {
                "seed" => {
                    heading.seed = rest.parse().map_err(|_| wrong("the seed is no number"))?;
                }
                "up" => rest.clone_into(&mut heading.up),
                "down" => rest.clone_into(&mut heading.down),
                _ => {}
            }
        } else if !line.is_empty() && line != COLUMNS {
            entries.push(entry(line).map_err(wrong)?);
        }
        if !opened {
            return Err(wrong("a record of mmt begins with: # mmt netem record 1"));
        }
    }
    if !opened {
        return Err(TraceError::at(1, "the file is empty"));
    }
    if !heading.is_of_lines() {
        return Err(TraceError::at(1, NO_LINE));
    }
    Ok((heading, entries))
}

fn entry(line: &str) -> Result<Entry, &'static str> {
    let fields: Vec<&str> = line.split(',').collect();
    let [
        direction,
        number,
        offered,
        due,
        sent,
        bytes,
        backlog,
        fate,
        reason,
    ] = fields.as_slice()
    else {
        return Err("expected nine fields");
    };
    let direction = match *direction {
        "up" => Direction::Up,
        "down" => Direction::Down,
        _ => return Err("the direction is up or down"),
    };
    let time = |text: &str| text.parse().ok().map(Time::from_nanos);
    let end = End::from_words(fate, reason, time(due), time(sent));
    Ok(Entry {
        direction,
        number: number.parse().map_err(|_| "the number is none")?,
        offered: time(offered).ok_or("offered_ns is no number")?,
        bytes: bytes.parse().map_err(|_| "bytes is no number")?,
        backlog: backlog.parse().map_err(|_| "backlog is no number")?,
        end: end.ok_or("fate, reason and times do not go together")?,
    })
}
