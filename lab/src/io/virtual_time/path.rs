//! The emulated path between two ends, one direction: outage and bottleneck with a queue, then the rest of the path.
//!
//! Both are links of the emulator, one behind the other: what the queue or an outage drops never meets the second,
//! and takes no draw of it. Nothing here reads what packets carry, and nothing here may wait or read a clock.

use std::ops::Range;
use std::time::Duration;

use mmt_netem::config::{
    ConfigError, Framing, LIMIT_MAX, LIMIT_MAX_BYTES, Limit, Outage, Queue, Rate, Service,
};
use mmt_netem::{Departure, Link, LinkConfig, LinkId, Packet};
use mmt_shared::time::Time;
use quinn::udp::EcnCodepoint;

use crate::transport::{Conditions, Sent};

/// IPv4 and UDP headers, bytes (RFC 791, RFC 768): what a packet has beyond its UDP payload.
const HEADERS: u8 = 28;

/// A UDP datagram under way.
#[derive(Clone, Debug)]
pub(super) struct Datagram {
    pub(super) contents: Vec<u8>,
    pub(super) ecn: Option<EcnCodepoint>,
    /// What the path itself took for it so far: serialisation, propagation, jitter; no waiting behind others.
    pub(super) own: Duration,
}

/// One direction of the path.
#[derive(Debug)]
pub(super) struct OneWay {
    bottleneck: Link<Datagram>,
    rest: Link<Datagram>,
    sent: Sent,
}

impl OneWay {
    pub(super) fn try_new(
        conditions: &Conditions,
        seed: u64,
        id: LinkId,
    ) -> Result<Self, ConfigError> {
        Ok(Self {
            bottleneck: Link::try_new(bottleneck(conditions), seed, id)?,
            rest: Link::try_new(conditions.link(), seed, id)?,
            sent: Sent::default(),
        })
    }

    /// Nothing gets through in this time; to be set before it begins.
    pub(super) fn set_outage(
        &mut self,
        now: Time,
        outage: &Range<Time>,
    ) -> Result<(), ConfigError> {
        let mut config = self.bottleneck.config().clone();
        config.outages.push(Outage {
            at: outage.start.saturating_since(Time::ZERO),
            length: outage.end.saturating_since(outage.start),
            every: None,
        });
        self.bottleneck.reconfigure(now, config)
    }

    /// What was handed over so far.
    pub(super) fn sent(&self) -> Sent {
        self.sent
    }

    /// Hands a packet over at `now`.
    pub(super) fn offer(&mut self, now: Time, contents: &[u8], ecn: Option<EcnCodepoint>) {
        self.sent.packets += 1;
        self.sent.bytes += contents.len() as u64 + u64::from(HEADERS);
        let datagram = Datagram {
            contents: contents.to_owned(),
            ecn,
            own: Duration::ZERO,
        };
        self.bottleneck
            .offer(now, Packet::new(contents.len(), datagram));
        self.pass_on(now);
    }

    fn pass_on(&mut self, now: Time) {
        while let Some(out) = self.bottleneck.poll_delivered(now) {
            let (at, bytes) = (out.due, out.bytes);
            self.rest.offer(at, Packet::new(bytes, charged(out)));
        }
    }

    /// When to poll next.
    pub(super) fn poll_timeout(&self) -> Option<Time> {
        let timeouts = [self.bottleneck.poll_timeout(), self.rest.poll_timeout()];
        timeouts.into_iter().flatten().min()
    }

    /// The next packet that has arrived by `now`.
    pub(super) fn poll(&mut self, now: Time) -> Option<Datagram> {
        self.pass_on(now);
        self.rest.poll_delivered(now).map(charged)
    }
}

/// The link with the bottleneck alone.
fn bottleneck(conditions: &Conditions) -> LinkConfig {
    let bottleneck = conditions.bottleneck;
    LinkConfig {
        rate: bottleneck.map(|bottleneck| Rate {
            service: Service::Constant {
                bits_per_second: bottleneck.bits_per_s,
            },
            framing: Framing {
                overhead: HEADERS.into(),
                ..Framing::default()
            },
        }),
        queue: Queue {
            wait: bottleneck.map(|bottleneck| bottleneck.queue),
            ..Queue::default()
        },
        limit: Limit {
            packets: LIMIT_MAX,
            bytes: LIMIT_MAX_BYTES,
        },
        ..LinkConfig::default()
    }
}

/// What left a link, with the time that this link itself took for it.
fn charged(out: Departure<Datagram>) -> Datagram {
    let took = out.due.saturating_since(out.offered_at);
    let own = out.payload.own + took.saturating_sub(out.queued);
    Datagram { own, ..out.payload }
}

#[cfg(test)]
mod tests {
    use mmt_netem::Probability;

    use super::*;
    use crate::transport::Bottleneck;

    const MS: Duration = Duration::from_millis(1);

    fn one_way(bottleneck: Option<Bottleneck>) -> OneWay {
        let conditions = Conditions {
            round_trip: 20 * MS,
            loss: Probability::ZERO,
            jitter: Duration::ZERO,
            outage: Duration::ZERO,
            bottleneck,
        };
        OneWay::try_new(&conditions, 1, LinkId::UP).unwrap()
    }

    fn arrivals(path: &mut OneWay) -> Vec<(Time, Duration)> {
        let mut arrivals = Vec::new();
        while let Some(now) = path.poll_timeout() {
            while let Some(arrived) = path.poll(now) {
                arrivals.push((now, arrived.own));
            }
        }
        arrivals
    }

    #[test]
    fn waiting_behind_others_is_not_the_paths_own_time() {
        let mut path = one_way(Some(Bottleneck::NARROW));
        // 97 bytes and 28 of headers: 1 ms at 1 Mbit/s
        path.offer(Time::ZERO, &[0; 97], None);
        path.offer(Time::ZERO, &[0; 97], None);
        let expected = [
            (Time::from_millis(11), 11 * MS),
            (Time::from_millis(12), 11 * MS),
        ];
        assert_eq!(arrivals(&mut path), expected);
        assert_eq!((path.sent().packets, path.sent().bytes), (2, 250));
    }

    #[test]
    fn a_full_queue_and_an_outage_drop() {
        let mut narrow = one_way(Some(Bottleneck::NARROW));
        (0..1500).for_each(|_| narrow.offer(Time::ZERO, &[0; 97], None));
        assert_eq!(arrivals(&mut narrow).len(), 1001);

        let mut broken = one_way(None);
        let outage = Time::from_millis(1)..Time::from_millis(3);
        broken.set_outage(Time::ZERO, &outage).unwrap();
        (0..5).for_each(|ms| broken.offer(Time::from_millis(ms), &[0; 97], None));
        assert_eq!(arrivals(&mut broken).len(), 3);
    }
}
