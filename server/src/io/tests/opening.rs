//! How a host begins: where it listens, whom it lets in, and what a bug of ours on the way costs.

use std::sync::atomic::{AtomicBool, Ordering};

use super::*;

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
async fn what_is_no_hello_is_distinguished_by_the_code_of_the_close() {
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
async fn a_panic_of_ours_that_a_stranger_brings_about_is_counted_and_ends_nobodys_session() {
    const STRANGERS: u64 = 3;
    let host = SlaveHost::bind(options()).unwrap();
    let (stop, mut stopped) = watch::channel(Wish::GoOn);
    let context = &host.context;
    let (acceptor, mut masters) = Acceptor::new(
        host.tokens.clone(),
        Arc::clone(&context.observers),
        Arc::clone(&context.refusals),
        stop.subscribe(),
    );
    let is_owner = AtomicBool::new(true);
    let keeper = acceptor.run_with(
        Arc::clone(&context.listener),
        move |acceptor, handshake, place| {
            let owner = is_owner.swap(false, Ordering::Relaxed);
            async move {
                if !owner {
                    std::panic::resume_unwind(Box::new("on purpose"));
                }
                acceptor.judge(handshake, place).await;
            }
        },
    );
    let (pairing, refusals) = (host.pairing(None), Arc::clone(&context.refusals));
    let owner = async {
        let (mut master, _) = Master::operate(&pairing).await;
        for n in 1..=STRANGERS {
            let _stranger = Master::try_connect(&pairing).await;
            while refusals.panicked.load(Ordering::Relaxed) < n {
                sleep(Duration::from_millis(5)).await;
            }
            master.push(10).await;
        }
        master.farewell().await
    };
    let serve = async {
        let admitted = masters.recv().await.unwrap();
        let (meter, live) = (context.meter.snapshot(), watch::Sender::default());
        session::serve(context, admitted, None, meter, &mut stopped, &live).await
    };
    let work = async { tokio::join!(owner, serve) };
    let ((ending, totals), served) = tokio::select! {
        work = patiently(work) => work,
        () = keeper => unreachable!("the endpoint is open"),
    };
    assert_eq!(ending, Ending::Finished);
    assert_eq!(
        totals.session.drops.get("handshakes_panicked"),
        Some(&STRANGERS)
    );
    let report = RunReport::from(served.unwrap().unwrap().report);
    assert_eq!(report.ending, Some("finished"));
}
