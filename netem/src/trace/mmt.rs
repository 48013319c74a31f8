//! The texts of mmt itself: a record of packets, or the path that somebody measured.

use std::fmt::Write;
use std::time::Duration;

use mmt_shared::time::Time;

use super::{Sample, TraceError, meaningful_lines};
use crate::direction::Direction;
use crate::record::{End, Entry, csv};

/// How either begins.
pub(super) const OPENING: &str = "# mmt netem ";
const PATH: &str = "# mmt netem path 1";
const COLUMNS: &str = "at_ns,delay_ns";

/// Reads either; of a record one direction: what every packet met.
///
/// # Errors
/// Line and reason.
pub(super) fn parse(text: &str, direction: Direction) -> Result<Vec<Sample>, TraceError> {
    if text.lines().next() == Some(PATH) {
        return recorded_path(text);
    }
    let (_, entries) = csv::read(text)?;
    let mine = entries.iter().filter(|entry| entry.direction == direction);
    let originals = mine.filter(|entry| !matches!(entry.end, End::Sent { copy: true, .. }));
    let sample = |entry: &Entry| Sample {
        at: entry.offered.saturating_since(Time::ZERO),
        delay: match entry.end {
            End::Sent { sent, .. } => Some(sent.saturating_since(entry.offered)),
            End::Dropped(_) | End::Unsent => None,
        },
    };
    Ok(originals.map(sample).collect())
}

/// Whether bytes begin as the text of a path does.
#[must_use]
pub fn is_path(head: &[u8]) -> bool {
    head.starts_with(PATH.as_bytes())
}

/// A path as text, for whoever measured one: reads back as a trace.
#[must_use]
pub fn path_text(samples: &[Sample]) -> String {
    let mut text = format!("{PATH}\n{COLUMNS}\n");
    for sample in samples {
        let delay = sample.delay.map(|delay| delay.as_nanos().to_string());
        // writing to a string does not fail
        let _ = writeln!(
            text,
            "{},{}",
            sample.at.as_nanos(),
            delay.unwrap_or_default()
        );
    }
    text
}

fn recorded_path(text: &str) -> Result<Vec<Sample>, TraceError> {
    let mut samples = Vec::new();
    for (line, content) in meaningful_lines(text) {
        if content == COLUMNS {
            continue;
        }
        let wrong = || TraceError::at(line, "expected at_ns,delay_ns, or at_ns, for a loss");
        let (at, delay) = content.split_once(',').ok_or_else(wrong)?;
        let delay = match delay {
            "" => None,
            delay => Some(Duration::from_nanos(delay.parse().map_err(|_| wrong())?)),
        };
        let at = Duration::from_nanos(at.parse().map_err(|_| wrong())?);
        samples.push(Sample { at, delay });
    }
    Ok(samples)
}
