//! Two captures of one path: which packet of the one is which of the other, and what each met on its way.
//!
//! A packet is known by its contents. Those whose contents were sent more than once are left out.

use std::collections::BTreeMap;
use std::net::IpAddr;

use mmt_shared::stats::values::quantile;
use mmt_shared::time::Time;

use super::frame::Seen;
use super::read::Frame;
use crate::config::DELAY_MAX;
use crate::direction::Direction;
use crate::packet::DropCause;
use crate::record::{End, Entry};

/// What two captures of one path show.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Matched {
    /// Every packet of both directions, as a record has it: up is from the first capture to the second.
    pub entries: Vec<Entry>,
    /// Packets left out, because the same contents were sent more than once.
    pub ambiguous: u64,
    /// By how much the clock of the second host is ahead, ns, as far as it was taken out of the delays.
    pub clock_ahead_ns: i64,
}

/// Why two captures make no path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MatchError {
    /// No packet is in both.
    #[error("no packet of one capture is in the other")]
    Nothing,
    /// All packets are left out.
    #[error(
        "the contents of each of {packets} packets were sent more than once: nobody knows which is which"
    )]
    Ambiguous {
        /// How many there are.
        packets: u64,
    },
    /// A delay below zero or beyond 1 h.
    #[error("a delay of {delay_ms} ms: the clocks of the two hosts differ")]
    Clocks {
        /// The delay, ms.
        delay_ms: i64,
    },
}

/// How captures are matched.
#[derive(Clone, Copy, Debug, Default)]
pub struct Match {
    /// Whether both captures have the times of one clock, or of two that agree. If not, and there are packets both
    /// ways, delays are moved so that the shortest of each way is half of the shortest round trip.
    pub same_clock: bool,
}

/// A packet of a capture.
struct Packet {
    at: i64,
    seen: Seen,
}

/// The packets of one way: when each was sent, its length, when it arrived and its copies.
struct Way {
    packets: Vec<Crossing>,
    ambiguous: u64,
}

struct Crossing {
    sent: i64,
    bytes: u32,
    arrivals: Vec<i64>,
}

impl Match {
    /// What packets met between the host of the first capture and that of the second.
    ///
    /// # Errors
    /// No packet is in both, none of them has contents of its own, or their times make no delays.
    pub fn paths(self, from: &[Frame<'_>], to: &[Frame<'_>]) -> Result<Matched, MatchError> {
        let (from, to) = (packets(from), packets(to));
        let (up, down) = directions(&from, &to).ok_or(MatchError::Nothing)?;
        let up = crossings(&from, &to, up.0);
        let down = down.map(|down| crossings(&to, &from, down.1));
        let least = |way: &Way| way.packets.iter().filter_map(Crossing::delay).min();
        let both = least(&up).zip(down.as_ref().and_then(least));
        let ahead = match both {
            Some((up, down)) if !self.same_clock => up.saturating_sub(down) / 2,
            _ => 0,
        };
        let mut ambiguous = up.ambiguous;
        let mut entries = entries(&up, Direction::Up, 0, -ahead)?;
        if let Some(down) = down {
            ambiguous += down.ambiguous;
            entries.extend(self::entries(&down, Direction::Down, -ahead, ahead)?);
        }
        if entries.is_empty() {
            return Err(MatchError::Ambiguous { packets: ambiguous });
        }
        let first = entries.iter().map(|entry| entry.offered).min();
        let entries = entries.into_iter();
        Ok(Matched {
            entries: entries
                .map(|entry| entry.since(first.unwrap_or_default()))
                .collect(),
            ambiguous,
            clock_ahead_ns: ahead,
        })
    }
}

impl Crossing {
    fn delay(&self) -> Option<i64> {
        let first = self.arrivals.first();
        first.map(|arrival| arrival.saturating_sub(self.sent))
    }
}

fn packets(frames: &[Frame<'_>]) -> Vec<Packet> {
    let packet = |frame: &Frame<'_>| {
        let seen = Seen::of(frame.link_type, frame.bytes)?;
        Some(Packet {
            at: frame.at_ns,
            seen,
        })
    };
    let mut packets: Vec<Packet> = frames.iter().filter_map(packet).collect();
    packets.sort_by_key(|packet| packet.at);
    packets
}

/// When each identity was seen, in order.
fn times(packets: &[Packet]) -> BTreeMap<u64, Vec<i64>> {
    let mut times: BTreeMap<u64, Vec<i64>> = BTreeMap::new();
    for packet in packets {
        times
            .entry(packet.seen.identity)
            .or_default()
            .push(packet.at);
    }
    times
}

/// Sender and receiver of a direction, as the first capture has them and as the second has them.
type Pair = ([IpAddr; 2], [IpAddr; 2]);

/// The two hosts with the most packets in both captures, up and perhaps down. Whatever the clocks: the time from
/// the first capture to the second is longer for the packets that go that way.
fn directions(from: &[Packet], to: &[Packet]) -> Option<(Pair, Option<Pair>)> {
    let there: BTreeMap<u64, &Packet> = to
        .iter()
        .rev()
        .map(|packet| (packet.seen.identity, packet))
        .collect();
    let mut differences: BTreeMap<Pair, Vec<i64>> = BTreeMap::new();
    for packet in from {
        if let Some(other) = there.get(&packet.seen.identity) {
            let pair = (packet.seen.between, other.seen.between);
            differences
                .entry(pair)
                .or_default()
                .push(other.at.saturating_sub(packet.at));
        }
    }
    let back = |([a, b], [c, d]): Pair| ([b, a], [d, c]);
    let count = |pair: &Pair| differences.get(pair).map_or(0, Vec::len);
    // of as many the least address, so that the same captures give the same paths
    let most = |pair: &&Pair| {
        (
            count(pair) + count(&back(**pair)),
            std::cmp::Reverse(**pair),
        )
    };
    let one = *differences.keys().max_by_key(most)?;
    if back(one) == one {
        // one address sends to itself: the packets of one way, or nobody knows
        return Some((one, None));
    }
    let mut median = |pair: &Pair| {
        let of_pair = differences.get_mut(pair)?;
        of_pair.sort_unstable();
        quantile(of_pair, 0.5)
    };
    let Some(backward) = median(&back(one)) else {
        return Some((one, None));
    };
    if median(&one)? >= backward {
        Some((one, Some(back(one))))
    } else {
        Some((back(one), Some(one)))
    }
}

/// What became of the packets between two hosts, from the first that arrived to the last.
fn crossings(sender: &[Packet], receiver: &[Packet], between: [IpAddr; 2]) -> Way {
    let (sent, received) = (times(sender), times(receiver));
    let mine = sender
        .iter()
        .filter(|packet| packet.seen.between == between);
    let unique = |packet: &&Packet| {
        sent.get(&packet.seen.identity)
            .is_some_and(|at| at.len() == 1)
    };
    let all = mine.clone().count();
    let crossing = |packet: &Packet| Crossing {
        sent: packet.at,
        bytes: packet.seen.bytes,
        arrivals: received
            .get(&packet.seen.identity)
            .cloned()
            .unwrap_or_default(),
    };
    let mut packets: Vec<Crossing> = mine.filter(unique).map(crossing).collect();
    let ambiguous = (all - packets.len()) as u64;
    let arrived = |packet: &Crossing| !packet.arrivals.is_empty();
    // what was sent before the other capture began or after it ended is not lost
    packets.truncate(packets.iter().rposition(arrived).map_or(0, |last| last + 1));
    packets.drain(..packets.iter().position(arrived).unwrap_or(0));
    Way { packets, ambiguous }
}

/// A way as a record has it; `clock` and `delay` are added to its times of sending and to its delays, ns.
fn entries(
    way: &Way,
    direction: Direction,
    clock: i64,
    delay: i64,
) -> Result<Vec<Entry>, MatchError> {
    let mut entries = Vec::new();
    for (number, packet) in (0_u64..).zip(&way.packets) {
        let sent = packet.sent.saturating_add(clock);
        let offered = Time::from_nanos(sent.max(0).unsigned_abs());
        let entry = |end| Entry {
            direction,
            number,
            offered,
            bytes: packet.bytes,
            backlog: 0,
            end,
        };
        for (copy, arrival) in packet.arrivals.iter().enumerate() {
            let nanos = arrival.saturating_sub(packet.sent).saturating_add(delay);
            let wrong = MatchError::Clocks {
                delay_ms: nanos / 1_000_000,
            };
            let took = u64::try_from(nanos).map_err(|_| wrong)?;
            let sent = offered + std::time::Duration::from_nanos(took);
            if sent.saturating_since(offered) > DELAY_MAX {
                return Err(wrong);
            }
            entries.push(entry(End::Sent {
                due: sent,
                sent,
                copy: copy > 0,
                corrupted: false,
            }));
        }
        if packet.arrivals.is_empty() {
            entries.push(entry(End::Dropped(DropCause::Loss)));
        }
    }
    Ok(entries)
}
