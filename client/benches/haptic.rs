//! One haptic tick of the master: what the operator sees, the operator, the model, the limiter, the
//! sample packed for the slave. Budget 10 µs, no allocation; applying an update is part of a tick.

#![allow(missing_docs, reason = "the criterion macros make undocumented items")]
#![allow(clippy::unwrap_used, reason = "a bench is a test: it may panic")]

use std::collections::VecDeque;
use std::hint::black_box;
use std::time::Duration;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceProfile;
use mmt_client::end::{MasterEnd, MasterGiven};
use mmt_client::failsafe::LinkState;
use mmt_client::limiter::ForceLimiter;
use mmt_client::master::Master;
use mmt_client::operator::Operator;
use mmt_client::operator::scripted::{Scripted, ScriptedConfig};
use mmt_shared::channel::datagram_channel::DatagramChannel;
use mmt_shared::fixtures::square_at_rest;
use mmt_shared::io::loop_thread::Frame;
use mmt_shared::model::geometry::{Face, Vec2};
use mmt_shared::model::local_model::BodyState;
use mmt_shared::model::params::ModelState;
use mmt_shared::model::settings::Mode;
use mmt_shared::model::tool::TOOL_FORCE_MAX_N;
use mmt_shared::model::update::{Cause, Update};
use mmt_shared::pairing::Token;
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{DATAGRAM_MAX, Label, Message, Side, Welcome};

/// A master and an operator who pushes its model: no slave is needed for the hand to feel something.
struct Haptic {
    end: MasterEnd,
    slave: DatagramChannel,
    /// What is on its way to the slave, with when it arrives.
    on_way: VecDeque<Frame>,
    /// How long the way takes.
    path: Duration,
    operator: Operator,
    hand_force: Vec2,
    now: Time,
    contact: u64,
}

impl Haptic {
    fn new(mode: Mode) -> Self {
        Self::over(mode, Duration::ZERO)
    }

    fn over(mode: Mode, path: Duration) -> Self {
        let device = DeviceProfile::default();
        let coupling = device.coupling();
        let welcome = Welcome {
            settings: mode.model_settings(coupling),
            state: square_at_rest(0.7, 3.0, 2.06, 0.36),
            tool: Vec2::new(-0.45, 0.0),
            tool_force_max_n: TOOL_FORCE_MAX_N,
            resume: Token::new([0; 32]),
            scheme: Label::clipped("any"),
            program: Label::clipped("bench"),
        };
        let limiter = ForceLimiter::try_new(device.limits()).unwrap();
        let master = Master::new(&welcome, limiter);
        let scripted = Scripted::try_new(ScriptedConfig::default(), master.view()).unwrap();
        Self {
            end: MasterEnd::new(Time::ZERO, master, CommandConfig::default()),
            slave: DatagramChannel::new(Side::Slave, Time::ZERO),
            on_way: VecDeque::with_capacity(16),
            path,
            operator: Operator::Scripted(Box::new(scripted)),
            hand_force: Vec2::zeros(),
            now: Time::ZERO,
            contact: 0,
        }
    }

    /// A message of the slave arrives.
    fn receive(&mut self, message: Message) {
        let mut out = [0; DATAGRAM_MAX];
        let length = self.slave.encode(self.now, message, &mut out);
        let length = length.unwrap().unwrap();
        self.end
            .handle_datagram(self.now, out.get(..length).unwrap());
    }

    /// What the model is, as an update would carry it.
    fn state(&self) -> ModelState {
        let BodyState {
            params,
            footprint,
            pose,
            twist,
        } = *self.end.master().model().state();
        let coupling = &self.end.master().model().settings().coupling;
        ModelState::try_new(params, footprint, pose, twist, coupling).unwrap()
    }

    fn tick(&mut self, out: &mut [u8]) -> Option<usize> {
        self.now += TICK;
        let elapsed = self.now.saturating_since(Time::ZERO);
        let view = self.end.update_model();
        let reading = self.operator.step(elapsed, &view, self.hand_force);
        let phase_ms = self.now.as_nanos() / 1_000_000 % 100;
        if phase_ms == 0 {
            // a silent link would release the hand
            self.receive(Message::Heartbeat);
        }
        let tick = self.end.tick(self.now, &MasterGiven::held_at(reading));
        self.hand_force = tick.hand_force;
        self.contact += u64::from(tick.rendered.in_contact());
        let sent = self.end.poll_transmit(self.now, out).unwrap();
        if let Some(length) = sent.filter(|_| phase_ms >= 90) {
            let bytes = out.get(..length).unwrap();
            self.on_way
                .push_back(Frame::new(self.now + self.path, bytes));
        }
        while let Some(frame) = self.on_way.pop_front_if(|frame| frame.at <= self.now) {
            // the heartbeat answers it: one that answers nothing is silence as well
            self.slave.handle(self.now, frame.bytes());
        }
        sent
    }

    /// Whether the hand is held: what a released one costs is not what is measured.
    fn is_held(&self) -> bool {
        let silence = self.end.channel().silence(self.now);
        LinkState::of_silence(silence) == LinkState::Fresh
    }
}

/// The modes and their names in the benches.
const MODES: [(&str, Mode); 2] = [("recommended", Mode::Recommended), ("paper", Mode::Paper)];

fn tick(criterion: &mut Criterion) {
    let mut out = [0; DATAGRAM_MAX];
    for (name, mode) in MODES {
        let mut haptic = Haptic::new(mode);
        criterion.bench_function(&format!("haptic/tick/{name}"), |bencher| {
            bencher.iter(|| haptic.tick(black_box(&mut out)));
        });
        assert!(haptic.is_held());
    }
}

fn apply(criterion: &mut Criterion) {
    let mut out = [0; DATAGRAM_MAX];
    for (name, mode) in MODES {
        let mut haptic = Haptic::new(mode);
        // long enough for the history to be full, in which the answered sample is searched
        for _ in 0..10_000 {
            haptic.tick(&mut out);
        }
        assert!(haptic.contact > 0, "nothing was touched");
        let update = Update {
            sequence: 1,
            cause: Cause::Deadband,
            answers: haptic.now - Duration::from_millis(100),
            touched_face: Some(Face::West),
            state: haptic.state(),
        };
        assert!(haptic.is_held());
        criterion.bench_function(&format!("haptic/apply/{name}"), |bencher| {
            // a second one would only wait for the first
            bencher.iter_batched_ref(
                || haptic.end.master().clone(),
                |master| master.apply(black_box(&update)),
                BatchSize::LargeInput,
            );
        });
    }
}

/// An update that answers a sample of a second ago, and the ticks until its replay has caught up: what a
/// round trip of a second costs, sliced over 21 ticks.
fn replay(criterion: &mut Criterion) {
    let mut out = [0; DATAGRAM_MAX];
    // over a shorter way an update that answers a sample of a second ago would be too old
    let mut haptic = Haptic::over(Mode::Recommended, Duration::from_millis(750));
    for _ in 0..10_000 {
        haptic.tick(&mut out);
    }
    assert!(
        haptic.is_held() && haptic.contact > 0,
        "nothing was touched"
    );
    let (mut ticks, mut sequence) = (0_u64, 0);
    criterion.bench_function("haptic/replay/one second with its ticks", |bencher| {
        bencher.iter(|| {
            sequence += 1;
            let update = Update {
                sequence,
                cause: Cause::Deadband,
                answers: haptic.now - Duration::from_secs(1),
                touched_face: Some(Face::West),
                state: haptic.state(),
            };
            haptic.receive(Message::Update(black_box(&update).into()));
            haptic.tick(&mut out);
            assert_eq!(haptic.end.counts().newest_applied, sequence);
            while !haptic.end.master().model().is_replayed() {
                haptic.tick(&mut out);
                ticks += 1;
            }
        });
    });
    assert!(ticks > 0, "nothing was replayed");
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(50)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    targets = tick, apply, replay
}
criterion_main!(benches);
