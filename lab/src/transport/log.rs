//! What became of each message of a run, and what that makes.

use std::time::Duration;

use mmt_shared::stats::values::quantile;
use mmt_shared::time::{Time, duration_nanos};
use sha2::{Digest, Sha256};

use crate::digest::hex;

use super::Case;

/// Packets handed to the path in one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sent {
    /// UDP datagrams.
    pub packets: u64,
    /// Their bytes with IP and UDP headers.
    pub bytes: u64,
}

impl Sent {
    /// What was handed over since `earlier`.
    #[must_use]
    pub fn since(self, earlier: Self) -> Self {
        Self {
            packets: self.packets.saturating_sub(earlier.packets),
            bytes: self.bytes.saturating_sub(earlier.bytes),
        }
    }
}

/// A message that came, for the first time.
#[derive(Clone, Copy, Debug)]
struct Arrival {
    number: u32,
    at: Time,
    added: Duration,
}

/// The messages of a run.
#[derive(Clone, Debug)]
pub struct Log {
    case: Case,
    start: Time,
    sent: u32,
    arrivals: Vec<Arrival>,
}

/// What a run measured.
#[derive(Clone, Debug, PartialEq)]
pub struct FlowOutcome {
    /// Messages sent while the path was up.
    pub possible: u64,
    /// Those of them that came.
    pub delivered: u64,
    /// Delay added by the protocol, median over the messages that came, ms.
    pub added_p50_ms: Option<f64>,
    /// The same, 99 % of them.
    pub added_p99_ms: Option<f64>,
    /// The same, all of them.
    pub added_max_ms: Option<f64>,
    /// Messages sent while nothing got through that came all the same, once it did.
    pub stale: u64,
    /// From the first sending after the outage to the first arrival of anything sent since, without the path's own
    /// delay, ms; none without an outage. What the path loses by chance makes it longer.
    pub fresh_ms: Option<f64>,
    /// Packets from the master.
    pub up: Sent,
    /// Packets from the slave: heartbeats and acknowledgements.
    pub down: Sent,
    /// SHA-256 over each arrival and the packets, in hexadecimal digits.
    pub digest: String,
}

impl Log {
    /// The log of a run whose first message is sent at `start`.
    #[must_use]
    pub fn new(case: &Case, start: Time) -> Self {
        Self {
            case: *case,
            start,
            sent: 0,
            arrivals: Vec::new(),
        }
    }

    /// When the next message is sent.
    #[must_use]
    pub fn next_send(&self) -> Time {
        self.sent_at(self.sent)
    }

    /// The next message, which counts as sent.
    pub fn send(&mut self) -> Vec<u8> {
        let mut message = self.sent.to_le_bytes().to_vec();
        message.resize(self.case.flow.bytes, 0);
        self.sent += 1;
        message
    }

    /// A message came at `at`; `own` is what the path itself took for its packet. What is no message of this run is
    /// passed over.
    pub fn arrived(&mut self, message: &[u8], at: Time, own: Duration) {
        let number = message.first_chunk().copied().map(u32::from_le_bytes);
        if let Some(number) = number.filter(|number| *number < self.sent) {
            let took = at.saturating_since(self.sent_at(number));
            let added = took.saturating_sub(own);
            self.arrivals.push(Arrival { number, at, added });
        }
    }

    fn sent_at(&self, number: u32) -> Time {
        let nanos = u64::from(number) * 1_000_000_000 / u64::from(self.case.flow.rate_hz);
        self.start + Duration::from_nanos(nanos)
    }

    /// What the run measured.
    #[must_use]
    pub fn outcome(&self, up: Sent, down: Sent) -> FlowOutcome {
        let outage = self.case.outage(self.start);
        let into_outage = |number: &u32| outage.contains(&self.sent_at(*number));
        let possible = (0..self.sent).filter(|number| !into_outage(number)).count();
        let stale = self
            .arrivals
            .iter()
            .filter(|a| into_outage(&a.number))
            .count();
        let mut added: Vec<Duration> = self.arrivals.iter().map(|a| a.added).collect();
        added.sort_unstable();
        FlowOutcome {
            possible: possible as u64,
            delivered: (self.arrivals.len() - stale) as u64,
            added_p50_ms: quantile(&added, 0.5).map(millis),
            added_p99_ms: quantile(&added, 0.99).map(millis),
            added_max_ms: added.last().copied().map(millis),
            stale: stale as u64,
            fresh_ms: self.fresh().map(millis),
            up,
            down,
            digest: self.digest(up, down),
        }
    }

    /// The wait for fresh news after the outage.
    fn fresh(&self) -> Option<Duration> {
        let outage = self.case.outage(self.start);
        let after = |number: &u32| self.sent_at(*number) >= outage.end;
        let first = (0..self.sent).find(after).filter(|_| !outage.is_empty())?;
        let arrivals = self.arrivals.iter().filter(|a| a.number >= first);
        let waits = arrivals.map(|a| {
            let since = self.sent_at(a.number).saturating_since(self.sent_at(first));
            since + a.added
        });
        waits.min()
    }

    fn digest(&self, up: Sent, down: Sent) -> String {
        let mut hash = Sha256::new();
        for arrival in &self.arrivals {
            hash.update(arrival.number.to_le_bytes());
            hash.update(
                arrival
                    .at
                    .saturating_since(self.start)
                    .as_nanos()
                    .to_le_bytes(),
            );
            hash.update(arrival.added.as_nanos().to_le_bytes());
        }
        for count in [up.packets, up.bytes, down.packets, down.bytes] {
            hash.update(count.to_le_bytes());
        }
        hex(&hash.finalize())
    }
}

impl FlowOutcome {
    /// Share of the messages sent while the path was up that came.
    #[must_use]
    pub fn share(&self) -> Option<f64> {
        (self.possible > 0).then(|| self.delivered as f64 / self.possible as f64)
    }
}

fn millis(duration: Duration) -> f64 {
    duration_nanos(duration) as f64 * 1e-6
}

#[cfg(test)]
mod tests;
