//! The ends of a session with their judges.

use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceProfile;
use mmt_client::end::MasterEnd;
use mmt_client::limiter::ForceLimiter;
use mmt_client::master::Master;
use mmt_lab::check::{MasterAbout, MasterChecks, SlaveAbout, SlaveChecks};
use mmt_server::end::{SlaveEnd, session_config};
use mmt_server::slave::{Memory, SlaveConfig};
use mmt_shared::pairing::Token;
use mmt_shared::time::Time;
use mmt_shared::wire::{Hello, STREAM_MESSAGE_MAX, Side, StreamMessage};

use crate::fuzz::session::judge::{MasterJudge, SlaveJudge};

/// The ends of a session with their judges.
pub(super) struct Ends {
    pub(super) master: MasterEnd,
    pub(super) slave: SlaveEnd,
    pub(super) master_judge: MasterJudge,
    pub(super) slave_judge: SlaveJudge,
    pub(super) master_checks: MasterChecks,
    pub(super) slave_checks: SlaveChecks,
}

impl Ends {
    /// Whether an emergency stop is set, as either end has it.
    pub(super) fn are_stopped(&self) -> bool {
        self.slave.stopped_by().is_some() || self.master.stopped_by().is_some()
    }

    /// Both ends of a session that begins now, after the welcome has crossed the wire.
    pub(super) fn new(
        config: &SlaveConfig,
        hello: &Hello,
        device: &DeviceProfile,
        commands: CommandConfig,
        (master_now, slave_now): (Time, Time),
        memory: Option<&Memory>,
    ) -> Self {
        let slave = SlaveEnd::of_session(slave_now, config, hello, memory).unwrap();
        let welcome = slave.slave().welcome(Token::new([0; 32]), "any", "fuzz");
        let mut out = [0; STREAM_MESSAGE_MAX];
        let length = StreamMessage::Welcome((&welcome).into())
            .encode(&mut out)
            .unwrap();
        let Ok(StreamMessage::Welcome(read)) = StreamMessage::decode(&out[..length], Side::Slave)
        else {
            panic!("a welcome that cannot be read");
        };
        let welcome = read.accept(&hello.coupling).unwrap();
        let limiter = ForceLimiter::try_new(device.limits()).unwrap();
        let master = Master::with_architecture(&welcome, limiter, hello.architecture);
        let about = MasterAbout {
            began: master_now,
            limits: device.limits(),
            settings: welcome.settings,
            start: welcome.tool,
        };
        let of_slave = SlaveAbout {
            began: slave_now,
            config: session_config(config, hello),
            coupling: hello.coupling,
            tool: welcome.tool,
        };
        Self {
            master: MasterEnd::new(master_now, master, commands),
            slave,
            master_judge: MasterJudge::new(device.limits()),
            slave_judge: SlaveJudge::default(),
            master_checks: MasterChecks::new(about),
            slave_checks: SlaveChecks::new(of_slave),
        }
    }
}
