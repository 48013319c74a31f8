//! The JSON of `irtt client -o` (irtt 0.9, `json_format` 1): send times, losses, one-way delays.

use std::time::Duration;

use serde::Deserialize;

use super::{Met, Sample, TraceError, samples};
use crate::direction::Direction;

#[derive(Deserialize)]
struct Document {
    round_trips: Vec<RoundTrip>,
}

#[derive(Deserialize)]
struct RoundTrip {
    /// `false`, `true`, `true_up` or `true_down`.
    lost: String,
    timestamps: Timestamps,
    #[serde(default)]
    delay: Delays,
}

#[derive(Deserialize)]
struct Timestamps {
    client: Client,
}

#[derive(Deserialize)]
struct Client {
    send: Stamp,
}

/// Nanoseconds.
#[derive(Deserialize)]
struct Stamp {
    wall: Option<i64>,
    monotonic: Option<i64>,
}

/// Nanoseconds; `send` and `receive` hold the offset of the two clocks.
#[derive(Default, Deserialize)]
struct Delays {
    rtt: Option<i64>,
    send: Option<i64>,
    receive: Option<i64>,
}

/// Reads it. With a direction and stamps of the server, the way's own delays are taken, moved as one so
/// that the shortest is half of the shortest round trip: the clocks of the two ends differ by an unknown
/// offset. Otherwise half of each round trip.
///
/// With a direction, a probe that was lost on the other way arrived on this one. Where irtt does not know on
/// which (`true`), the first such loss counts for the way up, the second for the way down, and so on.
///
/// # Errors
/// Line and reason.
pub(super) fn parse(text: &str, direction: Option<Direction>) -> Result<Vec<Sample>, TraceError> {
    let document: Document = serde_json::from_str(text)
        .map_err(|error| TraceError::at(error.line().max(1), format!("no irtt result: {error}")))?;
    let trips = &document.round_trips;
    let way = |trip: &RoundTrip| match direction {
        Some(Direction::Up) => trip.delay.send,
        Some(Direction::Down) => trip.delay.receive,
        None => None,
    };
    let shortest_way = trips.iter().filter_map(way).min();
    let shortest_trip = trips.iter().filter_map(|trip| trip.delay.rtt).min();
    let mut met = Vec::with_capacity(trips.len());
    let first = trips.first().and_then(sent);
    let mut unknown_way = Direction::Down;
    for (number, trip) in trips.iter().enumerate() {
        let wrong = |what| TraceError::at(line_of(text, number), what);
        let sent = sent(trip).ok_or_else(|| wrong("a round trip without a time of sending"))?;
        let lost_on = match trip.lost.as_str() {
            "false" => None,
            "true_up" => Some(Direction::Up),
            "true_down" => Some(Direction::Down),
            "true" => {
                unknown_way = unknown_way.opposite();
                Some(unknown_way)
            }
            _ => return Err(wrong("lost must be false, true, true_up or true_down")),
        };
        let since = sent.saturating_sub(first.unwrap_or(sent));
        let at = Duration::from_nanos(u64::try_from(since).unwrap_or(0));
        let fate = match (lost_on, direction) {
            (Some(lost_on), Some(direction)) if lost_on != direction => Met::Arrived,
            (Some(_), _) => Met::Lost,
            (None, _) => {
                let nanos = match (way(trip), shortest_way, shortest_trip) {
                    (Some(way), Some(least), Some(trip)) => {
                        way.saturating_sub(least).saturating_add(trip / 2)
                    }
                    _ => {
                        let rtt = trip.delay.rtt;
                        rtt.ok_or_else(|| wrong("a round trip that arrived without its rtt"))? / 2
                    }
                };
                let nanos = u64::try_from(nanos).map_err(|_| wrong("a delay below zero"))?;
                Met::Delay(Duration::from_nanos(nanos))
            }
        };
        met.push((at, fate));
    }
    Ok(samples(&met))
}

fn sent(trip: &RoundTrip) -> Option<i64> {
    let stamp = &trip.timestamps.client.send;
    stamp.monotonic.or(stamp.wall)
}

/// The line with the sequence number of round trip `number`.
fn line_of(text: &str, number: usize) -> usize {
    let named = text
        .lines()
        .enumerate()
        .filter(|(_, line)| line.contains("\"seqno\""));
    named.map(|(at, _)| at + 1).nth(number).unwrap_or(1)
}
