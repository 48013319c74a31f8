//! Two ends, what lies between them, and their clocks.

mod ends;
mod network;
mod recovery;

use std::time::Duration;

use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceProfile;
use mmt_client::end::MasterGiven;
use mmt_lab::check::{MasterTicked, SlaveTicked};
use mmt_server::end::SlaveGiven;
use mmt_server::environment::BodyConfig;
use mmt_server::slave::{Memory, SlaveConfig};
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::settings::Mode;
use mmt_shared::pairing::Token;
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{
    Claim, DATAGRAM_MAX, Ending, Farewell, Hello, Label, Role, STREAM_MESSAGE_MAX, Side,
    StreamMessage,
};

use super::bytes::{HEAD, place};
use ends::Ends;
pub(super) use network::Network;
use network::Path;

/// A session and what lies around it.
pub(super) struct Bench {
    config: SlaveConfig,
    hello: Hello,
    device: DeviceProfile,
    commands: CommandConfig,
    ends: Ends,
    /// Each by its own clock.
    master_now: Time,
    slave_now: Time,
    pub(super) reading: Vec2,
    pub(super) velocity: Vec2,
    pub(super) engaged: bool,
    pub(super) releasing: bool,
    /// The master's and the slave's.
    pub(super) stops: [bool; 2],
    pub(super) path: Path,
    /// Whether an enemy has sent what an end may have believed, in this session.
    enemy: bool,
    /// What was seen, as bits.
    seen: u64,
}

/// The worlds that a head may ask for.
fn world(kind: u8) -> SlaveConfig {
    let mut config = SlaveConfig::of_mode(if kind % 5 == 3 {
        Mode::Paper
    } else {
        Mode::Recommended
    });
    match kind % 5 {
        1 => {
            // among others, so that the tool can change the body
            config.scene.bodies = vec![BodyConfig::default(); 2];
            config.scene.bodies[1].pose.position.y = 0.5;
        }
        2 => config.environment.mass_kg = 0.2,
        4 => config.environment.friction_coefficient = 1.0,
        _ => {}
    }
    config
}

impl Bench {
    pub(super) fn new(
        [kind, packing, stiffness, hip_x, hip_y, stretch, scenes, _]: [u8; HEAD],
    ) -> Self {
        let k_p = [1000.0, 300.0, 50.0, 3000.0, 1500.0][usize::from(stiffness % 5)];
        let device = DeviceProfile::default().used_with(Some(k_p), None).unwrap();
        let architecture = if packing & 4 == 0 {
            Architecture::Mmt
        } else {
            Architecture::Tdpa
        };
        let samples = [10, 1, 5, 32][usize::from(packing & 3)];
        let mut commands = CommandConfig {
            samples_per_command: samples,
            ..CommandConfig::default()
        };
        commands.repeat_samples = u8::from(packing & 8 != 0);
        if stretch & 1 != 0 {
            commands.stretch_max = 1.0.try_into().unwrap();
        }
        let commands = commands.for_architecture(architecture);
        let hello = Hello {
            token: Token::new([0; 32]),
            role: Role::Operator,
            claim: Claim::IfFree,
            coupling: device.coupling(),
            samples_per_command: commands.samples_per_command,
            architecture,
            scene_hz: [0, 60, 30][usize::from(scenes % 3)],
            hip: Vec2::new(-0.45, 0.0) + place(hip_x, hip_y),
            program: Label::clipped("fuzz"),
        };
        let config = world(kind);
        let (master_now, slave_now) = (Time::from_millis(5000), Time::from_millis(7_200_000));
        let ends = Ends::new(
            &config,
            &hello,
            &device,
            commands,
            (master_now, slave_now),
            None,
        );
        let reading = ends.slave.slave().tool_at();
        Self {
            config,
            hello,
            device,
            commands,
            ends,
            master_now,
            slave_now,
            reading,
            velocity: Vec2::zeros(),
            engaged: true,
            releasing: false,
            stops: [false; 2],
            path: Path::default(),
            enemy: false,
            seen: 0,
        }
    }

    /// Both clocks go on by a millisecond, and both ends tick.
    pub(super) fn tick(&mut self) {
        self.master_now += TICK;
        self.slave_now += TICK;
        self.deliver();
        self.tick_master();
        self.deliver();
        self.tick_slave();
    }

    /// One end ticks, the other stands.
    pub(super) fn tick_of(&mut self, side: Side) {
        self.master_now += TICK;
        self.slave_now += TICK;
        self.deliver();
        match side {
            Side::Master => self.tick_master(),
            Side::Slave => self.tick_slave(),
        }
    }

    /// A clock goes on without ticks: the process stood, or was not there.
    pub(super) fn jump(&mut self, side: Side, by: Duration) {
        match side {
            Side::Master => self.master_now += by,
            Side::Slave => self.slave_now += by,
        }
    }

    fn tick_master(&mut self) {
        let now = self.master_now;
        self.reading += self.velocity;
        let Ends {
            master,
            master_judge: judge,
            master_checks: checks,
            ..
        } = &mut self.ends;
        let [stops, _] = self.stops;
        let given = MasterGiven {
            reading: self.reading,
            engaged: self.engaged,
            releases: self.releasing,
            stops,
        };
        let done = master.tick(now, &given);
        judge.ticked(&done, master);
        checks.ticked(&MasterTicked {
            now,
            polled: now,
            given,
            done: &done,
            end: master,
        });
        let mut out = [0; DATAGRAM_MAX];
        let mut leave = Vec::new();
        while let Some(length) = master.poll_transmit(now, &mut out).unwrap() {
            judge.left(now, &out[..length]);
            checks.left(now, &out[..length]);
            leave.push(out[..length].to_vec());
            assert!(leave.len() <= 4, "a tick of the master sends without end");
        }
        self.seen |= 1 << (done.link as u64) | u64::from(done.rendered.in_contact()) << 4;
        leave
            .into_iter()
            .for_each(|bytes| self.path.offer(self.master_now, Side::Master, bytes));
    }

    fn tick_slave(&mut self) {
        let now = self.slave_now;
        let Ends {
            slave,
            slave_judge: judge,
            slave_checks: checks,
            ..
        } = &mut self.ends;
        let [_, stops] = self.stops;
        let given = SlaveGiven { stops, plant: None };
        let done = slave.tick(now, &given);
        if let Some(done) = &done {
            judge.ticked(done);
            self.seen |= u64::from(done.in_contact) << 5 | u64::from(done.update.is_some()) << 6;
        }
        checks.ticked(&SlaveTicked {
            now,
            polled: now,
            given,
            done: done.as_ref(),
            end: slave,
        });
        let mut out = [0; DATAGRAM_MAX];
        let mut leave = Vec::new();
        while let Some(length) = slave.poll_transmit(now, &mut out).unwrap() {
            judge.left(now, &out[..length]);
            checks.left(now, &out[..length]);
            leave.push(out[..length].to_vec());
            assert!(leave.len() <= 6, "a tick of the slave sends without end");
        }
        self.seen |= u64::from(slave.is_disengaged()) << 7;
        leave
            .into_iter()
            .for_each(|bytes| self.path.offer(self.master_now, Side::Slave, bytes));
    }

    /// What is due arrives.
    fn deliver(&mut self) {
        for (to, bytes) in self.path.take_due(self.master_now) {
            self.arrives(to, bytes);
        }
    }

    /// All that is on its way arrives at once: in order, the other way round, each twice, or every second.
    pub(super) fn flush(&mut self, how: u8) {
        let mut held = self.path.take_due(Time::MAX);
        if how & 1 != 0 {
            held.reverse();
        }
        for (number, (to, bytes)) in held.into_iter().enumerate() {
            match how & 6 {
                2 => {
                    self.arrives(to, bytes.clone());
                    self.arrives(to, bytes);
                }
                4 if number % 2 == 0 => {}
                _ => self.arrives(to, bytes),
            }
        }
    }

    /// A datagram arrives at one end, whoever sent it.
    pub(super) fn arrives(&mut self, to: Side, bytes: Vec<u8>) {
        let ends = &mut self.ends;
        match to {
            Side::Master => {
                ends.master.handle_datagram(self.master_now, &bytes);
                ends.master_checks.arrived(self.master_now, &bytes);
            }
            Side::Slave => {
                ends.slave.handle_datagram(self.slave_now, &bytes);
                ends.slave_checks.arrived(self.slave_now, &bytes);
            }
        }
    }

    /// A datagram of an enemy arrives, in the name of the other end.
    pub(super) fn arrives_forged(&mut self, to: Side, bytes: Vec<u8>) {
        self.enemy = true;
        self.arrives(to, bytes);
    }

    /// The slave's farewell comes, cut off behind so many bytes: a whole one ends the session.
    pub(super) fn farewell(&mut self, length: u8) {
        let report = [b'x'; 100];
        let farewell = StreamMessage::Farewell(Farewell {
            ending: Ending::Finished,
            report: &report,
        });
        let mut out = [0; STREAM_MESSAGE_MAX];
        let whole = farewell.encode(&mut out).unwrap();
        let read = StreamMessage::decode(&out[..whole.min(usize::from(length))], Side::Slave);
        self.releasing |= read.is_ok();
    }

    /// A new session, at a slave that remembers or is another process.
    pub(super) fn begin_again(&mut self, remembers: bool, hip: Vec2) {
        self.judge_all();
        let memory = remembers.then(|| self.ends.slave.slave().memory());
        // it may be kept as text between two processes
        let memory: Option<Memory> = memory
            .map(|memory| serde_json::from_str(&serde_json::to_string(&memory).unwrap()).unwrap());
        let hello = Hello { hip, ..self.hello };
        // as off the wire
        if let Ok(hello) = hello.accept() {
            self.hello = hello;
        }
        self.master_now += TICK * 300;
        self.slave_now += TICK * 300;
        let at = (self.master_now, self.slave_now);
        self.ends = Ends::new(
            &self.config,
            &self.hello,
            &self.device,
            self.commands,
            at,
            memory.as_ref(),
        );
        self.path.begin_again();
        (self.releasing, self.enemy) = (false, false);
        self.reading = self.ends.slave.slave().tool_at();
        self.velocity = Vec2::zeros();
        self.seen |= 1 << 8;
    }

    /// What was seen, as a sort of sequence.
    pub(super) fn seen(&self) -> u64 {
        self.seen
    }
}
