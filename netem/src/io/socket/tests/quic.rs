//! A QUIC connection over emulated sockets.

use super::*;

fn endpoint(words: &str, id: LinkId, server: Option<ServerConfig>) -> (Endpoint, SocketMeter) {
    let socket = std::net::UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let inner = TokioRuntime.wrap_udp_socket(socket).unwrap();
    let config = words.parse().unwrap();
    let wrapped = EmulatedSocket::try_new(inner, config, 1, id, SocketExtras::default()).unwrap();
    let meter = wrapped.meter();
    let endpoint = Endpoint::new_with_abstract_socket(
        EndpointConfig::default(),
        server,
        Arc::new(wrapped),
        Arc::new(TokioRuntime),
    );
    (endpoint.unwrap(), meter)
}

fn identity() -> (ServerConfig, ClientConfig) {
    let made = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
    let key = rustls::pki_types::PrivatePkcs8KeyDer::from(made.signing_key.serialize_der());
    let certificate = made.cert.der().clone();
    let server = ServerConfig::with_single_cert(vec![certificate.clone()], key.into()).unwrap();
    let mut roots = rustls::RootCertStore::empty();
    roots.add(certificate).unwrap();
    let client = ClientConfig::with_root_certificates(Arc::new(roots)).unwrap();
    (server, client)
}

/// One question and one answer over QUIC: the time between them and the meters of both ends.
async fn ask(words: &str) -> (Duration, SocketMeter, SocketMeter) {
    let (server_config, client_config) = identity();
    let (server, server_meter) = endpoint(words, LinkId::DOWN, Some(server_config));
    let (client, client_meter) = endpoint(words, LinkId::UP, None);
    let answering = {
        let server = server.clone();
        tokio::spawn(async move {
            let connection = server.accept().await.unwrap().await.unwrap();
            let (mut send, mut receive) = connection.accept_bi().await.unwrap();
            let question = receive.read_to_end(100_000).await.unwrap();
            send.write_all(&question).await.unwrap();
            send.finish().unwrap();
            connection
        })
    };
    let connecting = client.connect_with(client_config, server.local_addr().unwrap(), "localhost");
    let connection = connecting.unwrap().await.unwrap();
    let start = Instant::now();
    let (mut send, mut receive) = connection.open_bi().await.unwrap();
    let question = vec![7; 50_000];
    send.write_all(&question).await.unwrap();
    send.finish().unwrap();
    assert_eq!(receive.read_to_end(100_000).await.unwrap(), question);
    let elapsed = start.elapsed();
    // each end closes by itself: on a link that loses, the word of the other may never come
    let answered = answering.await.unwrap();
    connection.close(0_u32.into(), b"");
    answered.close(0_u32.into(), b"");
    client.wait_idle().await;
    server.wait_idle().await;
    (elapsed, client_meter, server_meter)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn quic_works_over_the_emulated_link_and_pays_its_delay() {
    let asked = tokio::time::timeout(PATIENCE, ask("delay 20ms 2ms loss 5%"));
    let (elapsed, client, server) = asked.await.unwrap();
    assert!(elapsed >= Duration::from_millis(2 * 18), "{elapsed:?}");
    for meter in [client, server] {
        until("the thread to end", || {
            meter.snapshot().outgoing.in_flight == 0
        });
        offered_is_accounted_for(&meter.snapshot());
        assert!(meter.lateness().count > 0);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_one_end_sends_is_what_the_other_receives() {
    for words in ["none", "delay 2ms"] {
        let asked = tokio::time::timeout(PATIENCE, ask(words));
        let (_, client, server) = asked.await.unwrap();
        let (client, server) = (client.snapshot(), server.snapshot());
        for (from, to) in [(client, server), (server, client)] {
            assert!(from.outgoing.sent.bytes > 50_000, "{from:?}");
            assert_eq!(from.outgoing.sent.packets, to.received.packets, "{words}");
            assert_eq!(from.outgoing.sent.bytes, to.received.bytes, "{words}");
        }
    }
}
