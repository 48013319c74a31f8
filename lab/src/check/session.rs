//! The judges of both ends of one session in virtual time.

use mmt_client::end::{MasterEnd, MasterGiven};
use mmt_client::limiter::Limits;
use mmt_client::master::MasterTick;
use mmt_server::end::{SlaveEnd, SlaveGiven};
use mmt_server::slave::{SlaveConfig, SlaveTick};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::settings::ModelSettings;
use mmt_shared::time::Time;

use super::{
    Both, MasterAbout, MasterChecks, MasterTicked, SlaveAbout, SlaveChecks, SlaveTicked, Verdict,
};

/// Both ends' judges.
pub(crate) struct SessionChecks {
    pub(crate) master: MasterChecks,
    pub(crate) slave: SlaveChecks,
    pub(crate) both: Both,
    began: Time,
}

impl SessionChecks {
    /// Of a session whose ends begin at these times, each by its own clock.
    pub(crate) fn new(
        (master, slave): (Time, Time),
        limits: Limits,
        settings: ModelSettings,
        config: SlaveConfig,
        tool: Vec2,
    ) -> Self {
        let about = MasterAbout {
            began: master,
            limits,
            settings,
            start: tool,
        };
        let slave = SlaveAbout {
            began: slave,
            config,
            coupling: settings.coupling,
            tool,
        };
        Self {
            master: MasterChecks::new(about),
            slave: SlaveChecks::new(slave),
            both: Both::default(),
            began: master,
        }
    }

    /// A tick of the master, before what it sends.
    pub(crate) fn master_ticked(
        &mut self,
        now: Time,
        given: MasterGiven,
        done: &MasterTick,
        end: &MasterEnd,
    ) {
        self.master.ticked(&MasterTicked {
            now,
            polled: now,
            given,
            done,
            end,
        });
    }

    /// A datagram that leaves the master.
    pub(crate) fn up(&mut self, at: Time, bytes: &[u8]) {
        self.master.left(at, bytes);
        self.both.up.left(bytes);
    }

    /// A datagram that arrives at the slave.
    pub(crate) fn came_up(&mut self, at: Time, bytes: &[u8]) {
        self.slave.arrived(at, bytes);
        self.both.up.arrived(at, bytes);
    }

    /// A tick of the slave, before what it sends.
    pub(crate) fn slave_ticked(
        &mut self,
        now: Time,
        given: SlaveGiven,
        done: Option<&SlaveTick>,
        end: &SlaveEnd,
    ) {
        self.slave.ticked(&SlaveTicked {
            now,
            polled: now,
            given,
            done,
            end,
        });
    }

    /// A datagram that leaves the slave.
    pub(crate) fn down(&mut self, at: Time, bytes: &[u8]) {
        self.slave.left(at, bytes);
        self.both.down.left(bytes);
    }

    /// A datagram that arrives at the master.
    pub(crate) fn came_down(&mut self, at: Time, bytes: &[u8]) {
        self.master.arrived(at, bytes);
        self.both.down.arrived(at, bytes);
    }

    /// What was found so far.
    pub(crate) fn verdict(&self) -> Verdict {
        let ends = [self.master.totals(), self.slave.totals()];
        let mut sum = self.both.verdict(self.began, ends);
        sum.add(self.master.verdict().clone());
        sum.add(self.slave.verdict().clone());
        sum
    }
}
