//! Masters that get no session: what they are refused for, and what they say.

use super::*;

#[tokio::test]
async fn each_refusal_has_its_own_error() {
    for refusal in [
        Refusal::Busy,
        Refusal::WrongToken,
        Refusal::BadHello,
        Refusal::Ending,
        Refusal::WrongRole,
    ] {
        let fake = Fake::new();
        let mut master = start(scripted(&fake), TIMEOUTS);
        let mut slave = Session::connected(&fake).await;
        slave.refuse(refusal).await;
        let error = master.error().await;
        let right = match refusal {
            Refusal::Busy => matches!(error, MasterHostError::Busy { .. }),
            Refusal::WrongToken => matches!(error, MasterHostError::WrongToken { .. }),
            Refusal::BadHello => matches!(error, MasterHostError::BadHello { samples: 10, .. }),
            Refusal::Ending => matches!(error, MasterHostError::Ending { .. }),
            Refusal::WrongRole => matches!(error, MasterHostError::WrongRole { .. }),
        };
        assert!(right, "{refusal:?}: {error}");
        let text = error.to_string();
        assert!(text.contains(&fake.address.to_string()), "{text}");
    }
}

#[tokio::test]
async fn no_error_shows_the_token() {
    let fake = Fake::new();
    let options = scripted(&fake);
    let secret = options.pairing.token.reveal().to_string();
    let mut master = start(options, TIMEOUTS);
    let mut slave = Session::connected(&fake).await;
    slave.refuse(Refusal::WrongToken).await;
    let error = master.error().await;
    assert!(!format!("{error} {error:?}").contains(&secret[..8]));
}

#[tokio::test]
async fn another_slaves_key_is_refused_before_the_token_is_sent() {
    let fake = Fake::new();
    let mut options = scripted(&fake);
    options.pairing.pin = Pin::new([7; 32]);
    let mut master = start(options, TIMEOUTS);
    let handshake = timeout(FOR_EVER, fake.listener.next()).await.unwrap();
    assert!(handshake.unwrap().finish().await.is_err());
    let error = master.error().await;
    let wrong_key = matches!(
        error,
        MasterHostError::Connect(ConnectError::WrongKey { .. })
    );
    assert!(wrong_key, "{error}");
}

#[tokio::test]
async fn nobody_there_is_said_within_the_limit() {
    let deaf = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    let fake = Fake::new();
    let mut options = scripted(&fake);
    options.pairing.address.port = deaf.local_addr().unwrap().port();
    let timeouts = Timeouts {
        connect: Duration::from_millis(300),
        ..TIMEOUTS
    };
    let error = start(options, timeouts).error().await;
    let no_answer = matches!(
        error,
        MasterHostError::Connect(ConnectError::NoAnswer { .. })
    );
    assert!(no_answer, "{error}");
}

#[tokio::test]
async fn a_name_is_looked_up_and_one_that_nobody_has_is_named_in_the_error() {
    let fake = Fake::new();
    let port = fake.address.port();
    let mut options = scripted(&fake);
    options.pairing.address = format!("localhost:{port}").parse().unwrap();
    let mut master = start(options, TIMEOUTS);
    let mut slave = Session::connected(&fake).await;
    slave.refuse(Refusal::Ending).await;
    let error = master.error().await;
    assert!(matches!(error, MasterHostError::Ending { .. }), "{error}");

    let mut options = scripted(&fake);
    options.pairing.address = "nobody.invalid:1".parse().unwrap();
    let timeouts = Timeouts {
        lookup: Duration::from_secs(2),
        ..TIMEOUTS
    };
    let error = start(options, timeouts).error().await;
    assert!(error.to_string().contains("nobody.invalid:1"), "{error}");
}

#[tokio::test]
async fn a_slave_that_accepts_and_sends_nothing_is_given_up() {
    let fake = Fake::new();
    let timeouts = Timeouts {
        welcome: Duration::from_millis(200),
        ..TIMEOUTS
    };
    let mut master = start(scripted(&fake), timeouts);
    let _silent = Session::connected(&fake).await;
    let error = master.error().await;
    assert!(
        matches!(error, MasterHostError::NoWelcome { .. }),
        "{error}"
    );
}

#[tokio::test]
async fn a_welcome_for_another_device_is_refused() {
    let fake = Fake::new();
    let mut master = start(scripted(&fake), TIMEOUTS);
    let mut slave = Session::connected(&fake).await;
    slave.welcome(Coupling::for_stiffness(2000.0)).await;
    let error = master.error().await;
    assert!(matches!(error, MasterHostError::Welcome { .. }), "{error}");
}

#[tokio::test]
async fn a_stop_before_the_session_ends_the_attempt() {
    let fake = Fake::new();
    let mut master = start(scripted(&fake), TIMEOUTS);
    master.stop.send_replace(Wish::End);
    let error = master.error().await;
    assert!(matches!(error, MasterHostError::Interrupted), "{error}");
}

#[tokio::test]
async fn the_error_behind_a_path_that_is_too_narrow_names_the_mtu() {
    let fake = Fake::new();
    let mut options = scripted(&fake);
    options.netem = "mtu 900".parse().unwrap();
    let timeouts = Timeouts {
        connect: Duration::from_millis(300),
        ..TIMEOUTS
    };
    let error = start(options, timeouts).error().await.to_string();
    for part in ["UDP packets of 1200 bytes", "an MTU of 1228"] {
        assert!(error.contains(part), "{error}");
    }
}

#[tokio::test]
async fn raw_udp_to_another_host_is_refused_before_a_packet_is_sent() {
    let fake = Fake::new();
    let mut options = scripted(&fake);
    options.transport = Transport::RawUdp { insist: false };
    // TEST-NET-1 (RFC 5737)
    options.pairing.address = "192.0.2.1:4433".parse().unwrap();
    let (_stop, stop) = watch::channel(Wish::GoOn);
    let (live, _look) = watch::channel(MasterLive::default());
    let error = run(options, stop, live).await.unwrap_err();
    assert!(matches!(error, MasterHostError::Insecure(_)), "{error}");
}
