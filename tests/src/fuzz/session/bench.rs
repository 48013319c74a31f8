//! Two ends, what lies between them, and their clocks.

use std::collections::VecDeque;
use std::time::Duration;

use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceProfile;
use mmt_client::end::{MasterEnd, MasterGiven};
use mmt_client::failsafe::LinkState;
use mmt_client::limiter::ForceLimiter;
use mmt_client::master::Master;
use mmt_lab::check::{
    MasterAbout, MasterChecks, MasterTicked, SlaveAbout, SlaveChecks, SlaveTicked,
};
use mmt_server::end::{SlaveEnd, SlaveGiven, session_config};
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
use super::judge::{MasterJudge, SlaveJudge};

/// Datagrams of each side that an eavesdropper has.
const CAPTURED: usize = 64;
/// What the network holds back at most.
const HELD: usize = 256;

/// What becomes of datagrams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Network {
    /// They arrive at once.
    Direct,
    /// Those of one side are lost, or those of both.
    Silent(bool, bool),
    /// They are held back.
    Holds,
    /// They take so long.
    Slow(Duration),
}

impl Network {
    pub(super) fn of(kind: u8, number: u8) -> Self {
        match kind % 6 {
            0 => Self::Direct,
            1 => Self::Silent(true, false),
            2 => Self::Silent(false, true),
            3 => Self::Silent(true, true),
            4 => Self::Holds,
            _ => Self::Slow(Duration::from_millis(u64::from(number) * 2)),
        }
    }
}

/// The ends of a session with their judges.
struct Ends {
    master: MasterEnd,
    slave: SlaveEnd,
    master_judge: MasterJudge,
    slave_judge: SlaveJudge,
    master_checks: MasterChecks,
    slave_checks: SlaveChecks,
}

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
    pub(super) network: Network,
    /// On their way: to whom, when by the master's clock, what.
    held: VecDeque<(Side, Time, Vec<u8>)>,
    /// What left in this session, and in those before.
    left: [VecDeque<Vec<u8>>; 2],
    earlier: [VecDeque<Vec<u8>>; 2],
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
            network: Network::Direct,
            held: VecDeque::new(),
            left: Default::default(),
            earlier: Default::default(),
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
        if self.releasing {
            master.release();
        }
        let [stops, _] = self.stops;
        master.stop(stops);
        master.hold(self.engaged);
        let done = master.tick(now, self.reading);
        judge.ticked(&done, master);
        let given = MasterGiven {
            reading: self.reading,
            engaged: self.engaged,
            releases: self.releasing,
            stops,
        };
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
            .for_each(|bytes| self.offer(Side::Master, bytes));
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
        slave.stop(stops);
        let done = slave.tick(now);
        if let Some(done) = &done {
            judge.ticked(done);
            self.seen |= u64::from(done.in_contact) << 5 | u64::from(done.update.is_some()) << 6;
        }
        let given = SlaveGiven { stops, plant: None };
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
            .for_each(|bytes| self.offer(Side::Slave, bytes));
    }

    /// The network takes a datagram.
    fn offer(&mut self, from: Side, bytes: Vec<u8>) {
        let captured = &mut self.left[usize::from(from == Side::Slave)];
        if captured.len() == CAPTURED {
            captured.pop_front();
        }
        captured.push_back(bytes.clone());
        let due = match self.network {
            Network::Direct => self.master_now,
            Network::Silent(up, down) => {
                let lost = if from == Side::Master { up } else { down };
                if lost {
                    return;
                }
                self.master_now
            }
            Network::Holds => Time::MAX,
            Network::Slow(by) => self.master_now + by,
        };
        if self.held.len() == HELD {
            self.held.pop_front();
        }
        self.held.push_back((from.other(), due, bytes));
    }

    /// What is due arrives.
    fn deliver(&mut self) {
        for _ in 0..self.held.len() {
            let Some((to, due, bytes)) = self.held.pop_front() else {
                return;
            };
            if due <= self.master_now {
                self.arrives(to, bytes);
            } else {
                self.held.push_back((to, due, bytes));
            }
        }
    }

    /// All that is on its way arrives at once: in order, the other way round, each twice, or every second.
    pub(super) fn flush(&mut self, how: u8) {
        let mut held: Vec<_> = self.held.drain(..).collect();
        if how & 1 != 0 {
            held.reverse();
        }
        for (number, (to, _, bytes)) in held.into_iter().enumerate() {
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

    /// A datagram that left this side, the how-manieth from the newest.
    pub(super) fn captured(&self, from: Side, which: u8) -> Option<Vec<u8>> {
        chosen(&self.left[usize::from(from == Side::Slave)], which)
    }

    /// The same of a session that is over.
    pub(super) fn of_earlier(&self, from: Side, which: u8) -> Option<Vec<u8>> {
        chosen(&self.earlier[usize::from(from == Side::Slave)], which)
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
        self.held.clear();
        self.earlier = std::mem::take(&mut self.left);
        (self.releasing, self.enemy) = (false, false);
        self.reading = self.ends.slave.slave().tool_at();
        self.velocity = Vec2::zeros();
        self.seen |= 1 << 8;
    }

    /// What holds of the session as a whole.
    pub(super) fn judge_all(&self) {
        let ends = &self.ends;
        MasterJudge::reports(&ends.master);
        SlaveJudge::reports(&ends.slave);
        for verdict in [ends.master_checks.verdict(), ends.slave_checks.verdict()] {
            assert!(verdict.holds(), "{verdict}");
        }
    }

    /// Everybody behaves again: the session works, or it is over after two seconds at either end, as it is where an enemy used
    /// up its numbers or set an emergency stop with one that is yet to come, and the next one works.
    pub(super) fn recover(&mut self) {
        self.network = Network::Direct;
        (self.stops, self.engaged, self.velocity) = ([false; 2], true, Vec2::zeros());
        self.rest(2300);
        let over = self.releasing
            || self.ends.master.channel().silence(self.master_now) > Duration::from_secs(1);
        if over {
            // the ramp
            self.rest(200);
        }
        let released = self.ends.master.master().limiter().at_rest();
        let stopped = self.ends.are_stopped();
        assert!(
            !stopped || self.enemy,
            "an emergency stop that nobody holds"
        );
        // a master that never had an answer waits longer for one: the path may be of 4 s
        let unheard = self.ends.slave.channel().silence(self.slave_now) > Duration::from_secs(2);
        if over || released || unheard || stopped || self.ends.slave.is_disengaged() {
            assert!(
                released || !over,
                "the hand of a session that is over is not released"
            );
            self.begin_again(true, Vec2::new(-0.5, 0.1));
            for _ in 0..200 {
                self.tick();
            }
        }
        self.works();
    }

    /// The hand is where the tool is.
    fn rest(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.reading = self.ends.slave.slave().tool_at();
            self.tick();
        }
    }

    /// Samples come through, updates would, and the hand is held.
    fn works(&mut self) {
        let before = self.ends.slave.counts().samples;
        let mut link = LinkState::Released;
        // a command of 32 samples takes 96 ms where congestion leaves two of three samples out
        for _ in 0..120 {
            self.tick();
            link = LinkState::of_silence(self.ends.master.channel().silence(self.master_now));
        }
        let ends = &self.ends;
        // an enemy that used up the numbers of this session has ended it as far as it could
        assert_eq!(link, LinkState::Fresh, "the link does not come back");
        assert!(ends.slave.counts().samples > before, "no samples come");
        assert!(
            !ends.slave.is_disengaged() && !ends.are_stopped(),
            "the tool stands"
        );
        assert!(
            ends.master.master().limiter().engaged(),
            "the hand is not held"
        );
    }

    /// What was seen, as a sort of sequence.
    pub(super) fn seen(&self) -> u64 {
        self.seen
    }
}

fn chosen(of: &VecDeque<Vec<u8>>, which: u8) -> Option<Vec<u8>> {
    let back = usize::from(which) % of.len().max(1);
    of.len()
        .checked_sub(1 + back)
        .and_then(|at| of.get(at))
        .cloned()
}

impl Ends {
    /// Whether an emergency stop is set, as either end has it.
    fn are_stopped(&self) -> bool {
        self.slave.stopped_by().is_some() || self.master.stopped_by().is_some()
    }

    /// Both ends of a session that begins now, after the welcome has crossed the wire.
    fn new(
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
