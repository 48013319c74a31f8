//! Two endpoints on loopback: who gets in, who is told what, and what the datagram buffers keep.

use std::net::UdpSocket;

use bytes::Bytes;
use quinn::AsyncUdpSocket;

use super::*;
use crate::io::congestion::RateCap;
use crate::io::identity::Identity;
use crate::io::quic::{client_endpoint, server_endpoint, transport};
use crate::io::stream::{ReadFrameError, WriteFrameError};
use crate::io::tls::VERSION_PROTOCOL;
use crate::io::{socket, tls};

const TRAFFIC: Traffic = Traffic {
    datagram_max: 100,
    rate_cap: RateCap {
        bytes_per_s: 250_000,
    },
};
/// Longer than any healthy test needs on any host.
const PATIENCE: Duration = Duration::from_secs(60);

fn open() -> Arc<dyn AsyncUdpSocket> {
    socket::for_quic(socket::bind("127.0.0.1:0".parse().unwrap()).unwrap()).unwrap()
}

struct Slave {
    identity: Identity,
    address: SocketAddr,
    listener: Listener,
}

fn slave() -> Slave {
    let identity = Identity::ephemeral().unwrap();
    let endpoint = server_endpoint(open(), &identity, TRAFFIC).unwrap();
    Slave {
        identity,
        address: endpoint.local_addr().unwrap(),
        listener: Listener::new(endpoint),
    }
}

impl Slave {
    async fn accept(&self) -> Result<Connection, AcceptError> {
        self.listener.next().await.unwrap().finish().await
    }
}

async fn pair() -> (Endpoint, Slave, Connection, Connection) {
    let (slave, endpoint) = (slave(), client_endpoint(open()).unwrap());
    let (up, down) = tokio::join!(
        connect(
            &endpoint,
            slave.address,
            slave.identity.pin(),
            TRAFFIC,
            PATIENCE
        ),
        slave.accept(),
    );
    (endpoint, slave, up.unwrap(), down.unwrap())
}

async fn patiently<T>(future: impl Future<Output = T>) -> T {
    timeout(PATIENCE, future).await.unwrap()
}

/// Connects as a program that speaks `protocols`.
async fn connect_speaking(
    slave: &Slave,
    protocols: &[&str],
) -> Result<Connection, ConnectionError> {
    let verifier = Arc::new(PinVerifier::new(slave.identity.pin()));
    let crypto = tls::client_speaking(verifier, protocols).unwrap();
    let mut config = quinn::ClientConfig::new(Arc::new(crypto));
    config.transport_config(Arc::new(transport(TRAFFIC)));
    let endpoint = client_endpoint(open()).unwrap();
    let connecting = endpoint.connect_with(config, slave.address, SERVER_NAME);
    connecting.unwrap().await
}

#[tokio::test]
async fn the_right_pin_connects_and_datagrams_go_both_ways() {
    let (_endpoint, _slave, up, down) = pair().await;
    up.send_datagram(Bytes::from_static(b"command")).unwrap();
    down.send_datagram(Bytes::from_static(b"update")).unwrap();
    assert_eq!(patiently(down.read_datagram()).await.unwrap(), "command");
    assert_eq!(patiently(up.read_datagram()).await.unwrap(), "update");
    let stats = up.stats();
    assert_eq!((stats.frame_tx.datagram, stats.frame_rx.datagram), (1, 1));
    assert!(stats.udp_tx.datagrams >= 2 && stats.udp_tx.bytes >= 1200);
    assert_eq!(stats.path.current_mtu, 1200);
    assert_eq!(stats.path.sent_plpmtud_probes, 0);
}

#[tokio::test]
async fn a_wrong_pin_is_refused_naming_both_keys() {
    let (slave, endpoint) = (slave(), client_endpoint(open()).unwrap());
    let expected = Identity::ephemeral().unwrap().pin();
    let (up, down) = tokio::join!(
        connect(&endpoint, slave.address, expected, TRAFFIC, PATIENCE),
        slave.accept(),
    );
    let text = up.unwrap_err().to_string();
    assert!(text.contains(&expected.to_string()), "{text}");
    assert!(text.contains(&slave.identity.pin().to_string()), "{text}");
    assert!(matches!(down.unwrap_err(), AcceptError::Failed { .. }));
}

#[tokio::test]
async fn programs_of_other_versions_name_both_versions_on_both_sides() {
    let slave = slave();
    let newer = async {
        let connection = connect_speaking(&slave, &["mmt/2", VERSION_PROTOCOL]).await;
        version_of_slave(&connection.unwrap(), "mmt/2").await
    };
    let (theirs, refused) = tokio::join!(patiently(newer), patiently(slave.accept()));
    assert_eq!(theirs, "mmt/1");
    let text = refused.unwrap_err().to_string();
    assert!(
        text.contains("\"mmt/1\"") && text.contains("\"mmt/2\""),
        "{text}"
    );
}

#[tokio::test]
async fn a_slave_of_another_version_is_named_to_the_master() {
    let identity = Identity::ephemeral().unwrap();
    let crypto = tls::server_speaking(&identity, &["mmt/7", VERSION_PROTOCOL]).unwrap();
    let config = quinn::ServerConfig::with_crypto(Arc::new(crypto));
    let runtime = Arc::new(quinn::TokioRuntime);
    let endpoint = Endpoint::new_with_abstract_socket(
        quinn::EndpointConfig::default(),
        Some(config),
        open(),
        runtime,
    );
    let endpoint = endpoint.unwrap();
    let address = endpoint.local_addr().unwrap();
    let other = async {
        let connection = endpoint.accept().await.unwrap().await.unwrap();
        let theirs = version_of_master(&connection).await;
        connection.close(CLOSE_OTHER_VERSION, b"mmt/7");
        (theirs, connection)
    };
    let client = client_endpoint(open()).unwrap();
    let (up, (theirs, _)) = tokio::join!(
        connect(&client, address, identity.pin(), TRAFFIC, PATIENCE),
        patiently(other),
    );
    assert_eq!(theirs, "mmt/1");
    let text = up.unwrap_err().to_string();
    assert!(
        text.contains("\"mmt/1\"") && text.contains("\"mmt/7\""),
        "{text}"
    );
}

#[tokio::test]
async fn a_foreign_protocol_is_refused_in_the_handshake() {
    let slave = slave();
    let up = tokio::select! {
        up = patiently(connect_speaking(&slave, &["h3"])) => up,
        _ = slave.listener.next() => unreachable!("it was let in"),
    };
    let error = connect_error(slave.address, PATIENCE, up.unwrap_err());
    assert!(
        matches!(error, ConnectError::OtherProtocol { .. }),
        "{error}"
    );
    assert_eq!(slave.listener.turned_away().unreadable, 1);
}

#[tokio::test]
async fn a_peer_that_offers_this_version_alone_gets_in() {
    let slave = slave();
    let (up, down) = tokio::join!(connect_speaking(&slave, &[PROTOCOL]), slave.accept());
    assert!(up.is_ok() && down.is_ok());
}

#[tokio::test]
async fn silence_is_reported_with_the_address_and_what_to_check() {
    let endpoint = client_endpoint(open()).unwrap();
    let nobody = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = nobody.local_addr().unwrap();
    let pin = Identity::ephemeral().unwrap().pin();
    let limit = Duration::from_millis(300);
    let error = connect(&endpoint, address, pin, TRAFFIC, limit)
        .await
        .unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains(&address.to_string()) && text.contains("firewall"),
        "{text}"
    );
}

#[tokio::test]
async fn of_datagrams_that_cannot_leave_only_the_newest_two_are_kept() {
    let (_endpoint, _slave, up, down) = pair().await;
    // The runtime has one thread: nothing leaves before this task waits.
    for number in 0..100u8 {
        up.send_datagram(Bytes::from(vec![number; 100])).unwrap();
    }
    let (first, second) = (down.read_datagram(), down.read_datagram());
    assert_eq!(patiently(first).await.unwrap()[0], 98);
    assert_eq!(patiently(second).await.unwrap()[0], 99);
    let third = timeout(Duration::from_millis(100), down.read_datagram()).await;
    assert!(third.is_err(), "an old one was delivered");
}

#[tokio::test]
async fn acknowledgements_are_a_fraction_of_the_packets() {
    let (_endpoint, _slave, up, down) = pair().await;
    let before = down.stats().udp_tx.datagrams;
    for number in 0..200u8 {
        up.send_datagram(Bytes::from(vec![number; 100])).unwrap();
        assert_eq!(patiently(down.read_datagram()).await.unwrap()[0], number);
    }
    let answered = down.stats().udp_tx.datagrams - before;
    let sent = up.stats().frame_tx.datagram;
    assert_eq!(sent, 200);
    // a stalled host may add one for each 25 ms; quinn's default is 100
    assert!(answered <= 70, "{answered} packets back for {sent}");
}

#[tokio::test]
async fn a_slave_that_was_killed_and_restarted_resets_the_old_connection() {
    let identity = Arc::new(Identity::ephemeral().unwrap());
    let (address_out, address_in) = tokio::sync::oneshot::channel();
    let theirs = Arc::clone(&identity);
    let killed = std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build();
        let runtime = runtime.unwrap();
        let connection = runtime.block_on(async move {
            let endpoint = server_endpoint(open(), &theirs, TRAFFIC).unwrap();
            address_out.send(endpoint.local_addr().unwrap()).unwrap();
            let connection = Listener::new(endpoint)
                .next()
                .await
                .unwrap()
                .finish()
                .await
                .unwrap();
            connection.read_datagram().await.unwrap();
            connection
        });
        // The runtime first: without it the connection cannot say farewell.
        drop(runtime);
        drop(connection);
    });
    let endpoint = client_endpoint(open()).unwrap();
    let address = address_in.await.unwrap();
    let up = connect(&endpoint, address, identity.pin(), TRAFFIC, PATIENCE)
        .await
        .unwrap();
    up.send_datagram(Bytes::from_static(b"die")).unwrap();
    while !killed.is_finished() {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    assert_eq!(up.close_reason(), None, "a killed slave says nothing");
    let socket = socket::for_quic(socket::bind(address).unwrap()).unwrap();
    let _restarted = server_endpoint(socket, &identity, TRAFFIC).unwrap();
    let beat = async {
        loop {
            let _ = up.send_datagram(Bytes::from_static(&[0; 40]));
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    let end = tokio::select! {
        end = patiently(up.closed()) => end,
        () = beat => unreachable!(),
    };
    assert_eq!(end, ConnectionError::Reset);
}

#[tokio::test]
async fn frames_arrive_whole_in_order_and_bounded() {
    let (_endpoint, _slave, up, down) = pair().await;
    let master = async {
        let (mut send, receive) = up.open_bi().await.unwrap();
        for message in [b"hello".as_slice(), b"", &[7; 3000]] {
            write_frame(&mut send, message, PATIENCE).await.unwrap();
        }
        send.finish().unwrap();
        (send, receive)
    };
    let slave = async {
        let (_, mut receive) = down.accept_bi().await.unwrap();
        let mut frames = Vec::new();
        loop {
            match read_frame(&mut receive, 3000, PATIENCE).await {
                Ok(frame) => frames.push(frame),
                Err(error) => return (frames, error),
            }
        }
    };
    let (_, (frames, end)) = tokio::join!(master, slave);
    assert_eq!(frames, [b"hello".to_vec(), vec![], vec![7; 3000]]);
    assert!(matches!(end, ReadFrameError::Finished));
}

#[tokio::test]
async fn frames_that_break_the_rules_are_named() {
    let (_endpoint, _slave, up, down) = pair().await;
    let (mut send, _keep) = up.open_bi().await.unwrap();
    send.write_all(&11u32.to_le_bytes()).await.unwrap();
    let (_, mut receive) = down.accept_bi().await.unwrap();
    let error = read_frame(&mut receive, 10, PATIENCE).await.unwrap_err();
    assert!(matches!(
        error,
        ReadFrameError::TooLong { bytes: 11, max: 10 }
    ));
    let brief = Duration::from_millis(50);
    let error = read_frame(&mut receive, 10, brief).await.unwrap_err();
    assert!(matches!(error, ReadFrameError::Slow { .. }));
    send.write_all(&[9, 0]).await.unwrap();
    send.finish().unwrap();
    let error = read_frame(&mut receive, 10, PATIENCE).await.unwrap_err();
    assert!(matches!(error, ReadFrameError::Truncated));
    // the peer reads nothing: its window fills, and the write gives up
    let error = write_frame(&mut send, &[0; 10], brief).await.unwrap_err();
    assert!(matches!(error, WriteFrameError::Stream(_)));
}

#[tokio::test]
async fn garbage_on_the_port_does_not_disturb_a_handshake() {
    let (slave, endpoint) = (slave(), client_endpoint(open()).unwrap());
    let vandal = UdpSocket::bind("127.0.0.1:0").unwrap();
    for length in 0..300 {
        let garbage = vec![(length * 31) as u8 | 0xc0; length * 5];
        vandal.send_to(&garbage, slave.address).unwrap();
    }
    let (up, down) = tokio::join!(
        connect(
            &endpoint,
            slave.address,
            slave.identity.pin(),
            TRAFFIC,
            PATIENCE
        ),
        slave.accept(),
    );
    assert!(up.is_ok() && down.is_ok());
}

#[test]
fn a_crowd_must_prove_its_addresses_before_the_last_places_are_taken() {
    assert_eq!(admission(HANDSHAKES_MAX, false), Admission::Enter);
    assert_eq!(admission(3, false), Admission::Enter);
    assert_eq!(admission(2, false), Admission::ProveAddress);
    assert_eq!(admission(2, true), Admission::Enter);
    assert_eq!(admission(0, true), Admission::Refuse);
    assert_eq!(admission(0, false), Admission::Refuse);
}

#[test]
fn what_a_peer_calls_its_version_is_bounded() {
    assert_eq!(readable(b"mmt/3"), "mmt/3");
    assert_eq!(readable(b""), "an unknown version");
    assert_eq!(readable(&[b'x'; 500]).len(), 64);
}
