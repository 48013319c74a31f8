//! Two endpoints on loopback: who gets in, and who is told what.

use std::net::UdpSocket;

use bytes::Bytes;

use super::*;
use crate::io::identity::Identity;
use crate::io::listen::AcceptError;
use crate::io::loopback::{PATIENCE, Slave, TRAFFIC, open, pair, patiently, slave};
use crate::io::quic::{client_endpoint, transport};
use crate::io::tls;
use crate::io::tls::VERSION_PROTOCOL;
use crate::io::versions::{CLOSE_OTHER_VERSION, version_of_master};

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

/// An endpoint that serves what this program would not.
fn serving(crypto: quinn::crypto::rustls::QuicServerConfig) -> Endpoint {
    let config = quinn::ServerConfig::with_crypto(Arc::new(crypto));
    let runtime = Arc::new(quinn::TokioRuntime);
    let plain = quinn::EndpointConfig::default();
    Endpoint::new_with_abstract_socket(plain, Some(config), open(), runtime).unwrap()
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
async fn an_impostor_with_a_copy_of_the_certificate_but_not_the_key_is_refused() {
    let (slave, impostor) = (
        Identity::ephemeral().unwrap(),
        Identity::ephemeral().unwrap(),
    );
    let provider = rustls::crypto::ring::default_provider();
    let key = provider
        .key_provider
        .load_private_key(impostor.key())
        .unwrap();
    let stolen = rustls::sign::CertifiedKey::new(vec![slave.certificate()], key);
    let mut crypto = rustls::ServerConfig::builder_with_provider(Arc::new(provider))
        .with_protocol_versions(&[&rustls::version::TLS13])
        .unwrap()
        .with_no_client_auth()
        .with_cert_resolver(Arc::new(rustls::sign::SingleCertAndKey::from(stolen)));
    crypto.alpn_protocols = vec![ALPN.into()];
    let crypto = quinn::crypto::rustls::QuicServerConfig::try_from(crypto).unwrap();
    let server = serving(crypto);
    let address = server.local_addr().unwrap();
    let client = client_endpoint(open()).unwrap();
    let (up, down) = tokio::join!(
        connect(&client, address, slave.pin(), TRAFFIC, PATIENCE),
        async { server.accept().await.unwrap().await },
    );
    assert!(matches!(up.unwrap_err(), ConnectError::Failed { .. }));
    assert!(down.is_err());
}

#[tokio::test]
async fn programs_of_other_versions_name_both_versions_on_both_sides() {
    let slave = slave();
    let newer = async {
        let connection = connect_speaking(&slave, &["mmt/9", VERSION_PROTOCOL]).await;
        version_of_slave(&connection.unwrap(), "mmt/9").await
    };
    let (theirs, refused) = tokio::join!(patiently(newer), patiently(slave.accept()));
    assert_eq!(theirs, ALPN);
    let text = refused.unwrap_err().to_string();
    assert!(
        text.contains(&format!("{ALPN:?}")) && text.contains("\"mmt/9\""),
        "{text}"
    );
}

#[tokio::test]
async fn a_slave_of_another_version_is_named_to_the_master() {
    let identity = Identity::ephemeral().unwrap();
    let crypto = tls::server_speaking(&identity, &["mmt/7", VERSION_PROTOCOL]).unwrap();
    let endpoint = serving(crypto);
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
    assert_eq!(theirs, ALPN);
    let text = up.unwrap_err().to_string();
    assert!(
        text.contains(&format!("{ALPN:?}")) && text.contains("\"mmt/7\""),
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
    let (up, down) = tokio::join!(connect_speaking(&slave, &[ALPN]), slave.accept());
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
