//! A live session whose inputs were kept runs again through the same ends to the same bits at each tick.
//!
//! Both hosts run over real sockets with an emulated path that delays, jitters and loses. What each loop was given — device
//! readings, frames with their arrival times, deadlines — goes through a fresh end in virtual time.

#![allow(clippy::unwrap_used, reason = "a test may panic")]
#![allow(
    clippy::disallowed_types,
    reason = "a session leaves its record behind a lock"
)]

use std::fmt::Debug;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceProfile;
use mmt_client::io::haptic::MasterRecord;
use mmt_client::io::{MasterLive, MasterOptions, OperatorChoice};
use mmt_client::operator::scripted::ScriptedConfig;
use mmt_netem::LinkConfig;
use mmt_netem::io::socket::SocketExtras;
use mmt_server::end::SlaveEnd;
use mmt_server::io::{SlaveHost, SlaveLive, SlaveOptions, SlaveRecord};
use mmt_server::slave::SlaveConfig;
use mmt_shared::io::identity::Identity;
use mmt_shared::io::input_log::{Input, RecordWanted};
use mmt_shared::io::transport::Transport;
use mmt_shared::wire::{Architecture, DATAGRAM_MAX};
use tokio::sync::watch;

use crate::harness::alone;

/// More than four seconds have: 1000 ticks a second and as many frames.
const INPUTS: usize = 10_000;
const DURATION: Duration = Duration::from_secs(4);

/// Runs a session over loopback and returns what both loops were given.
async fn session(architecture: Architecture) -> (MasterRecord, SlaveRecord) {
    let netem: LinkConfig = "delay 5ms 2ms loss 5%".parse().unwrap();
    let (from_slave, from_master) = (Arc::default(), Arc::default());
    let host = SlaveHost::bind(SlaveOptions {
        listen: "127.0.0.1:0".parse().unwrap(),
        transport: Transport::Quic,
        identity: Identity::ephemeral().unwrap(),
        config: SlaveConfig::default(),
        netem: netem.clone(),
        netem_seed: 1,
        netem_extras: SocketExtras::default(),
        once: true,
        truth: None,
        record: Some(RecordWanted {
            inputs: INPUTS,
            kept: Arc::clone(&from_slave),
        }),
    });
    let host = host.unwrap();
    let options = MasterOptions {
        pairing: host.pairing(None),
        transport: Transport::Quic,
        device: DeviceProfile::default(),
        operator: OperatorChoice::Scripted(ScriptedConfig::default()),
        duration: Some(DURATION),
        architecture,
        scene_hz: 40,
        commands: CommandConfig::default(),
        netem,
        netem_seed: 2,
        netem_extras: SocketExtras::default(),
        path: None,
        record: Some(RecordWanted {
            inputs: INPUTS,
            kept: Arc::clone(&from_master),
        }),
        truth: None,
    };
    let (_stop, stopped) = watch::channel(false);
    let (live, _shown) = watch::channel(MasterLive::default());
    let served =
        tokio::spawn(host.run(stopped.clone(), Arc::<watch::Sender<SlaveLive>>::default()));
    mmt_client::io::run(options, stopped, live).await.unwrap();
    served.await.unwrap().unwrap();
    (taken(&from_master), taken(&from_slave))
}

fn taken<T>(kept: &Mutex<Option<T>>) -> T {
    kept.lock().unwrap().take().unwrap()
}

/// What the master's end gives for the record's inputs; without the frames if they are to be left out.
fn master_again(record: &MasterRecord, with_frames: bool) -> Vec<String> {
    let (mut end, mut out) = (record.start.clone(), [0; DATAGRAM_MAX]);
    let mut ticks = Vec::new();
    for input in record.log.inputs() {
        match input {
            Input::Frame(frame) if with_frames => end.handle_datagram(frame.at, frame.bytes()),
            Input::Frame(_) => {}
            Input::Tick {
                deadline,
                given,
                sent,
            } => {
                if given.releases {
                    end.release();
                }
                ticks.push(format!("{:?}", end.tick(*deadline, given.reading)));
                while end.poll_transmit(*sent, &mut out).unwrap().is_some() {}
            }
        }
    }
    ticks
}

/// What the slave's end gives for the record's inputs; without a hundred of the frames if they are to be left out.
fn slave_again(record: &SlaveRecord, with_all_frames: bool) -> Vec<String> {
    let end = SlaveEnd::of_session(record.began, &SlaveConfig::default(), &record.hello);
    let (mut end, mut out) = (end.unwrap(), [0; DATAGRAM_MAX]);
    let (mut ticks, mut frames) = (Vec::new(), 0);
    for input in record.log.inputs() {
        match input {
            Input::Frame(frame) => {
                frames += 1;
                if with_all_frames || !(50..150).contains(&frames) {
                    end.handle_datagram(frame.at, frame.bytes());
                }
            }
            Input::Tick { deadline, sent, .. } => {
                ticks.push(format!("{:?}", end.tick(*deadline)));
                while end.poll_transmit(*sent, &mut out).unwrap().is_some() {}
            }
        }
    }
    ticks
}

/// Every number in a text that reads back to the same bits.
fn texts(ticks: &[impl Debug]) -> Vec<String> {
    ticks.iter().map(|tick| format!("{tick:?}")).collect()
}

fn same(again: &[String], live: &[String]) {
    assert_eq!(again.len(), live.len());
    for (n, (again, live)) in again.iter().zip(live).enumerate() {
        assert_eq!(again, live, "tick {n}");
    }
}

#[test]
fn a_live_session_runs_again_to_the_same_bits_at_each_tick_of_both_ends() {
    let _turn = alone();
    for architecture in Architecture::ALL {
        let mut runtime = tokio::runtime::Builder::new_current_thread();
        let runtime = runtime.enable_all().build().unwrap();
        let (master, slave) = runtime.block_on(session(architecture));
        let live = texts(master.log.ticks());
        assert!(live.len() > 500, "{} ticks of the master", live.len());
        same(&master_again(&master, true), &live);
        assert!(master_again(&master, false) != live, "frames count");
        let live = texts(slave.log.ticks());
        assert!(live.len() > 500, "{} ticks of the slave", live.len());
        same(&slave_again(&slave, true), &live);
        assert!(slave_again(&slave, false) != live, "frames count");
    }
}
