//! Recorded networks: text in, delays, losses and sending opportunities out.
//!
//! Formats: mahimahi, irtt, ping, LENS, and the CSV of our own recorder. Errors name the line. It
//! reads no file: text goes in.

use std::fmt;
use std::time::Duration;

pub mod irtt;
pub mod lens;
pub mod mahimahi;
pub mod mmt;
pub mod path;
pub mod ping;
#[cfg(test)]
mod tests;

/// Why a trace is none, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {reason}")]
pub struct TraceError {
    /// The line, from 1.
    pub line: usize,
    /// What is wrong there.
    pub reason: String,
}

impl TraceError {
    /// An error in a line.
    pub fn at(line: usize, reason: impl fmt::Display) -> Self {
        let reason = reason.to_string();
        Self { line, reason }
    }
}

/// One probe that went over a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// When it was sent, counted from the first.
    pub at: Duration,
    /// How long it took one way; `None`: it was lost.
    pub delay: Option<Duration>,
}

/// What a probe met on one way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Met {
    Delay(Duration),
    Lost,
    /// It arrived, after a delay that nobody measured: the answer was lost on the other way.
    Arrived,
}

/// The samples of one way. A delay that nobody measured is taken to be that of the last probe before it that
/// arrived, or of the first one after it.
pub(crate) fn samples(met: &[(Duration, Met)]) -> Vec<Sample> {
    let measured = |(_, met): &(Duration, Met)| match met {
        Met::Delay(delay) => Some(*delay),
        Met::Lost | Met::Arrived => None,
    };
    let mut last = met.iter().find_map(measured);
    let mut sample = |probe: &(Duration, Met)| {
        last = measured(probe).or(last);
        let delay = last.filter(|_| probe.1 != Met::Lost);
        Sample { at: probe.0, delay }
    };
    met.iter().map(&mut sample).collect()
}

/// The samples of `lost` probes between two others, evenly.
pub fn lost_between(since: Duration, until: Duration, lost: u64) -> impl Iterator<Item = Sample> {
    let way = until.saturating_sub(since).as_secs_f64() / (lost as f64 + 1.0);
    (1..=lost).map(move |step| Sample {
        at: since + Duration::from_secs_f64(way * step as f64),
        delay: None,
    })
}

/// The lines that are not empty and no comment, with their numbers from 1.
pub(crate) fn meaningful_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.lines().enumerate();
    lines
        .map(|(at, line)| (at + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}
