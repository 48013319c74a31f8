//! Both ends of one session: what arrives is what left.

use std::collections::{BTreeMap, BTreeSet};

use mmt_shared::record::digest::RunDigest;
use mmt_shared::time::Time;
use mmt_shared::wire::{Datagram, Side};

use super::intake::Intake;
use super::{Invariant, Verdict};

/// What an end counted until the end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Totals {
    /// Datagrams that left.
    pub(super) sent: u32,
    /// Those that arrived, each once.
    pub(super) received: u32,
    /// Number of the newest.
    pub(super) newest: u32,
}

/// One direction.
#[derive(Clone, Debug)]
pub struct Way {
    from: Side,
    /// Digests of what left, by number.
    left: BTreeMap<u32, u64>,
    /// Digests of what an enemy sent in the name of that end.
    forged: BTreeSet<u64>,
    /// What arrived: when, number and digest.
    arrived: Vec<(Time, u32, u64)>,
}

impl Way {
    fn new(from: Side) -> Self {
        Self {
            from,
            left: BTreeMap::new(),
            forged: BTreeSet::new(),
            arrived: Vec::new(),
        }
    }

    /// A datagram that left.
    pub fn left(&mut self, bytes: &[u8]) {
        if let Some((number, digest)) = self.known(bytes) {
            self.left.insert(number, digest);
        }
    }

    /// A datagram that an enemy sent in the name of that end.
    pub(crate) fn forged(&mut self, bytes: &[u8]) {
        let digest = self.known(bytes).map(|(_, digest)| digest);
        self.forged.extend(digest);
    }

    /// A datagram that arrived.
    pub fn arrived(&mut self, at: Time, bytes: &[u8]) {
        if let Some((number, digest)) = self.known(bytes) {
            self.arrived.push((at, number, digest));
        }
    }

    /// Its number and its digest; none of what is no datagram.
    fn known(&self, bytes: &[u8]) -> Option<(u32, u64)> {
        let datagram = Datagram::decode(bytes, self.from).ok()?;
        let mut digest = RunDigest::default();
        digest.datagram(bytes);
        Some((datagram.envelope.number, digest.value()))
    }

    /// Sent = received + lost + sent after the newest that arrived, where lost is what left and was not taken when it arrived,
    /// if it did. Where an enemy sent as well nobody counts that.
    fn judge_balance(&self, from: Totals, to: Totals, at: Time, verdict: &mut Verdict) {
        if !self.forged.is_empty() {
            return;
        }
        let mut intake = Intake::default();
        let numbers = self.arrived.iter().map(|(_, number, _)| *number);
        let came = numbers.filter(|number| intake.takes(*number) && self.left.contains_key(number));
        let came = came.count();
        let newest = intake.newest;
        let (sent, before) = (self.left.len(), self.left.range(..=newest).count());
        let (lost, after) = (before.saturating_sub(came), sent - before);
        let known = to.received as usize + lost + after;
        let holds = (from.sent as usize, to.newest) == (sent, newest) && known == sent;
        verdict.judge(Invariant::CountersBalance, at, holds, || {
            format!("{sent} datagrams left the {:?}, {came} came, {lost} were lost, {after} left after the newest that arrived: {from:?} {to:?}", self.from)
        });
    }

    fn judge(&self, verdict: &mut Verdict) {
        for (at, number, digest) in &self.arrived {
            let holds = self.left.get(number) == Some(digest) || self.forged.contains(digest);
            verdict.judge(Invariant::ArrivedWasSent, *at, holds, || {
                let found = if self.left.contains_key(number) {
                    "left otherwise"
                } else {
                    "never left"
                };
                format!("datagram {number} of the {:?} {found}", self.from)
            });
        }
    }
}

/// Both directions.
#[derive(Clone, Debug)]
pub struct Both {
    /// From master to slave.
    pub up: Way,
    /// From slave to master.
    pub down: Way,
}

impl Default for Both {
    fn default() -> Self {
        Self {
            up: Way::new(Side::Master),
            down: Way::new(Side::Slave),
        }
    }
}

impl Both {
    /// What is found of a session that began then, once both ends are known as far as they go, and what they counted.
    pub(super) fn verdict(&self, began: Time, [master, slave]: [Totals; 2]) -> Verdict {
        let mut verdict = Verdict::since(began);
        self.up.judge(&mut verdict);
        self.down.judge(&mut verdict);
        self.up.judge_balance(master, slave, began, &mut verdict);
        self.down.judge_balance(slave, master, began, &mut verdict);
        verdict
    }
}

#[cfg(test)]
mod tests {
    use mmt_shared::channel::datagram_channel::DatagramChannel;
    use mmt_shared::wire::{DATAGRAM_MAX, Message};

    use super::*;

    const AT: fn(u64) -> Time = Time::from_millis;

    /// One way of which these numbers arrive, of so many; and whether its balance holds with these totals.
    fn balances(left: u32, arrive: &[u32], totals: Totals) -> bool {
        let mut channel = DatagramChannel::new(Side::Master, Time::ZERO);
        let mut way = Way::new(Side::Master);
        let all: Vec<Vec<u8>> = (1..=left)
            .map(|n| {
                let mut out = [0; DATAGRAM_MAX];
                let length = channel.encode(AT(u64::from(n)), Message::Heartbeat, &mut out);
                out[..length.unwrap().unwrap()].to_vec()
            })
            .collect();
        all.iter().for_each(|bytes| way.left(bytes));
        for number in arrive {
            way.arrived(AT(5000), &all[*number as usize - 1]);
        }
        let from = Totals {
            sent: left,
            received: 0,
            newest: 0,
        };
        let mut verdict = Verdict::since(Time::ZERO);
        way.judge_balance(from, totals, AT(5000), &mut verdict);
        verdict.holds()
    }

    #[test]
    fn what_an_end_received_is_held_against_what_arrived() {
        let totals = |received, newest| Totals {
            sent: 0,
            received,
            newest,
        };
        // one is lost, one is there twice, one is overtaken, one follows the newest
        let arrive = [1, 2, 2, 4, 6, 5];
        assert!(balances(7, &arrive, totals(5, 6)));
        for miscounted in [4, 6] {
            assert!(!balances(7, &arrive, totals(miscounted, 6)), "{miscounted}");
        }
        assert!(!balances(7, &arrive, totals(5, 7)));
        assert!(balances(7, &[], totals(0, 0)));
        // the first after a long gap is not taken before the next confirms it, and one from long ago is not taken at all
        let arrive = [1, 2, 1500, 1501, 3, 2];
        assert!(balances(1501, &arrive, totals(3, 1501)));
        assert!(!balances(1501, &arrive, totals(4, 1501)));
    }
}
