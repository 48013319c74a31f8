//! Two endpoints on loopback: who gets in, and what the others read.

use std::net::UdpSocket;

use bytes::Bytes;

use super::*;
use crate::io::identity::Identity;
use crate::io::quic::{client_endpoint, transport};
use crate::io::tests::{PATIENCE, Slave, TRAFFIC, open, pair, patiently, slave};
use crate::io::tls;
use crate::io::transport::AcceptError;
use crate::wire::ALPN;

/// Connects as a program whose protocol is `protocol`.
async fn connect_as(slave: &Slave, protocol: &str) -> Result<Connection, ConnectionError> {
    let verifier = Arc::new(PinVerifier::new(slave.identity.pin()));
    let crypto = tls::client_as(verifier, protocol).unwrap();
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
async fn another_version_or_protocol_is_refused_in_the_handshake_naming_ours() {
    for protocol in ["mmt/0", "h3"] {
        let slave = slave();
        let up = tokio::select! {
            up = patiently(connect_as(&slave, protocol)) => up,
            _ = slave.listener.next() => unreachable!("it was let in"),
        };
        let error = connect_error(slave.address, PATIENCE, up.unwrap_err());
        assert!(
            matches!(error, ConnectError::OtherProtocol { .. }),
            "{error}"
        );
        let text = error.to_string();
        assert!(
            text.contains(&format!("{ALPN:?}")) && text.contains("version"),
            "{text}"
        );
        assert_eq!(slave.listener.unreadable(), 1);
    }
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

#[test]
fn only_an_address_of_this_host_itself_is_explained_as_one() {
    let told = |address: &str| {
        let (address, limit) = (address.parse().unwrap(), Duration::from_secs(10));
        let text = ConnectError::NoAnswer { address, limit }.to_string();
        text.contains("this host itself") && text.contains("--listen 0.0.0.0:4433")
    };
    assert!(told("127.0.0.1:4433") && told("[::1]:4433"));
    assert!(!told("192.0.2.1:4433") && !told("[2001:db8::1]:4433"));
}

#[test]
fn a_name_is_tried_at_its_ipv4_addresses_first_each_once() {
    let of = |words: &[&str]| -> Vec<SocketAddr> {
        words.iter().map(|word| word.parse().unwrap()).collect()
    };
    let found = of(&["[::1]:1", "127.0.0.1:1", "[::1]:1", "127.0.0.2:1"]);
    assert_eq!(
        in_order(found),
        of(&["127.0.0.1:1", "127.0.0.2:1", "[::1]:1"])
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
