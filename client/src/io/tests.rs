//! What a master host promises, against a slave that the test plays.

use crate::operator::trace::Trace;
use mmt_netem::io::socket::SocketExtras;
use mmt_shared::io::emergency::EmergencyStop;
use std::time::Duration;

use mmt_netem::LinkConfig;
use mmt_shared::io::clock::Clock;
use mmt_shared::io::connect::ConnectError;
use mmt_shared::io::transport::Transport;
use mmt_shared::io::wish::Wish;
use mmt_shared::metrics::ForceSummary;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{Pose, Twist, Vec2};
use mmt_shared::model::params::{ModelParams, ModelState};
use mmt_shared::model::update::Cause;
use mmt_shared::pairing::{Pin, Token};
use mmt_shared::report::{EstimateReport, ModelReport, RunReport, SentUpdates, SlaveHalf, named};
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{Ending, Message, Refusal};
use tokio::sync::watch;
use tokio::time::{Instant, sleep, timeout};

use super::open::{TIMEOUTS, Timeouts, open};
use super::session::run_with;
use super::*;
use fake::{Fake, Session};

mod ends;
mod fake;
mod haptic;
mod observe;
mod refusals;

/// Longer than any healthy test needs on any host.
const FOR_EVER: Duration = Duration::from_secs(60);

fn scripted(fake: &Fake) -> MasterOptions {
    MasterOptions {
        architecture: Architecture::Mmt,
        scene_hz: 0,
        transport: Transport::Quic,
        pairing: fake.pairing(),
        device: DeviceProfile::default(),
        operator: OperatorChoice::Scripted(ScriptedConfig::default()),
        events: std::sync::Mutex::default(),
        device_port: std::sync::Mutex::default(),
        duration: Some(Duration::from_secs(1)),
        commands: CommandConfig::default(),
        netem: LinkConfig::default(),
        netem_seed: 1,
        netem_extras: SocketExtras::default(),
        path: None,
        take_over: false,
        resume: None,
        emergency: EmergencyStop::default(),
        record: None,
        truth: None,
    }
}

/// A running master: its end, the switch that stops it, and what a screen sees.
struct Running {
    done: tokio::task::JoinHandle<Result<MasterReport, MasterHostError>>,
    stop: watch::Sender<Wish>,
    live: watch::Receiver<MasterLive>,
}

fn start(options: MasterOptions, timeouts: Timeouts) -> Running {
    let (stop, stop_to) = watch::channel(Wish::GoOn);
    let (live_from, live) = watch::channel(MasterLive::default());
    let done = tokio::spawn(run_with(options, stop_to, live_from, timeouts));
    Running { done, stop, live }
}

impl Running {
    async fn end(&mut self) -> Result<RunReport<MasterConfiguration>, MasterHostError> {
        let ended = timeout(FOR_EVER, &mut self.done).await.unwrap().unwrap();
        ended.map(RunReport::from)
    }

    async fn error(&mut self) -> MasterHostError {
        self.end().await.unwrap_err()
    }
}

fn totals() -> SlaveHalf {
    SlaveHalf {
        updates: SentUpdates {
            sent: Some(9),
            rate_hz: 4.5.into(),
            by_cause: Some(named([("deadband", 3), ("timer", 5), ("contact_lost", 1)])),
            ..SentUpdates::default()
        },
        force: ForceSummary {
            pmse: Some(0.125),
            pmse_x: Some(0.25),
            relative_error: Some(0.1),
            ..ForceSummary::default()
        },
        model: ModelReport {
            mass_kg: EstimateReport::new(0.75, 0.7),
            ..ModelReport::default()
        },
        ..SlaveHalf::default()
    }
}

#[tokio::test]
async fn a_session_goes_from_hello_to_farewell_and_both_sides_are_in_the_report() {
    let fake = Fake::new();
    let mut master = start(scripted(&fake), TIMEOUTS);
    let mut slave = Session::welcomed(&fake).await;
    let told = slave.serve().await;
    slave.say_farewell(Ending::Finished, totals()).await;
    let report = master.end().await.unwrap();

    assert_eq!(told.ending, Ending::Finished);
    let totals = told.report.unwrap();
    let stamps = &slave.stamps;
    let on_grid = |pair: &[u64]| pair[1] > pair[0] && (pair[1] - pair[0]).is_multiple_of(1_000_000);
    assert!(!stamps.is_empty());
    assert!(stamps.windows(2).all(on_grid), "{stamps:?}");
    assert_eq!(stamps.len() % 10, 0, "ten samples a command");

    assert_eq!(report.ending, Some("finished"));
    let received = &report.updates.received;
    let applied = received.applied.unwrap();
    let dropped: u64 = received.dropped.as_ref().unwrap().values().sum();
    assert!(applied > 0);
    assert_eq!(Some(applied + dropped), report.messages.down.updates);
    assert_eq!(totals.updates.applied, Some(applied));
    assert!(received.age_ms.mean.get().unwrap() > 0.0);
    assert_eq!(report.updates.sent.sent, Some(9));
    assert_eq!(report.updates.sent.rate_hz.get(), Some(4.5));
    assert_eq!(report.updates.sent.by_cause.as_ref().unwrap()["timer"], 5);
    assert_eq!(report.force.errors.pmse, Some(0.125));
    assert_eq!(report.force.errors.pmse_y, None);
    assert_eq!(report.model.mass_kg.estimate.get(), Some(0.75));
    assert!(report.force.hand.largest_n.get().is_some());
    let ticks = report.haptic_loop.ticks.unwrap();
    assert_eq!(totals.session.timing.ticks, Some(ticks));
    assert!(report.duration_s.get().unwrap() >= 1.0);
    assert!(report.haptic_loop.cpu_us.p50.get().unwrap() > 0.0);
    assert_eq!(report.slave_loop, Default::default());
    assert_eq!(report.seed, Some(1));
    let up = report.messages.up.commands.unwrap() + report.messages.up.heartbeats.unwrap();
    // a host that stands still leaves some to QUIC that it overtakes
    let unsent = report.link.unsent_up.unwrap();
    assert!(report.wire.up.datagrams.unwrap() + unsent >= up);
    assert!(report.link.rtt_ms.p50.get().unwrap() > 0.0);
    let drops = report.drops.as_ref().unwrap();
    let sent = stamps.len() as u64;
    let kept = drops["samples_unsent"] + drops["samples_skipped"];
    assert!(sent + kept <= ticks, "a sample a tick and no more");

    let last = *master.live.borrow_and_update();
    assert_eq!(last.ended, Some(SessionEnd::DurationOver));
    assert_eq!(last.hand_force, Vec2::zeros(), "the force is off");
    assert!(last.rtt_ms.is_some() && last.footprint.is_some());
}

#[tokio::test]
async fn a_stop_in_the_session_releases_the_hand_and_sends_a_farewell_with_its_cause() {
    for (wish, ended) in [
        (Wish::End, SessionEnd::Stopped),
        (Wish::Fail, SessionEnd::ThreadPanicked),
    ] {
        let fake = Fake::new();
        let mut options = scripted(&fake);
        options.duration = None;
        let mut master = start(options, TIMEOUTS);
        let mut slave = Session::welcomed(&fake).await;
        slave.serve_for(Duration::from_millis(100)).await;
        master.stop.send_replace(wish);
        let farewell = slave.serve().await;
        slave.say_farewell(ended.ending(), totals()).await;
        let report = master.end().await.unwrap();
        assert_eq!(farewell.ending, ended.ending());
        assert_eq!(report.ending, Some(ended.ending().name()));
        let last = *master.live.borrow_and_update();
        assert_eq!(last.ended, Some(ended));
        assert_eq!(last.hand_force, Vec2::zeros());
    }
}

#[tokio::test]
async fn who_asks_for_scenes_sees_the_last_that_came_and_how_old_it_is() {
    let fake = Fake::new();
    let mut options = scripted(&fake);
    options.duration = None;
    options.scene_hz = 20;
    let mut master = start(options, TIMEOUTS);
    let mut slave = Session::welcomed(&fake).await;
    assert_eq!(slave.hello.scene_hz, 20);
    assert_eq!(master.live.borrow_and_update().scene, None);
    // a crowded host may give either side no time for a while
    while slave.stamps.is_empty() {
        slave.serve_for(Duration::from_millis(100)).await;
    }
    let scene = Scene {
        answers: Time::from_nanos(slave.stamps[0]),
        object: Pose::new(0.1, 0.2, 0.3),
        tool: Vec2::new(-0.2, 0.0),
        force: Vec2::zeros(),
    };
    slave.tell(Message::Scene(scene));
    slave.serve_for(Duration::from_millis(100)).await;
    while master.live.borrow().scene.is_none() {
        slave.serve_for(Duration::from_millis(100)).await;
    }
    master.stop.send_replace(Wish::End);
    slave.serve().await;
    slave.say_farewell(Ending::Interrupted, totals()).await;
    master.end().await.unwrap();
    let last = *master.live.borrow_and_update();
    assert_eq!(last.scene, Some(scene));
    // since the sample that it answers, not since it came
    assert!(last.scene_age_s > Some(0.15), "{:?}", last.scene_age_s);
}

#[tokio::test]
async fn a_slave_that_ends_first_gets_the_masters_farewell() {
    let fake = Fake::new();
    let mut options = scripted(&fake);
    options.duration = None;
    let mut master = start(options, TIMEOUTS);
    let mut slave = Session::welcomed(&fake).await;
    slave.serve_for(Duration::from_millis(100)).await;
    slave.say_farewell(Ending::Interrupted, totals()).await;
    let told = slave.serve().await;
    let report = master.end().await.unwrap();
    assert_eq!(told.ending, Ending::Interrupted);
    assert_eq!(report.ending, Some("interrupted"));
    assert_eq!(report.updates.sent.sent, Some(9), "the slave's half is in");
    let ended = master.live.borrow_and_update().ended;
    assert_eq!(ended, Some(SessionEnd::SlaveEnded(Ending::Interrupted)));
}

#[tokio::test]
async fn the_slaves_farewell_may_take_a_round_trip_that_is_longer_than_the_wait() {
    let fake = Fake::new();
    let mut options = scripted(&fake);
    options.netem = "delay 500ms".parse().unwrap();
    let timeouts = Timeouts {
        farewell: Duration::from_millis(100),
        ..TIMEOUTS
    };
    let mut master = start(options, timeouts);
    let mut slave = Session::welcomed(&fake).await;
    slave.serve().await;
    slave.say_farewell(Ending::Finished, totals()).await;
    let report = master.end().await.unwrap();
    assert_eq!(report.ending, Some("finished"));
    assert_eq!(report.updates.sent.sent, Some(9), "the slave's half is in");
}

#[tokio::test]
async fn a_silent_slave_releases_the_hand_and_what_it_counted_stays_unknown() {
    let fake = Fake::new();
    let mut options = scripted(&fake);
    options.duration = None;
    let timeouts = Timeouts {
        farewell: Duration::from_millis(100),
        ..TIMEOUTS
    };
    let mut master = start(options, timeouts);
    let mut slave = Session::welcomed(&fake).await;
    slave.serve_for(Duration::from_millis(100)).await;
    let silent_since = Instant::now();
    let report = master.end().await.unwrap();
    assert!(silent_since.elapsed() >= Duration::from_millis(900));
    assert_eq!(report.ending, Some("failed"));
    let last = *master.live.borrow_and_update();
    assert_eq!(last.ended, Some(SessionEnd::LinkSilent));
    assert_eq!(last.link, LinkState::Released);
    assert_eq!(last.hand_force, Vec2::zeros());
    assert_eq!(report.updates.sent.sent, None);
    assert_eq!(report.updates.sent.by_cause, None);
    assert_eq!(report.force.errors.pmse, None);
    assert_eq!(report.model, Default::default());
    assert!(report.updates.received.applied.is_some() && report.haptic_loop.ticks.is_some());
}

#[tokio::test]
async fn a_lost_connection_ends_the_session_with_a_report() {
    let fake = Fake::new();
    let mut options = scripted(&fake);
    options.duration = None;
    let mut master = start(options, TIMEOUTS);
    let mut slave = Session::welcomed(&fake).await;
    slave.serve_for(Duration::from_millis(50)).await;
    slave.connection.close(9u32.into(), b"gone");
    let report = master.end().await.unwrap();
    assert_eq!(report.ending, Some("failed"));
    assert_eq!(report.updates.sent.sent, None);
    let last = *master.live.borrow_and_update();
    assert_eq!(last.ended, Some(SessionEnd::ConnectionLost));
    assert_eq!(last.hand_force, Vec2::zeros());
}

#[tokio::test]
async fn a_second_welcome_breaks_the_protocol_and_ends_the_session() {
    let fake = Fake::new();
    let mut options = scripted(&fake);
    options.duration = None;
    let mut master = start(options, TIMEOUTS);
    let mut slave = Session::welcomed(&fake).await;
    slave.welcome(slave.hello.coupling).await;
    slave.serve().await;
    let report = master.end().await.unwrap();
    assert_eq!(report.ending, Some("failed"));
    let ended = master.live.borrow_and_update().ended;
    assert_eq!(ended, Some(SessionEnd::StreamBroken));
}

#[tokio::test]
async fn a_trace_ends_the_session_when_it_is_over() {
    let fake = Fake::new();
    let path = Trace::from_csv("t_s,x_m,y_m\n0,-0.3,0.1\n0.2,-0.2,0.1\n").unwrap();
    let mut options = scripted(&fake);
    options.duration = None;
    options.operator = OperatorChoice::Trace {
        trace: path,
        name: "a path".to_owned(),
    };
    let mut master = start(options, TIMEOUTS);
    let mut slave = Session::welcomed(&fake).await;
    assert!((slave.hello.hip - Vec2::new(-0.3, 0.1)).norm() < 1e-9);
    slave.serve().await;
    slave.say_farewell(Ending::Finished, totals()).await;
    let report = master.end().await.unwrap();
    assert_eq!(report.ending, Some("finished"));
    assert_eq!(report.pushes.completed, None);
    assert_eq!(report.configuration.operator, "a path");
    let ended = master.live.borrow_and_update().ended;
    assert_eq!(ended, Some(SessionEnd::OperatorFinished));
}

#[tokio::test]
async fn the_emulated_link_loses_what_is_set_and_reports_that() {
    let fake = Fake::new();
    let mut options = scripted(&fake);
    options.commands.samples_per_command = 1;
    options.netem = "loss 50%".parse().unwrap();
    options.duration = Some(Duration::from_secs(2));
    let mut master = start(options, TIMEOUTS);
    let mut slave = Session::welcomed(&fake).await;
    slave.serve().await;
    slave.say_farewell(Ending::Finished, totals()).await;
    let report = master.end().await.unwrap();
    assert!(report.drops.as_ref().unwrap()["netem_loss"] > 0);
    assert!(report.link.loss_up.get().unwrap() > 0.0);
    assert_eq!(report.configuration.netem, "loss 50%");
}
