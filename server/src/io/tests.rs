//! The host from outside, over loopback: sessions, refusals, endings.

mod crowd;
mod flood;
mod identity;
mod lease;
mod master;
mod observers;
mod opening;
mod relay;
mod under_way;

use std::sync::Arc;
use std::time::Duration;

use mmt_netem::LinkConfig;
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::identity::Identity;
use mmt_shared::io::transport::{CLOSE_TAKEN_OVER, Transport};
use mmt_shared::io::wish::Wish;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::pairing::{Pairing, Token};
use mmt_shared::report::RunReport;
use mmt_shared::wire::{Claim, Ending, Refusal};
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::sleep;

use super::acceptor::Acceptor;
use super::slave_loop::Finished;
use super::*;
use master::{Master, patiently};

type Served = Result<Option<SlaveReport>, SlaveHostError>;

struct Running {
    pairing: Pairing,
    live: Arc<watch::Sender<SlaveLive>>,
    stop: watch::Sender<Wish>,
    served: JoinHandle<Served>,
}

fn options() -> SlaveOptions {
    SlaveOptions {
        transport: Transport::Quic,
        listen: "127.0.0.1:0".parse().unwrap(),
        identity: Identity::ephemeral().unwrap(),
        config: SlaveConfig::default(),
        netem: LinkConfig::default(),
        netem_seed: 1,
        netem_extras: SocketExtras::default(),
        once: false,
        observers: 8,
        truth: None,
        record: None,
        emergency: EmergencyStop::default(),
        plant: None,
    }
}

fn run(options: SlaveOptions) -> Running {
    let host = SlaveHost::bind(options).unwrap();
    let (stop, stopped) = watch::channel(Wish::GoOn);
    let live = Arc::<watch::Sender<SlaveLive>>::default();
    Running {
        pairing: host.pairing(None),
        served: tokio::spawn(host.run(stopped, Arc::clone(&live))),
        live,
        stop,
    }
}

impl Running {
    async fn end(self) -> Option<RunReport<SlaveConfiguration>> {
        self.stop.send_replace(Wish::End);
        self.served().await
    }

    /// What the host reports at its own end.
    async fn served(self) -> Option<RunReport<SlaveConfiguration>> {
        let served = patiently(self.served).await.unwrap().unwrap();
        served.map(RunReport::from)
    }
}

#[tokio::test]
async fn a_session_goes_from_the_welcome_to_a_report_that_agrees_with_the_master() {
    let host = run(SlaveOptions {
        once: true,
        ..options()
    });
    let (mut master, welcome) = Master::operate(&host.pairing).await;
    let coupling = mmt_shared::model::contact::Coupling::for_stiffness(1000.0);
    let welcome = welcome.accept(&coupling).unwrap();
    let scheme = SlaveConfig::default().trigger.scheme.to_string();
    assert_eq!(welcome.scheme.as_str(), scheme);
    master.push(100).await;
    master.listen(1).await;
    let view = *host.live.borrow();
    assert!(view.connected && view.elapsed_s > 0.0 && view.rtt_ms.is_some());
    let mut sequences: Vec<_> = master.updates.iter().map(|u| u.sequence).collect();
    assert!(sequences.is_sorted(), "{sequences:?}");
    let all = sequences.len() as u64;
    sequences.dedup();
    let heard = sequences.len() as u64;
    assert!(heard > 0, "no update in a second of contact");
    let (ending, totals) = patiently(master.farewell()).await;
    assert_eq!(ending, Ending::Finished);
    let report = host.served().await.unwrap();
    assert_eq!(report.ending, Some("finished"));
    assert_eq!(report.updates.received.applied, Some(7));
    let (sent, theirs) = (&report.updates.sent, &totals.updates);
    assert_eq!((sent.sent, &sent.by_cause), (theirs.sent, &theirs.by_cause));
    let down = report.messages.down.updates;
    assert_eq!(down, totals.session.sent.updates);
    assert_eq!(
        down,
        sent.sent.zip(sent.repeated).map(|(new, again)| new + again)
    );
    assert!(report.updates.sent.sent >= Some(heard));
    // this master never reports what it has, so repeats go on
    assert!(report.updates.sent.repeated >= Some(all - heard));
    // where the host stands still for a while, QUIC drops old ones of those that then leave at once
    let commands = report.messages.up.commands;
    assert!(commands > Some(0) && commands <= Some(100), "{commands:?}");
    assert_eq!(totals.session.received.commands, commands);
    let datagrams = totals.session.wire_received.datagrams;
    assert_eq!(report.wire.up.datagrams, datagrams);
    assert!(report.wire.up.datagrams > Some(0) && report.wire.down.bytes > Some(0));
    assert!(report.link.loss_up.get() < Some(1.0) && report.link.rtt_ms.p50.get() > Some(0.0));
    assert!(report.slave_loop.ticks > Some(0));
    assert!(report.tool.held_s.get().is_some());
    assert!(report.tool.force_peak_n.get() > Some(0.0));
    assert_eq!(report.model.mass_kg.truth, totals.model.mass_kg.truth);
}

#[tokio::test]
async fn a_viewer_gets_scenes_and_a_master_with_tdpa_gets_the_tools_state_each_tick() {
    for (scene_hz, architecture) in [(0, Architecture::Mmt), (40, Architecture::Tdpa)] {
        let host = run(options());
        let mut master = patiently(Master::connect(&host.pairing)).await;
        (master.scene_hz, master.architecture) = (scene_hz, architecture);
        let token = host.pairing.token;
        patiently(master.hello(token, 1000.0)).await.unwrap();
        patiently(master.push(100)).await;
        patiently(master.farewell()).await;
        let report = host.end().await.unwrap();
        let down = &report.messages.down;
        let (scenes, tools) = (down.scenes.unwrap(), down.tools.unwrap());
        if scene_hz == 0 {
            assert_eq!((scenes, tools), (0, 0));
        } else {
            // 40 and 1000 a second, fewer on a host that was busy
            assert!(scenes > 0 && tools > scenes, "{scenes} {tools}");
        }
        assert_eq!(
            report.architecture.name.as_deref(),
            Some(architecture.name())
        );
    }
}

#[tokio::test]
async fn garbage_is_counted_and_harmless() {
    let host = run(options());
    let (mut master, _) = patiently(Master::operate(&host.pairing)).await;
    for garbage in [
        b"".as_slice(),
        b"MMTP",
        &[0xff; 300],
        b"MMTP\x02\x01\x00\x00\x01",
    ] {
        master.send_raw(garbage);
        patiently(master.listen(1)).await;
    }
    patiently(master.push(20)).await;
    patiently(master.farewell()).await;
    let report = host.end().await.unwrap();
    let drops = report.drops.unwrap();
    assert_eq!(drops.get("datagrams_malformed"), Some(&4));
    assert_eq!(report.messages.up.commands, Some(20));
    assert_eq!(report.ending, Some("finished"));
}

#[tokio::test]
async fn a_message_that_is_no_farewell_ends_the_session_as_failed() {
    let host = run(options());
    let (mut master, _) = patiently(Master::operate(&host.pairing)).await;
    master.say(b"MMTP\x03\x10\x00\x00").await;
    let (ending, _) = patiently(master.hear_farewell()).await;
    assert_eq!(ending, Ending::Failed);
    master.connection.close(0u32.into(), b"");
    let report = host.end().await.unwrap();
    assert_eq!(report.ending, Some("failed"));
}

#[tokio::test]
async fn a_host_that_is_stopped_sends_a_farewell_with_its_cause_and_reports() {
    for (wish, expected) in [
        (Wish::End, Ending::Interrupted),
        (Wish::Fail, Ending::Failed),
    ] {
        let host = run(options());
        let (mut master, _) = patiently(Master::operate(&host.pairing)).await;
        patiently(master.push(10)).await;
        host.stop.send_replace(wish);
        let (ending, _) = patiently(master.hear_farewell()).await;
        assert_eq!(ending, expected);
        master.say_farewell().await;
        let report = host.served().await.unwrap();
        assert_eq!(report.ending, Some(expected.name()));
        assert_eq!(report.updates.received.applied, Some(7));
    }
}

/// What becomes of a session whose loop is this, and what the master is told.
async fn served_by(
    body: impl FnOnce() -> Finished + Send + 'static,
) -> (Result<(), SlaveHostError>, Ending) {
    let host = SlaveHost::bind(options()).unwrap();
    let (stop, mut stopped) = watch::channel(Wish::GoOn);
    let context = &host.context;
    let (acceptor, mut masters) = Acceptor::new(
        host.tokens.clone(),
        Arc::clone(&context.observers),
        Arc::clone(&context.refusals),
        stop.subscribe(),
    );
    let keeper = tokio::spawn(acceptor.run(Arc::clone(&context.listener)));
    let pairing = host.pairing(None);
    let master = tokio::spawn(async move {
        let (mut master, _) = Master::operate(&pairing).await;
        let (ending, _) = master.hear_farewell().await;
        master.connection.close(0u32.into(), b"");
        ending
    });
    let admitted = patiently(masters.recv()).await.unwrap();
    let live = watch::Sender::default();
    let served = session::serve_with(
        context,
        admitted,
        None,
        context.meter.snapshot(),
        &mut stopped,
        &live,
        |_, _, mut ticker, _| {
            ticker.wait();
            body()
        },
    );
    let served = patiently(served).await.map(|_| ());
    let told = patiently(master).await.unwrap();
    keeper.abort();
    (served, told)
}

#[tokio::test]
async fn a_panic_of_the_thread_ends_the_session_as_failed_and_is_an_error() {
    // no backtrace: where the host is busy, writing one takes so long that the watchdog sees a tick that hangs
    let panics = || std::panic::resume_unwind(Box::new("on purpose"));
    let (served, told) = served_by(panics).await;
    assert!(matches!(served, Err(SlaveHostError::Panicked)));
    assert_eq!(told, Ending::Failed);
}

#[tokio::test]
async fn a_tick_that_hangs_ends_the_session_as_failed_and_is_an_error() {
    let hangs = || {
        loop {
            std::thread::park();
        }
    };
    let (served, told) = served_by(hangs).await;
    assert!(matches!(served, Err(SlaveHostError::Hung)));
    assert_eq!(told, Ending::Failed);
}

#[tokio::test]
async fn a_host_without_a_session_has_no_report() {
    let host = run(options());
    assert_eq!(host.end().await, None);
}

#[tokio::test]
async fn what_the_emulated_network_drops_is_named_and_not_counted_as_sent() {
    let host = run(SlaveOptions {
        netem: "delay 5ms loss 30%".parse().unwrap(),
        ..options()
    });
    let (mut master, _) = patiently(Master::operate(&host.pairing)).await;
    patiently(master.push(100)).await;
    patiently(master.farewell()).await;
    let report = host.end().await.unwrap();
    let drops = report.drops.unwrap();
    assert!(drops.get("netem_loss") > Some(&0), "{drops:?}");
    assert!(report.link.rtt_ms.p50.get() >= Some(5.0));
    assert_eq!(report.configuration.netem, "delay 5ms loss 30%");
}
