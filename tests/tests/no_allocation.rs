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

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::hint::black_box;

use mmt_client::device::DeviceProfile;
use mmt_client::limiter::ForceLimiter;
use mmt_client::link::{CommandConfig, FromSlave, MasterLink};
use mmt_client::master::Master;
use mmt_client::operator::Operator;
use mmt_client::operator::scripted::{Scripted, ScriptedConfig};
use mmt_server::estimator::{Estimator, EstimatorConfig, Measured, Seen};
use mmt_server::link::{Repeats, SlaveLink, SlaveLinkConfig};
use mmt_server::playout::{PlayoutBuffer, PlayoutConfig};
use mmt_server::shadow::Shadow;
use mmt_server::slave::{Slave, SlaveConfig, SlaveTick};
use mmt_server::trigger::{Trigger, TriggerConfig, TriggerInput};
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::sample::HipSample;
use mmt_shared::model::settings::Mode;
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{Architecture, Command, DATAGRAM_MAX, Label, Welcome};

/// The system's allocator, with a count of every call that takes memory.
struct Counting;

thread_local! {
    /// Calls by this thread: the test harness's other threads allocate as they please.
    static CALLS: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // a thread that is ending has no counter any more, and nobody who reads it
    let _ = CALLS.try_with(|calls| calls.set(calls.get() + 1));
}

#[allow(
    unsafe_code,
    reason = "the trait is unsafe; every call goes on to the system's allocator as it came"
)]
// SAFETY: counting touches no memory but a constant-initialized cell of the thread, and allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise is passed on unchanged.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise is passed on unchanged.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promise is passed on unchanged.
        unsafe { System.realloc(old, layout, size) }
    }

    unsafe fn dealloc(&self, old: *mut u8, layout: Layout) {
        // giving memory back takes a lock as well
        count();
        // SAFETY: the caller's promise is passed on unchanged.
        unsafe { System.dealloc(old, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What `work` returns, and the calls of the allocator that it made.
fn counted<T>(work: impl FnOnce() -> T) -> (T, u64) {
    let before = CALLS.with(Cell::get);
    let result = work();
    (result, CALLS.with(Cell::get) - before)
}

const TICKS: u64 = 10_000;

/// A datagram in a buffer of its own.
#[derive(Clone, Copy)]
struct Packet {
    bytes: [u8; DATAGRAM_MAX],
    length: usize,
}

impl Packet {
    fn as_slice(&self) -> &[u8] {
        &self.bytes[..self.length]
    }

    /// What `write` wrote, if it wrote anything.
    fn of(write: impl FnOnce(&mut [u8]) -> Option<usize>) -> Option<Self> {
        let mut bytes = [0; DATAGRAM_MAX];
        write(&mut bytes).map(|length| Self { bytes, length })
    }
}

/// Commands with everything that can be switched on.
fn commands() -> CommandConfig {
    CommandConfig {
        repeat_samples: 1,
        ..CommandConfig::default()
    }
}

/// The slave's end with everything that can be switched on.
fn slave_link() -> SlaveLinkConfig {
    SlaveLinkConfig {
        repeats: Repeats::recommended(),
        stretch_max: StretchMax::RECOMMENDED,
        samples_per_command: commands().samples_per_command,
        architecture: Architecture::Tdpa,
        scene_hz: 0,
    }
}

/// What the haptic thread runs.
struct Haptic {
    master: Master,
    link: MasterLink,
    operator: Operator,
    hand_force: Vec2,
    applied: u64,
    contact: u64,
}

impl Haptic {
    /// One tick: the update that came, the operator, the tick, the sample and what it fills.
    fn tick(&mut self, now: Time, down: Option<&Packet>) -> Option<Packet> {
        match down.and_then(|packet| self.link.handle(now, packet.as_slice())) {
            Some(FromSlave::Update(update)) => {
                self.master.apply(&update);
                self.applied += 1;
            }
            Some(FromSlave::Tool(tool)) => self.master.handle_tool_state(now, &tool),
            Some(FromSlave::Scene(_)) | None => {}
        }
        let elapsed = now.saturating_since(Time::ZERO);
        let view = self.master.view();
        let reading = self.operator.step(elapsed, &view, self.hand_force);
        let silence = self.link.end().silence(now);
        let tick = self.master.tick(now, reading, silence);
        self.hand_force = tick.hand_force;
        self.contact += u64::from(tick.rendered.in_contact());
        let link = &mut self.link;
        Packet::of(|out| link.send(now, tick.sample, tick.port, out).unwrap())
            .or_else(|| Packet::of(|out| link.heartbeat(now, out).unwrap()))
    }
}

/// Both sides, over a link that delivers at once.
struct Loop {
    haptic: Haptic,
    slave: Slave,
    slave_link: SlaveLink,
}

impl Loop {
    fn new(mode: Mode) -> Self {
        let device = DeviceProfile::default();
        let mut slave = Slave::try_new(&SlaveConfig::of_mode(mode), device.coupling()).unwrap();
        let welcome = Welcome {
            settings: *slave.settings(),
            state: *slave.state(),
            scheme: Label::clipped("any"),
            program: Label::clipped("test"),
        };
        let limiter = ForceLimiter::try_new(device.limits()).unwrap();
        let master = Master::with_architecture(&welcome, limiter, Architecture::Tdpa);
        let scripted = Scripted::try_new(ScriptedConfig::default(), master.view()).unwrap();
        let operator = Operator::Scripted(Box::new(scripted));
        slave.start_at(operator.start());
        let haptic = Haptic {
            master,
            link: MasterLink::new(Time::ZERO, device.coupling(), commands()),
            operator,
            hand_force: Vec2::zeros(),
            applied: 0,
            contact: 0,
        };
        Self {
            haptic,
            slave,
            slave_link: SlaveLink::new(Time::ZERO, slave_link()),
        }
    }

    /// The slave's tick: what it read, what it did, what it sends.
    fn slave_tick(&mut self, now: Time, up: Option<&Packet>) -> Slaved {
        let command = up.and_then(|packet| self.slave_link.handle(now, packet.as_slice()));
        if let Some(command) = &command {
            for (sample, newest) in self.slave_link.samples(command) {
                self.slave.handle_sample(now, &sample, newest);
            }
            self.slave.stretch(self.slave_link.end().stretch());
            if let Some(port) = &command.port {
                self.slave.handle_hand_port(port);
            }
        }
        let tick = self.slave.tick(now);
        let update = tick.and_then(|tick| tick.update);
        let tool = tick.and_then(|tick| self.slave.tool_state(&tick));
        let link = &mut self.slave_link;
        let down = update
            .and_then(|update| Packet::of(|out| link.send_update(now, &update, out).ok()))
            .or_else(|| {
                tool.and_then(|tool| Packet::of(|out| link.send_tool(now, &tool, out).ok()))
            })
            .or_else(|| Packet::of(|out| link.repeat(now, out).unwrap()))
            .or_else(|| Packet::of(|out| link.heartbeat(now, out).unwrap()));
        Slaved {
            command,
            tick,
            down,
        }
    }
}

/// What a tick of the slave came to.
struct Slaved {
    command: Option<Command>,
    tick: Option<SlaveTick>,
    down: Option<Packet>,
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
    let mut sides = Loop::new(Mode::Recommended);
    let (_, planted) = counted(|| {
        let packet = sides.haptic.tick(Time::ZERO, None);
        black_box(format!("{:?}", sides.haptic.hand_force));
        packet.map(|packet| packet.length)
    });
    assert!(planted > 0);
}

#[test]
fn the_haptic_tick_never_allocates() {
    for mode in [Mode::Recommended, Mode::Paper] {
        let mut sides = Loop::new(mode);
        let (mut now, mut down) = (Time::ZERO, None);
        for tick in 0..TICKS {
            now += TICK;
            let (up, calls) = counted(|| sides.haptic.tick(now, down.as_ref()));
            assert_eq!(calls, 0, "{mode:?}: allocator called in tick {tick}");
            down = sides.slave_tick(now, up.as_ref()).down;
        }
        let haptic = &sides.haptic;
        let (contact, applied) = (haptic.contact, haptic.applied);
        assert!(contact > TICKS / 5, "{mode:?}: {contact} ticks of contact");
        assert!(applied > 15, "{mode:?}: {applied} updates applied");
        assert!(haptic.operator.pushes_completed() >= Some(1), "{mode:?}");
    }
}

/// The slave's parts, fed beside a slave with what that slave met.
struct Parts {
    estimators: [Estimator; 2],
    trigger: Trigger,
    shadow: Shadow,
    playout: PlayoutBuffer,
    link: SlaveLink,
    decided: u64,
}

impl Parts {
    fn of(slave: &Slave) -> Self {
        let coupling = slave.settings().coupling;
        let estimator = |mode| Estimator::new(&EstimatorConfig::of_mode(mode, coupling));
        Self {
            estimators: [estimator(Mode::Paper), estimator(Mode::Recommended)],
            trigger: Trigger::new(TriggerConfig::of_mode(Mode::Recommended)),
            shadow: Shadow::new(*slave.settings(), *slave.state()),
            playout: PlayoutBuffer::try_new(PlayoutConfig::default()).unwrap(),
            link: SlaveLink::new(Time::ZERO, slave_link()),
            decided: 0,
        }
    }

    fn take_in(&mut self, now: Time, up: Option<&Packet>) -> Option<HipSample> {
        let command = up.and_then(|packet| self.link.handle(now, packet.as_slice()))?;
        let samples = command.samples.as_slice();
        for sample in samples {
            self.playout.push(now, sample);
            self.shadow.acknowledge(sample, command.newest_update);
        }
        command.samples.last().copied()
    }

    fn step(&mut self, now: Time, met: &SlaveTick, measured: &Measured) -> Option<Packet> {
        self.playout.advance(now).unwrap();
        let [_, estimate] = self.estimators.each_mut().map(|e| e.step(measured));
        self.shadow.step(met.stamp, met.stamp, |_| Some(met.tool));
        let rendered = *self.shadow.rendered();
        let input = TriggerInput {
            f_s: met.f_s,
            f_m: rendered.force,
            slave_in_contact: met.in_contact,
            shadow_in_contact: rendered.in_contact(),
            sticking: estimate.sticking,
            speed: estimate.speed,
            acceleration: estimate.acceleration,
            force_deviation: 0.0,
            params: self.shadow.ahead().state().params,
            shift: Vec2::zeros(),
            turn: 0.0,
        };
        self.decided += u64::from(self.trigger.step(now, &input).is_some());
        let link = &mut self.link;
        let Some(update) = met.update else {
            return Packet::of(|out| link.repeat(now, out).unwrap());
        };
        self.shadow.send(&update);
        Packet::of(|out| link.send_update(now, &update, out).ok())
    }
}

#[test]
fn the_slaves_own_parts_never_allocate() {
    let mut sides = Loop::new(Mode::Recommended);
    let mut parts = Parts::of(&sides.slave);
    let (mut now, mut down) = (Time::ZERO, None);
    let (mut samples, mut updates) = (0, 0);
    for tick in 0..TICKS {
        now += TICK;
        let up = sides.haptic.tick(now, down.as_ref());
        let slaved = sides.slave_tick(now, up.as_ref());
        let (sample, calls) = counted(|| parts.take_in(now, up.as_ref()));
        assert_eq!(calls, 0, "allocator called when tick {tick} read a command");
        assert_eq!(
            sample,
            slaved.command.and_then(|c| c.samples.last().copied())
        );
        samples += u64::from(sample.is_some());
        if let Some(met) = slaved.tick {
            let observer = sides.slave.observer();
            let seen = Seen {
                centre: observer.pose().position,
                turning: observer.twist().angular,
                body_turning: observer.body_rate(),
                side: observer.footprint().mean_side(),
            };
            let measured = Measured {
                tool: met.tool,
                force: met.f_s,
                normal: sides.slave.observer().contact().map(|t| t.inward),
                seen: Some(seen),
            };
            let (sent, calls) = counted(|| parts.step(now, &met, &measured));
            assert_eq!(calls, 0, "allocator called in tick {tick}");
            updates += u64::from(sent.is_some());
        }
        down = slaved.down;
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
