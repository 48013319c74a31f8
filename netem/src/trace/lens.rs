//! The processed CSV of the LENS data set (J. Zhao, J. Pan, "LENS: A LEO Satellite Network Measurement
//! Dataset", MMSys 2024): `timestamp,rtt,uplink,downlink` of irtt, or `timestamp,rtt` of ping.

use std::time::Duration;

use super::{Met, Sample, TraceError, samples};
use crate::direction::Direction;

/// What stands for a lost probe.
const LOST: f64 = -1.0;

/// Reads it: stamps in whole nanoseconds (irtt) or decimal seconds (ping), delays in ms, -1 for the way
/// on which a probe was lost. A probe that was lost on the other way arrived on this one, after a delay that
/// nobody measured. Without a direction, or without one-way columns, half of the round trip is
/// taken for one way. The clocks of both ends were not synchronised: only the sum of both ways is sure.
///
/// # Errors
/// Line and reason.
pub(super) fn parse(text: &str, direction: Option<Direction>) -> Result<Vec<Sample>, TraceError> {
    let mut met = Vec::new();
    let mut begin: Option<u64> = None;
    for (at, line) in text.lines().enumerate().skip(1) {
        if line.trim().is_empty() {
            continue;
        }
        let wrong = |what| TraceError::at(at + 1, what);
        let mut fields = line.split(',').map(str::trim);
        let stamp = fields.next().and_then(nanos);
        let stamp = stamp.ok_or_else(|| wrong("expected a stamp in nanoseconds or seconds"))?;
        let numbers: Result<Vec<f64>, _> = fields.map(str::parse).collect();
        let (own, others) = match (numbers.as_deref(), direction) {
            (Ok([_, up, down]), Some(Direction::Up)) => (*up, *down),
            (Ok([_, up, down]), Some(Direction::Down)) => (*down, *up),
            (Ok([rtt, ways @ ..]), _) if ways.contains(&LOST) || *rtt == LOST => (LOST, *rtt),
            (Ok([rtt, ..]), _) => (0.5 * rtt, *rtt),
            _ => return Err(wrong("expected numbers in ms: rtt, or rtt,uplink,downlink")),
        };
        let fate = if own == LOST {
            Met::Lost
        } else if others == LOST {
            Met::Arrived
        } else if (0.0..=3.6e6).contains(&own) {
            Met::Delay(Duration::from_secs_f64(own * 1e-3))
        } else {
            return Err(wrong("a delay lies between 0 and 1 h"));
        };
        let begin = *begin.get_or_insert(stamp);
        met.push((Duration::from_nanos(stamp.saturating_sub(begin)), fate));
    }
    Ok(samples(&met))
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
