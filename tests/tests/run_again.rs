//! A live session that was recorded runs again through fresh ends to the same bits at each tick.
//!
//! Both hosts run over real sockets with an emulated path that delays, jitters and loses. What each loop was given — device
//! readings, frames with their arrival times, deadlines — comes back from the file.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test may panic"
)]
#![allow(
    clippy::disallowed_types,
    clippy::disallowed_methods,
    reason = "a test reads files and hands a watch to a session"
)]

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceProfile;
use mmt_client::io::{MasterLive, MasterOptions, OperatorChoice};
use mmt_client::operator::scripted::ScriptedConfig;
use mmt_lab::again::{AgainError, RanAgain, SessionsAgain};
use mmt_lab::check::{Invariant, RecordChecks};
use mmt_netem::LinkConfig;
use mmt_netem::io::socket::SocketExtras;
use mmt_server::io::{SlaveHost, SlaveLive, SlaveOptions};
use mmt_server::slave::SlaveConfig;
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::identity::Identity;
use mmt_shared::io::record::{Ended, RecordError, RecordOutcome, Recorder, read};
use mmt_shared::io::transport::Transport;
use mmt_shared::io::wish::Wish;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::record::cdr::CdrWriter;
use mmt_shared::record::messages::{Arrival, Message, Session, SlaveTick};
use tokio::sync::watch;

use crate::harness::in_real_time;

const DURATION: Duration = Duration::from_secs(4);

/// Runs a session over loopback, both ends of which go into one record.
async fn session(architecture: Architecture, path: &Path) {
    let netem: LinkConfig = "delay 5ms 2ms loss 5%".parse().unwrap();
    let recorder = Recorder::create(path).unwrap();
    let host = SlaveHost::bind(SlaveOptions {
        listen: "127.0.0.1:0".parse().unwrap(),
        transport: Transport::Quic,
        identity: Identity::ephemeral().unwrap(),
        config: SlaveConfig::default(),
        netem: netem.clone(),
        netem_seed: 1,
        netem_extras: SocketExtras::default(),
        observers: 0,
        once: true,
        truth: None,
        record: Some(recorder.clone()),
        emergency: EmergencyStop::default(),
        plant: None,
    });
    let host = host.unwrap();
    let pairing = host.pairing(None);
    let token = pairing.token.reveal().to_string();
    let emergency = EmergencyStop::default();
    let options = MasterOptions {
        pairing,
        transport: Transport::Quic,
        device: DeviceProfile::default(),
        operator: OperatorChoice::Scripted(ScriptedConfig::default()),
        events: std::sync::Mutex::default(),
        device_port: std::sync::Mutex::default(),
        duration: Some(DURATION),
        architecture,
        scene_hz: 40,
        commands: CommandConfig::default(),
        netem,
        netem_seed: 2,
        netem_extras: SocketExtras::default(),
        path: None,
        take_over: false,
        resume: None,
        record: Some(recorder.clone()),
        truth: None,
        emergency: emergency.clone(),
    };
    let (_stop, stopped) = watch::channel(Wish::GoOn);
    let (live, mut shown) = watch::channel(MasterLive::default());
    tokio::spawn(async move {
        for (from_s, stops) in [(2.0, true), (2.5, false)] {
            let _ = shown.wait_for(|live| live.elapsed_s >= from_s).await;
            emergency.set(stops);
        }
    });
    let served =
        tokio::spawn(host.run(stopped.clone(), Arc::<watch::Sender<SlaveLive>>::default()));
    mmt_client::io::run(options, stopped, live).await.unwrap();
    served.await.unwrap().unwrap();
    assert_eq!(recorder.finish(), RecordOutcome::default());
    holds_no_secret(path, &token);
}

/// Neither as text nor as bytes.
fn holds_no_secret(path: &Path, token: &str) {
    let bytes = std::fs::read(path).unwrap();
    let holds = |part: &[u8]| bytes.windows(part.len()).any(|window| window == part);
    let secret: Vec<u8> = (0..token.len())
        .step_by(2)
        .map(|at| u8::from_str_radix(&token[at..at + 2], 16).unwrap())
        .collect();
    assert!(!holds(token.as_bytes()) && !holds(&secret));
    assert!(holds(b"mmt_msgs/msg/MasterTick"), "the search finds");
}

/// Every message of a record, with its topic.
fn messages(path: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    let ended = read::<RecordError>(path, |topic, message| {
        found.push((topic.to_owned(), message.to_vec()));
        Ok(())
    });
    assert_eq!(ended.unwrap(), Ended::Whole);
    found
}

/// Runs messages again, each as `changed` makes it.
fn again(
    messages: &[(String, Vec<u8>)],
    mut changed: impl FnMut(&str, &[u8]) -> Vec<u8>,
) -> Result<Vec<(&'static str, u32, RanAgain)>, AgainError> {
    let mut sessions = SessionsAgain::default();
    for (topic, message) in messages {
        sessions.take(topic, &changed(topic, message))?;
    }
    Ok(sessions.ran().collect())
}

fn written(message: &impl Message) -> Vec<u8> {
    let mut out = CdrWriter::default();
    message.write(out.begin());
    out.message().to_vec()
}

#[test]
fn a_live_session_runs_again_to_the_same_bits_at_each_tick_of_both_ends() {
    in_real_time(|| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("session.mcap");
        for architecture in Architecture::ALL {
            let mut runtime = tokio::runtime::Builder::new_current_thread();
            let runtime = runtime.enable_all().build().unwrap();
            runtime.block_on(session(architecture, &path));
            let messages = messages(&path);
            let ran = again(&messages, |_, message| message.to_vec()).unwrap();
            let sides: Vec<_> = ran.iter().map(|(side, n, _)| (*side, *n)).collect();
            assert_eq!(sides, [("master", 1), ("slave", 1)]);
            checked(&messages);
            for (side, _, ran) in ran {
                assert!(ran.ticks > 0 && !ran.has_gap, "{side}: {ran:?}");
            }
            frames_count(&messages, "/master/arrivals", "master");
            frames_count(&messages, "/slave/arrivals", "slave");
            another_version_is_refused_by_name(&messages);
        }
    });
}

/// What is promised holds, with an emergency stop on the way; and another bit is seen.
fn checked(messages: &[(String, Vec<u8>)]) {
    let mut checks = RecordChecks::default();
    for (topic, message) in messages {
        checks.take(topic, message).unwrap();
    }
    let verdict = checks.verdict(true);
    assert!(verdict.holds(), "{verdict}");
    let stops = verdict
        .judged()
        .filter(|(of, _)| *of == Invariant::ToolStops);
    assert!(stops.count() == 1, "the emergency stop was looked at");
    let mut checks = RecordChecks::default();
    for (topic, message) in messages {
        let mut message = message.clone();
        if topic == "/slave/ticks" {
            let mut tick = SlaveTick::read(&message).unwrap();
            tick.digest ^= 1;
            message = written(&tick);
        }
        checks.take(topic, &message).unwrap();
    }
    let verdict = checks.verdict(true);
    let broken: Vec<_> = verdict.broken().map(|(of, _)| of).collect();
    assert_eq!(broken, [Invariant::SameBits]);
}

/// Without a hundred of its datagrams a session gives something else, and the tick is named.
fn frames_count(messages: &[(String, Vec<u8>)], of: &str, end: &str) {
    let mut seen = 0;
    let differs = again(messages, |topic, message| {
        if topic != of {
            return message.to_vec();
        }
        seen += 1;
        let mut arrival = Arrival::read(message).unwrap();
        if (20..120).contains(&seen) {
            arrival.datagram.clear();
        }
        written(&arrival)
    });
    let error = differs.unwrap_err();
    assert!(
        matches!(error, AgainError::Difference { side, tick, .. } if side == end && tick > 0),
        "{error}"
    );
}

fn another_version_is_refused_by_name(messages: &[(String, Vec<u8>)]) {
    let refused = again(messages, |topic, message| {
        if topic != "/master/session" {
            return message.to_vec();
        }
        let mut session = Session::read(message).unwrap();
        session.program = "mmt 0.0.7".to_owned();
        written(&session)
    });
    let text = refused.unwrap_err().to_string();
    assert!(text.contains("mmt 0.0.7"), "{text}");
}
