//! What is seen of a world from outside: its parts, and what a run has come to.

use mmt_client::master::Master;
use mmt_client::operator::Operator;
use mmt_netem::Link;
use mmt_netem::counters::Tally;
use mmt_server::end::SlaveEnd;
use mmt_server::environment::Environment;
use mmt_server::slave::Slave;
use mmt_shared::metrics::ForceSummary;
use sha2::Digest;

use super::datagram::Datagram;
use super::{Outcome, World, WorldTraffic};
use crate::check::Verdict;
use crate::digest::hex;

impl World {
    /// The slave.
    #[must_use]
    pub fn slave(&self) -> &Slave {
        self.slave.slave()
    }

    /// The real object, to be changed in mid-run.
    pub fn environment_mut(&mut self) -> &mut Environment {
        self.slave.slave_mut().environment_mut()
    }

    /// The master.
    #[must_use]
    pub fn master(&self) -> &Master {
        self.master.master()
    }

    /// The slave's end.
    #[must_use]
    pub fn slave_end(&self) -> &SlaveEnd {
        &self.slave
    }

    /// What was sent: messages by kind, and datagrams with bits per second.
    #[must_use]
    pub fn traffic(&self) -> WorldTraffic {
        let ends = (self.master.channel(), self.slave.channel());
        let repeated = self.slave.counts().repeated;
        WorldTraffic::of(ends, repeated, self.sent(), self.now.as_secs_f64())
    }

    /// Datagrams sent up and down, as long as their payload.
    #[must_use]
    pub fn sent(&self) -> [Tally; 2] {
        [self.up.counters().offered, self.down.counters().offered]
    }

    /// Datagrams that the queues before the bottlenecks of both directions dropped.
    #[must_use]
    pub fn dropped_in_queues(&self) -> u64 {
        let of = |path: &Link<Datagram>| path.counters().dropped.queue.packets;
        of(&self.up) + of(&self.down)
    }

    /// The operator.
    #[must_use]
    pub fn operator(&self) -> &Operator {
        &self.operator
    }

    /// What the run has come to so far.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        let (master, counts) = (self.master(), self.master.counts());
        Outcome {
            updates: self.slave.counts().updates,
            age: counts.age,
            staleness: self.staleness.clone(),
            pose: self.pose,
            breaks: counts.breaks,
            on_hand: counts.on_hand,
            energy_injected_j: master.energy_injected_j(),
            observer_min_j: master.port().least_j(),
            forces: self.slave.channel().counts().sent.tools,
        }
    }

    /// The force metrics so far.
    #[must_use]
    pub fn force(&self) -> ForceSummary {
        self.slave().force().summary()
    }

    /// SHA-256 of the event log so far, in hexadecimal digits: equal for equal configurations.
    #[must_use]
    pub fn digest(&self) -> String {
        hex(&self.log.clone().finalize())
    }

    /// The same, its sessions judged by the invariants of [`check`](crate::check).
    #[cfg(feature = "io")]
    pub(crate) fn judged(mut self) -> Self {
        self.judges = true;
        self
    }

    /// What the invariants of the [`check`](crate::check) came to so far; none where nobody judges.
    #[must_use]
    pub fn verdict(&self) -> Option<Verdict> {
        self.judges.then(|| self.checks.verdict())
    }
}
