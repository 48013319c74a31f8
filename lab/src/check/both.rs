//! Both ends of one session: what arrives is what left.

use std::collections::{BTreeMap, BTreeSet};

use mmt_shared::record::digest::RunDigest;
use mmt_shared::time::Time;
use mmt_shared::wire::{Datagram, Side};

use super::{Invariant, Verdict};

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
    /// What is found of a session that began then, once both ends are known as far as they go.
    #[must_use]
    pub fn verdict(&self, began: Time) -> Verdict {
        let mut verdict = Verdict::since(began);
        self.up.judge(&mut verdict);
        self.down.judge(&mut verdict);
        verdict
    }
}
