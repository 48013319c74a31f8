//! The emulated path between two ends, one direction each: outage, bottleneck with a queue, then an emulated link.
//!
//! A packet's fate is known when it is handed over; who drives the run takes it out when it is due. Nothing here
//! knows what packets carry, and nothing here may wait or read a clock.

use std::ops::Range;
use std::time::Duration;

use mmt_netem::config::ConfigError;
use mmt_netem::{LinkId, SimPath};
use mmt_shared::time::Time;
use quinn::udp::EcnCodepoint;

use crate::transport::{Bottleneck, Conditions, Sent};

/// IPv4 and UDP headers, bytes (RFC 791, RFC 768): what a packet has beyond its UDP payload.
const HEADERS: usize = 28;

/// A UDP datagram under way.
#[derive(Clone, Debug)]
pub(super) struct Packet {
    pub(super) contents: Vec<u8>,
    pub(super) ecn: Option<EcnCodepoint>,
    /// How long the bottleneck takes to send it.
    serialisation: Duration,
}

/// A packet at the far end.
#[derive(Debug)]
pub(super) struct Arrived {
    pub(super) packet: Packet,
    /// What the path itself took for it: serialisation, propagation, jitter; no waiting behind others.
    pub(super) own: Duration,
}

/// One direction of the path.
#[derive(Debug)]
pub(super) struct Way {
    link: SimPath<Packet>,
    bottleneck: Option<Bottleneck>,
    /// When the bottleneck has sent all that it took in.
    free_at: Time,
    /// Nothing gets through.
    pub(super) outage: Range<Time>,
    sent: Sent,
}

impl Way {
    pub(super) fn try_new(
        conditions: &Conditions,
        seed: u64,
        id: LinkId,
    ) -> Result<Self, ConfigError> {
        Ok(Self {
            link: SimPath::try_new(conditions.link(), seed, id)?,
            bottleneck: conditions.bottleneck,
            free_at: Time::ZERO,
            outage: Time::MAX..Time::MAX,
            sent: Sent::default(),
        })
    }

    /// What was handed over so far.
    pub(super) fn sent(&self) -> Sent {
        self.sent
    }

    /// Hands a packet over at `now`.
    pub(super) fn take(&mut self, now: Time, contents: &[u8], ecn: Option<EcnCodepoint>) {
        let bytes = contents.len() + HEADERS;
        self.sent.packets += 1;
        self.sent.bytes += bytes as u64;
        if self.outage.contains(&now) {
            return;
        }
        let Some((leaves, serialisation)) = self.pass_bottleneck(now, bytes) else {
            return;
        };
        let packet = Packet {
            contents: contents.to_owned(),
            ecn,
            serialisation,
        };
        self.link.push(leaves, contents.len(), packet);
    }

    /// When a packet has left the bottleneck, and how long sending it took; none if the queue is full.
    fn pass_bottleneck(&mut self, now: Time, bytes: usize) -> Option<(Time, Duration)> {
        let Some(bottleneck) = self.bottleneck else {
            return Some((now, Duration::ZERO));
        };
        if self.free_at.saturating_since(now) > bottleneck.queue {
            return None;
        }
        let serialisation = bottleneck.serialisation(bytes);
        self.free_at = self.free_at.max(now) + serialisation;
        Some((self.free_at, serialisation))
    }

    /// When the next packet arrives.
    pub(super) fn next_due(&self) -> Option<Time> {
        self.link.next_due()
    }

    /// The next packet that has arrived by `now`.
    pub(super) fn pop_due(&mut self, now: Time) -> Option<Arrived> {
        let released = self.link.pop_due(now)?;
        let propagation = released.due.saturating_since(released.offered_at);
        Some(Arrived {
            own: released.payload.serialisation + propagation,
            packet: released.payload,
        })
    }
}

#[cfg(test)]
mod tests {
    use mmt_netem::Probability;

    use super::*;

    const MS: Duration = Duration::from_millis(1);

    fn way(bottleneck: Option<Bottleneck>) -> Way {
        let conditions = Conditions {
            round_trip: 20 * MS,
            loss: Probability::ZERO,
            jitter: Duration::ZERO,
            outage: Duration::ZERO,
            bottleneck,
        };
        Way::try_new(&conditions, 1, LinkId::UP).unwrap()
    }

    fn arrivals(way: &mut Way) -> Vec<(Time, Duration)> {
        std::iter::from_fn(|| {
            let due = way.next_due()?;
            way.pop_due(due).map(|arrived| (due, arrived.own))
        })
        .collect()
    }

    #[test]
    fn waiting_behind_others_is_not_the_paths_own_time() {
        let mut way = way(Some(Bottleneck::NARROW));
        // 97 bytes and 28 of headers: 1 ms at 1 Mbit/s
        way.take(Time::ZERO, &[0; 97], None);
        way.take(Time::ZERO, &[0; 97], None);
        let expected = [
            (Time::from_millis(11), 11 * MS),
            (Time::from_millis(12), 11 * MS),
        ];
        assert_eq!(arrivals(&mut way), expected);
        assert_eq!((way.sent().packets, way.sent().bytes), (2, 250));
    }

    #[test]
    fn a_full_queue_and_an_outage_drop() {
        let mut narrow = way(Some(Bottleneck::NARROW));
        (0..1500).for_each(|_| narrow.take(Time::ZERO, &[0; 97], None));
        assert_eq!(arrivals(&mut narrow).len(), 1001);

        let mut broken = way(None);
        broken.outage = Time::from_millis(1)..Time::from_millis(3);
        (0..5).for_each(|ms| broken.take(Time::from_millis(ms), &[0; 97], None));
        assert_eq!(arrivals(&mut broken).len(), 3);
    }
}
