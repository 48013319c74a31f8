//! The processed CSV of the LENS data set (J. Zhao, J. Pan, "LENS: A LEO Satellite Network Measurement
//! Dataset", MMSys 2024): `timestamp,rtt,uplink,downlink` of irtt, or `timestamp,rtt` of ping.

use std::time::Duration;

use super::{Sample, TraceError};
use crate::direction::Direction;

/// Reads it: stamps in whole nanoseconds (irtt) or decimal seconds (ping), delays in ms, -1 for the way
/// on which a probe was lost. Without a direction, or without one-way columns, half of the round trip is
/// taken for one way. The clocks of both ends were not synchronised: only the sum of both ways is sure.
///
/// # Errors
/// Line and reason.
pub(super) fn parse(text: &str, direction: Option<Direction>) -> Result<Vec<Sample>, TraceError> {
    let mut samples = Vec::new();
    let mut stamps_before: Option<u64> = None;
    for (at, line) in text.lines().enumerate().skip(1) {
        if line.trim().is_empty() {
            continue;
        }
        let wrong = |what| TraceError::at(at + 1, what);
        let mut fields = line.split(',').map(str::trim);
        let stamp = fields.next().and_then(nanos);
        let stamp = stamp.ok_or_else(|| wrong("expected a stamp in nanoseconds or seconds"))?;
        let numbers: Result<Vec<f64>, _> = fields.map(str::parse).collect();
        let delay_ms = match (numbers.as_deref(), direction) {
            (Ok([_, up, _]), Some(Direction::Up)) => one_way(numbers.as_deref(), *up),
            (Ok([_, _, down]), Some(Direction::Down)) => one_way(numbers.as_deref(), *down),
            (Ok([rtt, ..]), _) => one_way(numbers.as_deref(), 0.5 * rtt),
            _ => return Err(wrong("expected numbers in ms: rtt, or rtt,uplink,downlink")),
        };
        let begin = *stamps_before.get_or_insert(stamp);
        let delay = match delay_ms {
            Some(ms) if (0.0..=3.6e6).contains(&ms) => Some(Duration::from_secs_f64(ms * 1e-3)),
            Some(_) => return Err(wrong("a delay lies between 0 and 1 h")),
            None => None,
        };
        samples.push(Sample {
            at: Duration::from_nanos(stamp.saturating_sub(begin)),
            delay,
        });
    }
    Ok(samples)
}

/// The delay of a probe; `None` if it was lost on either way: then no delay of it is known.
fn one_way(numbers: Result<&[f64], &std::num::ParseFloatError>, delay_ms: f64) -> Option<f64> {
    let lost = numbers.is_ok_and(|numbers| numbers.iter().any(|ms| *ms == -1.0));
    (!lost).then_some(delay_ms)
}

/// Nanoseconds of a stamp: whole ones as they are, decimals as seconds.
fn nanos(stamp: &str) -> Option<u64> {
    match stamp.split_once('.') {
        None => stamp.parse().ok(),
        Some(_) => {
            let seconds: f64 = stamp.parse().ok()?;
            (0.0..1e10)
                .contains(&seconds)
                .then_some((seconds * 1e9) as u64)
        }
    }
}
