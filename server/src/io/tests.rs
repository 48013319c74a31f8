//! The host from outside, over loopback: sessions, refusals, endings.

mod master;

use std::sync::Arc;
use std::time::Duration;

use mmt_netem::LinkConfig;
use mmt_shared::io::identity::Identity;
use mmt_shared::io::transport::{CLOSE_TAKEN_OVER, Transport};
use mmt_shared::pairing::{Pairing, Token};
use mmt_shared::report::RunReport;
use mmt_shared::wire::{Architecture, Claim, Ending, Refusal};
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::sleep;

use super::acceptor::Acceptor;
use super::*;
use master::{Master, patiently};

type Served = Result<Option<SlaveReport>, SlaveHostError>;

struct Running {
    pairing: Pairing,
    live: Arc<watch::Sender<SlaveLive>>,
    stop: watch::Sender<bool>,
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
        truth: None,
        record: None,
    }
}

fn run(options: SlaveOptions) -> Running {
    let host = SlaveHost::bind(options).unwrap();
    let (stop, stopped) = watch::channel(false);
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
        self.stop.send_replace(true);
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
    let look = *host.live.borrow();
    assert!(look.connected && look.elapsed_s > 0.5 && look.rtt_ms.is_some());
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
    assert!(commands > Some(50) && commands <= Some(100), "{commands:?}");
    assert_eq!(totals.session.received.commands, commands);
    let datagrams = totals.session.wire_received.datagrams;
    assert_eq!(report.wire.up.datagrams, datagrams);
    assert!(report.wire.up.datagrams >= Some(50) && report.wire.down.bytes > Some(0));
    assert!(report.link.loss_up.get() < Some(0.5) && report.link.rtt_ms.p50.get() > Some(0.0));
    assert!(report.slave_loop.ticks > Some(100));
    assert!(report.tool.held_s.get().is_some());
    assert!(report.tool.force_peak_n.get() > Some(0.0));
    assert_eq!(report.model.mass_kg.truth, totals.model.mass_kg.truth);
}

#[tokio::test]
async fn a_wrong_token_and_numbers_out_of_range_are_refused_by_name_and_the_right_hello_is_not() {
    let host = run(options());
    let token = Token::new([1; 32]);
    let mut stranger = Master::connect(&host.pairing).await;
    let refused = patiently(stranger.hello(token, 1000.0)).await;
    assert_eq!(refused.unwrap_err(), Refusal::WrongToken);
    // the token is judged first
    let mut stranger = Master::connect(&host.pairing).await;
    let refused = patiently(stranger.hello(token, 1.0)).await;
    assert_eq!(refused.unwrap_err(), Refusal::WrongToken);
    let mut soft = Master::connect(&host.pairing).await;
    let refused = patiently(soft.hello(host.pairing.token, 1.0)).await;
    assert_eq!(refused.unwrap_err(), Refusal::BadHello);
    let (master, _) = patiently(Master::operate(&host.pairing)).await;
    patiently(master.farewell()).await;
    let drops = host.end().await.unwrap().drops.unwrap();
    assert_eq!(drops.get("masters_wrong_token"), Some(&2));
    assert_eq!(drops.get("masters_bad_hello"), Some(&1));
}

/// The code and the reason with which the slave closes on a master that writes these bytes on the stream and ends it.
async fn closed_on(host: &Running, bytes: &[u8]) -> (u64, String) {
    let mut stranger = Master::connect(&host.pairing).await;
    stranger.write(bytes).await;
    match patiently(stranger.connection.closed()).await {
        quinn::ConnectionError::ApplicationClosed(close) => (
            close.error_code.into_inner(),
            String::from_utf8_lossy(&close.reason).into_owned(),
        ),
        other => panic!("{other}"),
    }
}

#[tokio::test]
async fn what_is_no_hello_is_told_apart_by_the_code_of_the_close() {
    let host = run(options());
    let (none, _) = closed_on(&host, b"").await;
    assert_eq!(none, 2, "no hello");
    for (bytes, fault) in [
        (&b"\x08\0\0\0MMT"[..], "in the middle"),
        (b"\xff\xff\0\0MMTP", "65535 bytes"),
        (b"\x09\0\0\0not a hel", "another protocol"),
        (b"\x09\0\0\0MMTP\x03\x10\0\0\0", "a hello is malformed"),
        (b"\x0a\0\0\0MMTP\x03\x13\0\0\0\0", "no hello"),
        (
            b"\x09\0\0\0MMTP\x02\x10\0\0\0",
            "version 2 of the protocol, this side version 3",
        ),
    ] {
        let (code, reason) = closed_on(&host, bytes).await;
        assert_eq!(code, 3, "{reason}");
        assert!(reason.contains(fault), "{fault}: {reason}");
    }
    let (master, _) = patiently(Master::operate(&host.pairing)).await;
    patiently(master.farewell()).await;
    let drops = host.end().await.unwrap().drops.unwrap();
    assert_eq!(drops.get("masters_no_hello"), Some(&7));
}

#[tokio::test]
async fn a_second_master_is_refused_while_one_operates_and_let_in_afterwards() {
    let host = run(options());
    let (first, _) = patiently(Master::operate(&host.pairing)).await;
    let mut second = Master::connect(&host.pairing).await;
    let refused = patiently(second.hello(host.pairing.token, 1000.0)).await;
    assert_eq!(refused.unwrap_err(), Refusal::Busy);
    patiently(first.farewell()).await;
    let third = patiently(eventually_welcome(&host.pairing)).await;
    patiently(third.farewell()).await;
    let drops = host.end().await.unwrap().drops.unwrap();
    assert!(drops.get("masters_busy") >= Some(&1));
}

/// The lease of the session before is free a moment after its farewell.
async fn eventually_welcome(pairing: &Pairing) -> Master {
    loop {
        let mut master = Master::connect(pairing).await;
        match master.hello(pairing.token, 1000.0).await {
            Ok(_) => return master,
            Err(refusal) => assert_eq!(refusal, Refusal::Busy),
        }
        sleep(Duration::from_millis(50)).await;
    }
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
        // a second of pushing: 40 scenes and 1000 states of the tool, fewer on a host that was busy
        let (scenes, tools) = (report.messages.down.scenes, report.messages.down.tools);
        let most = if scene_hz > 0 { [60, 3000] } else { [0, 0] };
        for (n, most) in [scenes.unwrap(), tools.unwrap()].into_iter().zip(most) {
            assert!((most / 12..=most).contains(&n), "{scenes:?} {tools:?}");
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
async fn a_lost_connection_ends_the_session_and_the_next_master_is_served() {
    let host = run(options());
    let (mut master, _) = patiently(Master::operate(&host.pairing)).await;
    patiently(master.push(5)).await;
    master.connection.close(9u32.into(), b"gone");
    drop(master);
    let mut next = patiently(eventually_welcome(&host.pairing)).await;
    patiently(next.push(5)).await;
    patiently(async {
        while !host.live.borrow().connected {
            sleep(Duration::from_millis(1)).await;
        }
    })
    .await;
    patiently(next.farewell()).await;
    let report = host.end().await.unwrap();
    assert_eq!(report.ending, Some("finished"));
    assert_eq!(report.messages.up.commands, Some(5), "of the last session");
}

#[tokio::test]
async fn a_master_that_vanishes_without_a_word_loses_its_lease() {
    let host = run(options());
    let (mut master, _) = patiently(Master::operate(&host.pairing)).await;
    patiently(master.push(5)).await;
    // it lives, and says nothing any more
    let next = patiently(eventually_welcome(&host.pairing)).await;
    patiently(next.farewell()).await;
    drop(master);
    assert!(host.end().await.is_some());
}

#[tokio::test]
async fn a_host_that_is_stopped_says_farewell_and_reports() {
    let host = run(options());
    let (mut master, _) = patiently(Master::operate(&host.pairing)).await;
    patiently(master.push(10)).await;
    host.stop.send_replace(true);
    let (ending, _) = patiently(master.hear_farewell()).await;
    assert_eq!(ending, Ending::Interrupted);
    master.say_farewell().await;
    let report = host.served().await.unwrap();
    assert_eq!(report.ending, Some("interrupted"));
    assert_eq!(report.updates.received.applied, Some(7));
}

#[tokio::test]
async fn a_panic_of_the_thread_ends_the_session_as_failed_and_is_an_error() {
    let host = SlaveHost::bind(options()).unwrap();
    let (stop, mut stopped) = watch::channel(false);
    let context = &host.context;
    let (acceptor, mut masters) = Acceptor::new(
        host.pairing(None).token,
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
        |_, _, _, _| panic!("on purpose"),
    );
    let served = patiently(served).await;
    assert!(matches!(served, Err(SlaveHostError::Panicked)));
    assert_eq!(patiently(master).await.unwrap(), Ending::Failed);
    keeper.abort();
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

#[tokio::test]
async fn a_port_in_use_and_a_wrong_configuration_are_named() {
    let first = SlaveHost::bind(options()).unwrap();
    let listen = first.address();
    let second = SlaveHost::bind(SlaveOptions {
        listen,
        ..options()
    });
    let text = second.err().unwrap().to_string();
    assert!(
        text.contains(&listen.to_string()) && text.contains("another port"),
        "{text}"
    );
    let mut wrong = options();
    wrong.config.playout.delay_ms = -1.0;
    let text = SlaveHost::bind(wrong).err().unwrap().to_string();
    assert!(text.contains("delay -1"), "{text}");
}

#[tokio::test]
async fn the_pairing_names_an_address_that_a_master_can_reach() {
    let host = SlaveHost::bind(SlaveOptions {
        listen: "0.0.0.0:0".parse().unwrap(),
        ..options()
    });
    let host = host.unwrap();
    let pairing = host.pairing(None);
    assert_eq!(pairing.address.port, host.address().port());
    let shown = pairing.address.host.to_string();
    assert!(
        shown != "0.0.0.0" && shown.parse::<std::net::IpAddr>().is_ok(),
        "{shown}"
    );
    let named = host.pairing(Some(mmt_shared::pairing::Host::Name("robot".into())));
    assert!(named.to_string().starts_with("mmt://robot:"));
}

#[tokio::test]
async fn raw_udp_beyond_this_host_is_refused_unless_somebody_insists() {
    let bind = |insist| {
        SlaveHost::bind(SlaveOptions {
            listen: "0.0.0.0:0".parse().unwrap(),
            transport: Transport::RawUdp { insist },
            ..options()
        })
    };
    assert!(matches!(bind(false), Err(SlaveHostError::Insecure(_))));
    assert!(bind(true).is_ok());
}

#[tokio::test]
async fn a_master_that_was_killed_resumes_at_once_and_finds_the_world_as_it_left_it() {
    let host = run(SlaveOptions {
        once: true,
        ..options()
    });
    let (mut killed, welcome) = patiently(Master::operate(&host.pairing)).await;
    patiently(killed.push(100)).await;
    for claim in [Claim::IfFree, Claim::Resume(Token::new([1; 32]))] {
        let mut other = Master::connect(&host.pairing).await;
        other.claim = claim;
        let refused = patiently(other.hello(host.pairing.token, 1000.0)).await;
        assert_eq!(refused, Err(Refusal::Busy));
    }
    for claim in [Claim::Resume(welcome.resume), Claim::TakeOver] {
        let mut next = Master::connect(&host.pairing).await;
        next.claim = claim;
        let again = patiently(next.hello(host.pairing.token, 1000.0))
            .await
            .unwrap();
        // the tool is where it was pushed to, and not where the hello has the HIP
        assert!(again.tool.x > welcome.tool.x + 0.1, "{}", again.tool);
        assert!(again.resume != welcome.resume);
        let closed = patiently(killed.connection.closed()).await;
        let quinn::ConnectionError::ApplicationClosed(close) = closed else {
            panic!("{closed}")
        };
        assert_eq!(close.error_code, CLOSE_TAKEN_OVER);
        killed = next;
    }
    patiently(killed.farewell()).await;
    // a session that was taken over is not the first that was over
    assert!(host.served().await.is_some());
}

#[tokio::test]
async fn a_master_that_falls_silent_is_disengaged_and_resumes() {
    let host = run(options());
    let (mut silent, welcome) = patiently(Master::operate(&host.pairing)).await;
    patiently(silent.push(100)).await;
    let (ending, half) = patiently(silent.hear_farewell()).await;
    assert_eq!(ending, Ending::Failed);
    assert_eq!(half.session.drops.get("samples_disengaged"), Some(&0));
    silent.connection.close(0u32.into(), b"");
    let mut other = Master::connect(&host.pairing).await;
    let refused = patiently(other.hello(host.pairing.token, 1000.0)).await;
    assert_eq!(refused, Err(Refusal::Busy));
    let mut again = Master::connect(&host.pairing).await;
    again.claim = Claim::Resume(welcome.resume);
    let resumed = patiently(again.hello(host.pairing.token, 1000.0)).await;
    assert!(resumed.unwrap().tool.x > welcome.tool.x);
    host.end().await;
}
