//! The haptic tick and the slave's own parts never allocate after the start.
//!
//! An allocator that counts stands in for the system's in this test alone. The two sides run in a closed
//! loop over a perfect link, as the live threads run them; only what is to be judged is counted.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::disallowed_macros,
    reason = "a test may panic, and counts by thread"
)]

mod counting_allocator;

use std::hint::black_box;
use std::time::Duration;

use mmt_client::again::MasterSetting;
use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceProfile;
use mmt_client::io::hand_events::{HandEventSender, HandEvents, hand_events};
use mmt_client::io::haptic::HapticLoop;
use mmt_client::io::{MasterLive, record};
use mmt_client::operator::Operator;
use mmt_client::operator::pointer::{Driver, HandEvent, HandTuning, Person, PointerSample};
use mmt_client::operator::scripted::{Scripted, ScriptedConfig};
use mmt_client::path::PathRecorder;
use mmt_server::end::{SlaveEnd, SlaveEndConfig, SlaveGiven};
use mmt_server::estimator::{Estimator, EstimatorConfig, Measured, Seen, ToolGives};
use mmt_server::playout::{PlayoutBuffer, PlayoutConfig};
use mmt_server::repeats::Repeats;
use mmt_server::shadow::Shadow;
use mmt_server::slave::{Slave, SlaveConfig, SlaveTick};
use mmt_server::trigger::{Trigger, TriggerConfig, TriggerInput};
use mmt_shared::channel::datagram_channel::DatagramChannel;
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::io::clock::Clock;
use mmt_shared::io::loop_thread::{self, Frame, LoopHandle, LoopSide};
use mmt_shared::io::record::Recorder;
use mmt_shared::io::schedule::Tick;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::sample::HipSample;
use mmt_shared::model::settings::Mode;
use mmt_shared::model::tool::TOOL_FORCE_MAX_N;
use mmt_shared::pairing::Token;
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{DATAGRAM_MAX, Label, Message, Side, Welcome};

use counting_allocator::counted;

const TICKS: u64 = 10_000;

/// Commands with everything that can be switched on.
fn commands() -> CommandConfig {
    CommandConfig {
        repeat_samples: 1,
        ..CommandConfig::default()
    }
}

/// The slave's end with everything that can be switched on.
fn slave_end() -> SlaveEndConfig {
    SlaveEndConfig {
        repeats: Repeats::recommended(),
        stretch_max: StretchMax::RECOMMENDED,
        samples_per_command: commands().samples_per_command,
        architecture: Architecture::Mmt,
        scene_hz: 50,
    }
}

/// Both sides over a link that delivers at once: the master's loop with the rings, frames and record of a live session.
struct Loop {
    haptic: HapticLoop,
    side: LoopSide<MasterLive>,
    network: LoopHandle<MasterLive, ()>,
    slave: SlaveEnd,
    /// What the master has sent in this tick.
    up: Vec<Frame>,
    contact: u64,
    _runtime: tokio::runtime::Runtime,
    _folder: tempfile::TempDir,
}

impl Loop {
    fn new(mode: Mode, architecture: Architecture) -> Self {
        let scripted = |scripted| Operator::Scripted(Box::new(scripted));
        Self::operated_by(scripted, None, mode, architecture)
    }

    /// One whose hand a person at a pointer has, who does what is put into the ring.
    fn held_by_a_person() -> (HandEventSender, Self) {
        let (events, to_loop) = hand_events(64);
        let person = |scripted| {
            let person = Person::new(scripted, Driver::Pointer, HandTuning::POINTER);
            Operator::Person(Box::new(person))
        };
        let (mode, architecture) = (Mode::Recommended, Architecture::Mmt);
        let sides = Self::operated_by(person, Some(to_loop), mode, architecture);
        (events, sides)
    }

    fn operated_by(
        operator: impl Fn(Scripted) -> Operator,
        events: Option<HandEvents>,
        mode: Mode,
        architecture: Architecture,
    ) -> Self {
        let mut runtime = tokio::runtime::Builder::new_current_thread();
        let runtime = runtime.enable_io().build().unwrap();
        let entered = runtime.enter();
        let device = DeviceProfile::default();
        let mut slave = Slave::try_new(&SlaveConfig::of_mode(mode), device.coupling()).unwrap();
        let welcome = Welcome {
            settings: *slave.settings(),
            state: *slave.state(),
            tool: Vec2::new(-0.45, 0.0),
            tool_force_max_n: TOOL_FORCE_MAX_N,
            resume: Token::new([0; 32]),
            scheme: Label::clipped("any"),
            program: Label::clipped("test"),
        };
        let setting = MasterSetting {
            began: Time::ZERO,
            welcome,
            architecture,
            limits: device.limits(),
            commands: commands().for_architecture(architecture),
        };
        let end = setting.end().unwrap();
        let scripted = Scripted::try_new(ScriptedConfig::default(), end.master().view()).unwrap();
        let operator = operator(scripted);
        slave.start_at(operator.start());
        let folder = tempfile::tempdir().unwrap();
        let recorder = Recorder::create(&folder.path().join("a.mcap")).unwrap();
        let record = record::begin(&recorder, Clock::start(), &setting, &());
        let (network, side, _) = loop_thread::pair(&MasterLive::default()).unwrap();
        drop(entered);
        let config = SlaveEndConfig {
            architecture,
            ..slave_end()
        };
        Self {
            haptic: HapticLoop::new(end, operator, None)
                .observed_by(None, Some(PathRecorder::with_room()))
                .operated_through(events)
                .recorded(record),
            side,
            network,
            slave: SlaveEnd::new(Time::ZERO, slave, config),
            up: Vec::new(),
            contact: 0,
            _runtime: runtime,
            _folder: folder,
        }
    }

    /// The haptic tick: frames in, the operator, the tick, frames out.
    fn haptic_tick(&mut self, now: Time) {
        let tick = Tick {
            index: now.as_nanos() / 1_000_000,
            deadline: now,
            skipped: 0,
            lateness: Duration::ZERO,
        };
        let ended = self.haptic.tick(tick, &mut self.side, || now).is_break();
        assert!(!ended, "nobody ends it");
        let model = self.haptic.end().master().model();
        self.contact += u64::from(model.rendered().in_contact());
    }

    /// The slave's tick: what it read, what it did; what it sends is on its way to the haptic loop.
    fn slave_tick(&mut self, now: Time) -> Option<SlaveTick> {
        self.up.clear();
        while let Some(frame) = self.network.next_departure() {
            self.slave.handle_datagram(now, frame.bytes());
            self.up.push(frame);
        }
        let tick = self.slave.tick(now, &SlaveGiven::default());
        let mut out = [0; DATAGRAM_MAX];
        while let Some(length) = self.slave.poll_transmit(now, &mut out).unwrap() {
            self.network.deliver(now, &out[..length]);
        }
        tick
    }
}

#[test]
fn the_counter_catches_planted_allocations() {
    let boxed = || drop(black_box(Box::new(7_u64)));
    assert_eq!(counted(boxed).1, 2, "taken and given back");
    let mut grown: Vec<u64> = Vec::with_capacity(4);
    let grow = || grown.extend(black_box([1, 2, 3, 4, 5]));
    assert!(counted(grow).1 > 0, "a vector that outgrows its room");
    assert!(counted(|| black_box(vec![0_u8; 64])).1 > 0, "zeroed memory");
    assert_eq!(counted(|| black_box(7)).1, 0, "nothing is nothing");

    // one in a haptic tick is seen as well
    let mut sides = Loop::new(Mode::Recommended, Architecture::Mmt);
    let (_, planted) = counted(|| {
        sides.haptic_tick(Time::from_millis(1));
        black_box(format!("{:?}", sides.contact));
    });
    assert!(planted > 0);
}

#[test]
fn the_haptic_tick_never_allocates() {
    for (mode, architecture) in [
        (Mode::Recommended, Architecture::Mmt),
        (Mode::Paper, Architecture::Mmt),
        (Mode::Recommended, Architecture::Tdpa),
    ] {
        let mut sides = Loop::new(mode, architecture);
        let mut now = Time::ZERO;
        for tick in 0..TICKS {
            now += TICK;
            let ((), calls) = counted(|| sides.haptic_tick(now));
            assert_eq!(calls, 0, "{mode:?}: allocator called in tick {tick}");
            sides.slave_tick(now);
        }
        let applied = sides.haptic.end().master().applied().iter().sum::<u64>();
        let contact = sides.contact;
        assert!(contact > TICKS / 5, "{mode:?}: {contact} ticks of contact");
        assert!(applied > 15, "{mode:?}: {applied} updates applied");
        assert!(sides.haptic.end().scene().is_some());
        let pushes = sides.network.snapshot().pushes;
        assert!(pushes >= Some(1), "{mode:?}: {pushes:?}");
    }
}

#[test]
fn a_tick_that_a_pointer_feeds_never_allocates() {
    let (mut events, mut sides) = Loop::held_by_a_person();
    let mut now = Time::ZERO;
    for tick in 0..TICKS {
        now += TICK;
        // presses, pushes into the box and lets go, again and again
        let (part, page_s) = (tick % 2000, 50.0 + tick as f64 * 1e-3);
        let sample = PointerSample {
            page_s,
            at: Vec2::new(2e-4 * part as f64, 0.0),
        };
        let event = match part {
            0 => HandEvent::Press(sample),
            1500 => HandEvent::Release,
            _ => HandEvent::Move(sample),
        };
        events.send(event);
        let ((), calls) = counted(|| sides.haptic_tick(now));
        assert_eq!(calls, 0, "allocator called in tick {tick}");
        sides.slave_tick(now);
    }
    assert!(sides.contact > TICKS / 5, "{} ticks", sides.contact);
}

/// The slave's parts, fed beside a slave with what that slave met.
struct Parts {
    estimators: [Estimator; 3],
    trigger: Trigger,
    shadow: Shadow,
    playout: PlayoutBuffer,
    channel: DatagramChannel,
    decided: u64,
}

impl Parts {
    fn of(slave: &Slave) -> Self {
        let coupling = slave.settings().coupling;
        let estimator = |mode, gives| {
            Estimator::new(
                &EstimatorConfig::of_mode(mode, coupling),
                coupling,
                8.0,
                gives,
            )
        };
        Self {
            estimators: [
                estimator(Mode::Paper, ToolGives::No),
                estimator(Mode::Recommended, ToolGives::BySlave),
                estimator(Mode::Recommended, ToolGives::No),
            ],
            trigger: Trigger::new(TriggerConfig::of_mode(Mode::Recommended)),
            shadow: Shadow::new(
                *slave.settings(),
                *slave.state(),
                slave.tool_force().max_n(),
            ),
            playout: PlayoutBuffer::try_new(PlayoutConfig::default()).unwrap(),
            channel: DatagramChannel::new(Side::Slave, Time::ZERO),
            decided: 0,
        }
    }

    fn take_in(&mut self, now: Time, up: &Frame) -> Option<HipSample> {
        let Message::Command(command) = self.channel.handle(now, up.bytes())?.message else {
            return None;
        };
        let samples = command.samples.as_slice();
        for sample in samples {
            self.playout.push(now, sample);
            self.shadow.acknowledge(sample, command.newest_update);
        }
        command.samples.last().copied()
    }

    fn step(&mut self, now: Time, met: &SlaveTick, measured: &Measured) -> Option<usize> {
        self.playout.advance(now).unwrap();
        let [.., estimate] = self.estimators.each_mut().map(|e| e.step(measured));
        self.shadow.step(met.stamp, met.stamp, |_| Some(met.tool));
        let rendered = *self.shadow.rendered();
        let input = TriggerInput {
            f_s: met.f_s,
            f_m: rendered.force,
            noise_n: 0.0,
            slave_in_contact: met.in_contact,
            shadow_in_contact: rendered.in_contact(),
            hip_stands: false,
            sticking: estimate.sticking,
            speed: estimate.speed,
            acceleration: estimate.acceleration,
            force_deviation: 0.0,
            params: self.shadow.ahead().state().params,
            only_friction_holds: false,
            shift: Vec2::zeros(),
            shift_deviation: 0.0,
            turn: 0.0,
            turn_deviation: 0.0,
        };
        self.decided += u64::from(self.trigger.step(now, &input).is_some());
        let update = met.update?;
        self.shadow.send(&update);
        let mut out = [0; DATAGRAM_MAX];
        let sent = self
            .channel
            .encode(now, Message::Update((&update).into()), &mut out);
        sent.ok().flatten()
    }
}

#[test]
fn the_slaves_own_parts_never_allocate() {
    let mut sides = Loop::new(Mode::Recommended, Architecture::Tdpa);
    let mut parts = Parts::of(sides.slave.slave());
    let mut now = Time::ZERO;
    let (mut samples, mut updates) = (0, 0);
    for tick in 0..TICKS {
        now += TICK;
        sides.haptic_tick(now);
        let met = sides.slave_tick(now);
        for frame in &sides.up {
            let (sample, calls) = counted(|| parts.take_in(now, frame));
            assert_eq!(calls, 0, "allocator called when tick {tick} read a command");
            samples += u64::from(sample.is_some());
        }
        if let Some(met) = met {
            let observer = sides.slave.slave().observer();
            let seen = Seen {
                centre: observer.pose().position,
                turning: observer.twist().angular,
                body_turning: observer.body_rate(),
                side: observer.footprint().mean_side(),
            };
            let measured = Measured {
                tool: met.tool,
                force: met.f_s,
                back: Vec2::zeros(),
                force_noise_n: 0.0,
                held_back: false,
                normal: observer.contact().map(|t| t.inward),
                seen: Some(seen),
            };
            let (sent, calls) = counted(|| parts.step(now, &met, &measured));
            assert_eq!(calls, 0, "allocator called in tick {tick}");
            updates += u64::from(sent.is_some());
        }
    }
    assert_eq!(samples, TICKS, "every command was read, each with a sample");
    assert!(updates > 15, "{updates} updates written");
    assert!(parts.decided > 15, "{} decisions to send", parts.decided);
    for estimator in &parts.estimators {
        assert!(estimator.estimate().samples > 1000, "the estimators worked");
    }
}

#[test]
fn an_emulated_link_carries_packets_without_allocating() {
    for words in [
        "delay 50ms 5ms 50% distribution paretonormal loss gemodel 1% 10% duplicate 5% corrupt 5%",
        "delay cdf 1ms@0%,3ms@50%,250ms@100% tau 100ms loss burst 5% 40ms reorder 5% order free",
        "delay 5ms rate 64kbit 28 queue 100ms 50p codel limit 100 outage 1s for 50ms every 3s",
        "delay 50ms loss state 1%; at 1s over 2s delay 80ms 9ms rate 1mbit; loop 5s",
    ] {
        let config = words.parse().unwrap();
        let mut link = mmt_netem::Link::try_new(config, 1, mmt_netem::LinkId::UP).unwrap();
        let ((), calls) = counted(|| {
            for packet in 0..20_000 {
                let now = Time::from_millis(packet);
                while let Some(out) = link.poll(now) {
                    black_box(out);
                }
                link.offer(now, mmt_netem::Packet::new(100, ()));
            }
        });
        assert_eq!(calls, 0, "{words}");
    }
}
