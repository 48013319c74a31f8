//! What the haptic loop promises, ticked by hand.

use crate::operator::Operator;
use crate::operator::trace::Trace;
use std::ops::ControlFlow;

use mmt_shared::channel::datagram_channel::DatagramChannel;
use mmt_shared::fixtures::COUPLING;
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::loop_thread::{self, ARRIVALS_PER_TICK, LoopHandle, LoopSide};
use mmt_shared::io::record::{RecordError, Recorder, read};
use mmt_shared::io::schedule::Tick;
use mmt_shared::io::truth::{self, TruthReceiver};
use mmt_shared::metrics::PoseError;
use mmt_shared::model::geometry::{Face, Pose};
use mmt_shared::model::update::Update;
use mmt_shared::record::messages::{Message as _, Reading};
use mmt_shared::time::Time;
use mmt_shared::wire::{DATAGRAM_MAX, Side};

use super::fake::{state, welcome_for};
use super::*;
use crate::again::MasterSetting;
use crate::device::link::DeviceLinkConfig;
use crate::end::MasterEnd;
use crate::io::device::{DeviceAddress, DeviceHost};
use crate::io::hand_events::hand_events;
use crate::io::haptic::HapticLoop;
use crate::io::record;
use crate::limiter::{ForceLimiter, RAMP_TICKS};
use crate::master::Master;
use crate::operator::pointer::{Driver, HandEvent, HandTuning, Person, PointerSample};
use crate::operator::scripted::{Scripted, ScriptedConfig};

/// A loop, its network task's side, and a slave.
struct Ticked {
    haptic: HapticLoop,
    side: LoopSide<MasterLive>,
    handle: LoopHandle<MasterLive, ()>,
    slave: DatagramChannel,
}

/// A loop whose hand stays 2 mm inside of the box, so that there is a force.
fn pressing(duration: Option<Duration>) -> Ticked {
    along("0,-0.21,0\n0.1,-0.198,0\n1000,-0.198,0\n", duration, None)
}

/// A loop of a model that breaks when it is touched.
fn breaking() -> Ticked {
    let mut ticked = pressing(None);
    let limiter = ForceLimiter::try_new(DeviceProfile::default().limits()).unwrap();
    let mut welcome = welcome_for(COUPLING);
    // no slave can bring a master to this: its welcome would be refused
    welcome.settings.coupling.stiffness_n_per_m = f64::INFINITY;
    let master = Master::new(&welcome, limiter);
    ticked.haptic.end = MasterEnd::new(Time::ZERO, master, CommandConfig::default());
    ticked
}

/// A loop whose hand follows a path, with the truth at hand or without.
fn along(path: &str, duration: Option<Duration>, truth: Option<TruthReceiver>) -> Ticked {
    let limiter = ForceLimiter::try_new(DeviceProfile::default().limits()).unwrap();
    let path = Trace::from_csv(&format!("t_s,x_m,y_m\n{path}")).unwrap();
    let master = Master::new(&welcome_for(COUPLING), limiter);
    let end = MasterEnd::new(Time::ZERO, master, CommandConfig::default());
    let (handle, side, _) = loop_thread::pair(&MasterLive::default()).unwrap();
    Ticked {
        haptic: HapticLoop::new(end, Operator::Trace(path), duration).observed_by(truth, None),
        side,
        handle,
        slave: DatagramChannel::new(Side::Slave, Time::ZERO),
    }
}

impl Ticked {
    fn tick(&mut self, index: u64) -> ControlFlow<()> {
        let tick = tick(index);
        self.haptic.tick(tick, &mut self.side, || tick.deadline)
    }

    /// A message of the slave arrives.
    fn hear(&mut self, index: u64, message: Message) {
        let mut out = [0; DATAGRAM_MAX];
        let at = Time::from_millis(index + 1);
        let length = self.slave.encode(at, message, &mut out).unwrap().unwrap();
        self.handle.deliver(at, &out[..length]);
    }

    /// Ticks until the loop breaks; the slave sends all the time. Returns the number of ticks.
    fn run_out(&mut self) -> u64 {
        let broke = |&index: &u64| {
            self.hear(index, Message::Heartbeat);
            while self.handle.next_departure().is_some() {}
            self.tick(index).is_break()
        };
        (0..100_000).find(broke).unwrap() + 1
    }
}

fn tick(index: u64) -> Tick {
    Tick {
        index,
        deadline: Time::from_millis(index + 1),
        skipped: 0,
        lateness: Duration::ZERO,
    }
}

fn update(sequence: u32) -> Update {
    Update {
        sequence,
        cause: Cause::Timer,
        answers: Time::from_millis(1),
        touched_face: Some(Face::West),
        state: state(&COUPLING),
    }
}

#[tokio::test]
async fn the_model_of_a_stamp_is_held_against_the_truth_of_that_stamp_and_without_truth_nothing_is()
{
    let mut blind = pressing(None);
    assert!(blind.tick(0).is_continue());
    assert_eq!(blind.haptic.pose, PoseError::default());
    let (mut truth, receiver) = truth::pair();
    let mut ticked = along("0,-0.21,0\n1,-0.10,0\n9,-0.10,0\n", None, Some(receiver));
    for index in 0..600 {
        assert!(ticked.tick(index).is_continue());
    }
    let model = ticked.haptic.end().master().model();
    let then = model
        .history()
        .at(Time::from_millis(400))
        .unwrap()
        .motion
        .pose;
    let now = model.state().pose;
    assert!(
        (now.position - then.position).norm() > 1e-3,
        "it was pushed"
    );
    let off = Pose::new(then.position.x + 0.003, then.position.y, then.angle);
    truth.send(Time::from_millis(400), off);
    assert!(ticked.tick(600).is_continue());
    let rms = ticked.haptic.pose.position_rms_m().unwrap();
    assert!((rms - 0.003).abs() < 1e-12);
    let master = ticked.haptic.end().master();
    assert!(master.port().least_j() <= 0.0 && master.energy_injected_j() == 0.0);
}

#[tokio::test]
async fn after_its_duration_the_loop_goes_on_until_no_force_is_left() {
    let mut ticked = pressing(Some(TICK * 500));
    assert_eq!(ticked.run_out(), 500 + u64::from(RAMP_TICKS));
    assert_eq!(ticked.haptic.why, Some(SessionEnd::DurationOver));
    let on_hand = ticked.haptic.end().counts().on_hand;
    assert!(on_hand.largest_n().unwrap() > 0.5, "it was pressed");
    let last = *ticked.handle.snapshot();
    assert_eq!(last.hand_force, Vec2::zeros());
    assert!(last.f_m.norm() > 0.5, "and still would be: {:?}", last.f_m);
}

#[tokio::test]
async fn a_loop_that_was_asked_to_end_has_no_reason_of_its_own() {
    let mut ticked = pressing(None);
    assert!(ticked.tick(0).is_continue());
    ticked.handle.stop();
    ticked.run_out();
    assert_eq!(ticked.haptic.why, None);
}

#[tokio::test]
async fn silence_of_one_second_releases_and_one_tick_less_does_not() {
    let mut ticked = pressing(None);
    for index in 0..999 {
        assert!(ticked.tick(index).is_continue());
    }
    assert_eq!(ticked.haptic.why, None);
    assert!(ticked.tick(999).is_continue());
    assert_eq!(ticked.haptic.why, Some(SessionEnd::LinkSilent));
    // datagrams that come again do not bring the force back
    let ticks = (1000..2000).find(|&index| {
        ticked.hear(index, Message::Heartbeat);
        ticked.tick(index).is_break()
    });
    assert!(ticks.unwrap() <= 1000 + u64::from(RAMP_TICKS));
}

/// Ticks of an emergency stop that `set` sets and clears, of a hand that goes 10 mm/s into the box; then as many without.
async fn stopped_for_half_a_second(set: impl Fn(&mut Ticked, &EmergencyStop, bool)) {
    let mut ticked = along("0,-0.21,0\n2,-0.19,0\n9,-0.19,0\n", None, None);
    let emergency = EmergencyStop::default();
    ticked.haptic = ticked.haptic.stopped_by(emergency.clone());
    let mut force = Vec2::zeros();
    let mut tick = |ticked: &mut Ticked, index| {
        ticked.hear(index, Message::Heartbeat);
        while ticked.handle.next_departure().is_some() {}
        assert!(ticked.tick(index).is_continue());
        let (hip, now) = (ticked.haptic.reading, ticked.haptic.hand_force);
        let step = (now - force).norm();
        assert!(step <= 2.0 + 1e-9, "a step of {step} N");
        force = now;
        (hip.x, now.norm())
    };
    let before = (0..1500)
        .map(|index| tick(&mut ticked, index))
        .last()
        .unwrap();
    assert!(before.1 > 1.9, "{before:?}");
    set(&mut ticked, &emergency, true);
    for index in 1500..2000 {
        let (x, force) = tick(&mut ticked, index);
        // 2 N a tick, and a tick until a flag on the wire is read
        assert!(force == 0.0 || index < 1503, "{force} N in tick {index}");
        assert!((x - before.0).abs() < 2e-5, "the hand is led on");
    }
    set(&mut ticked, &emergency, false);
    let after = (2000..2500)
        .map(|index| tick(&mut ticked, index))
        .last()
        .unwrap();
    // it goes on from where it stood
    assert!(
        (after.0 - before.0 - 5e-3).abs() < 2e-5,
        "{before:?} {after:?}"
    );
    assert!(after.1 > 1.9, "{after:?}");
}

#[tokio::test]
async fn the_own_emergency_stop_takes_the_force_in_milliseconds_and_the_hand_goes_on_from_there() {
    stopped_for_half_a_second(|_, emergency, stopped| emergency.set(stopped)).await;
}

#[tokio::test]
async fn the_slaves_emergency_stop_does_the_same_and_is_cleared_by_the_slave_alone() {
    stopped_for_half_a_second(|ticked, emergency, stopped| {
        emergency.set(false);
        ticked.slave.stop(stopped);
    })
    .await;
}

#[tokio::test]
async fn only_the_newest_update_is_applied_and_the_overtaken_are_counted() {
    let mut ticked = pressing(None);
    assert!(ticked.tick(0).is_continue());
    for sequence in 1..=3 {
        ticked.hear(0, Message::Update((&update(sequence)).into()));
    }
    assert!(ticked.tick(1).is_continue());
    assert!(ticked.tick(2).is_continue());
    let end = ticked.haptic.end();
    assert_eq!(end.master().applied().iter().sum::<u64>(), 1);
    assert_eq!(end.update_drops().superseded, 2);
    assert!(end.counts().age.mean().is_some());
}

#[tokio::test]
async fn a_flood_costs_each_tick_its_share_and_delays_nobody_for_long() {
    let mut ticked = pressing(None);
    (0..3 * ARRIVALS_PER_TICK).for_each(|_| ticked.hear(0, Message::Heartbeat));
    for handled in 1..=3 {
        assert!(ticked.tick(handled).is_continue());
        let received = ticked.haptic.end().channel().counts().received;
        assert_eq!(received.heartbeats, handled * ARRIVALS_PER_TICK as u64);
    }
}

#[tokio::test]
async fn the_network_is_woken_once_for_a_commands_samples() {
    let mut ticked = pressing(None);
    let soon = Duration::from_millis(20);
    (0..9).for_each(|index| assert!(ticked.tick(index).is_continue()));
    assert!(timeout(soon, ticked.handle.wakeup.wait()).await.is_err());
    assert!(ticked.tick(9).is_continue());
    let woken = timeout(FOR_EVER, ticked.handle.wakeup.wait()).await;
    woken.unwrap().unwrap();
    assert!(ticked.handle.next_departure().is_some());
    assert_eq!(ticked.handle.next_departure(), None);
}

#[tokio::test]
async fn a_model_that_breaks_releases_the_hand_fails_the_session_and_is_counted() {
    let mut ticked = breaking();
    ticked.run_out();
    assert_eq!(ticked.haptic.why, Some(SessionEnd::ModelBroken));
    assert_eq!(SessionEnd::ModelBroken.ending(), Ending::Failed);
    let half = ticked.haptic.end().half(1.0);
    assert!(half.session.drops["model_not_finite"] >= 1);
    assert_eq!(ticked.haptic.hand_force, Vec2::zeros());
    assert!(
        ticked
            .haptic
            .end()
            .master()
            .model()
            .state()
            .pose
            .is_finite()
    );
}

#[tokio::test]
async fn where_a_device_is_plugged_in_a_console_pauses_and_ends_and_gives_the_hand_to_nobody_else()
{
    let at = DeviceAddress::Link("127.0.0.1:0".parse().unwrap());
    let host = DeviceHost::start(&at, DeviceLinkConfig::default()).unwrap();
    let (mut console, events) = hand_events(8);
    let mut ticked = pressing(None);
    let view = ticked.haptic.end().master().view();
    let scripted = Scripted::try_new(ScriptedConfig::default(), view).unwrap();
    let person = Person::new(scripted, Driver::Pointer, HandTuning::POINTER);
    ticked.haptic.operator = Operator::Person(Box::new(person));
    ticked.haptic = (ticked.haptic.operated_through(Some(events))).plugged_into(Some(host.port()));
    let mut after = |index, event| {
        console.send(event);
        // a hand that nobody holds is at rest at once when it ends
        let _ = ticked.tick(index);
        let person = ticked.haptic.operator.person().unwrap();
        (
            person.driver(),
            person.engaged(),
            person.is_paused(),
            person.finished(),
        )
    };
    let scripted = HandEvent::Drive(Driver::Scripted);
    assert_eq!(after(0, scripted), (Driver::Pointer, false, false, false));
    let paused = after(1, HandEvent::Pause(true));
    assert_eq!(paused, (Driver::Pointer, false, true, false));
    let finished = after(2, HandEvent::Finish);
    assert_eq!(finished, (Driver::Pointer, false, true, true));
}

#[tokio::test]
async fn each_reading_of_a_hand_is_recorded_as_it_came() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hand.mcap");
    let recorder = Recorder::create(&path).unwrap();
    let setting = MasterSetting {
        began: Time::ZERO,
        welcome: welcome_for(COUPLING),
        architecture: Architecture::Mmt,
        limits: DeviceProfile::default().limits(),
        commands: CommandConfig::default(),
    };
    let record = record::begin(&recorder, Clock::start(), &setting, &());
    let (mut hand, events) = hand_events(8);
    let mut ticked = pressing(None);
    ticked.haptic = ticked.haptic.recorded(record);
    ticked.haptic = ticked.haptic.operated_through(Some(events));
    let sample = |page_s, x| PointerSample {
        page_s,
        at: Vec2::new(x, -0.25),
    };
    let pressed = sample(812.25, 0.125);
    // two within one tick, as a mouse of more than 1 kHz sends them
    let moved = [sample(812.2505, 0.1255), sample(812.251, 0.126)];
    let all = [
        HandEvent::Clock(812.0),
        HandEvent::Press(pressed),
        HandEvent::Move(moved[0]),
        HandEvent::Move(moved[1]),
    ];
    all.into_iter().for_each(|event| hand.send(event));
    assert!(ticked.tick(0).is_continue());
    hand.send(HandEvent::Release);
    assert!(ticked.tick(1).is_continue());
    assert_eq!(recorder.finish().error, None);
    let mut found = Vec::new();
    let keep = |topic: &str, message: &[u8]| -> Result<(), RecordError> {
        if topic == "/master/readings" {
            found.push(Reading::read(message).unwrap());
        }
        Ok(())
    };
    read(&path, keep).unwrap();
    let came = found.iter().map(|of| (of.own_s, of.x_m, of.y_m, of.held));
    let held = |of: PointerSample| (of.page_s, of.at.x, of.at.y, true);
    let wanted = [held(pressed), held(moved[0]), held(moved[1])];
    assert_eq!(came.take(3).collect::<Vec<_>>(), wanted);
    let [press, _, last, release] = &found[..] else {
        panic!("{found:?}");
    };
    assert!(!release.held && release.x_m.is_nan() && release.own_s.is_nan());
    assert_eq!(press.stamp, last.stamp);
    assert_eq!(release.stamp.0 - press.stamp.0, 1_000_000);
}
