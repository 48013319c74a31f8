//! Both ends of one session: what arrives is what left.

use std::collections::{BTreeMap, BTreeSet};

use mmt_shared::record::digest::RunDigest;
use mmt_shared::time::Time;
use mmt_shared::wire::{Datagram, Side};

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

    /// Sent = received + lost + sent after the newest that arrived. Where an enemy sent as well nobody counts that.
    fn judge_balance(&self, from: Totals, to: Totals, at: Time, verdict: &mut Verdict) {
        if !self.forged.is_empty() {
            return;
        }
        let (sent, lost) = (self.left.len(), to.newest.saturating_sub(to.received));
        let after = self.left.range(to.newest.saturating_add(1)..).count();
        let known = u64::from(to.received) + u64::from(lost) + after as u64;
        let holds = from.sent as usize == sent && known == sent as u64;
        verdict.judge(Invariant::CountersBalance, at, holds, || {
            format!("{sent} datagrams left the {:?}, {after} after the newest that arrived: {from:?} {to:?}", self.from)
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
