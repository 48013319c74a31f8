//! The holder of the operator's token among many who connect and send nothing.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use mmt_shared::io::connect::connect;
use mmt_shared::io::quic::client_endpoint;
use mmt_shared::io::socket;
use tokio::net::UdpSocket;
use tokio::task::JoinSet;
use tokio::time::{MissedTickBehavior, interval, timeout};

use super::master::{PATIENCE, TRAFFIC, patiently};
use super::*;

/// Silent connections a second.
pub(super) const A_SECOND: u64 = 50;
/// How often the holder of the token comes.
pub(super) const COMES: usize = 20;

/// Opens connections that send nothing, without end. Each is kept, as an adversary would.
pub(super) async fn silent_ones(pairing: Pairing, from: impl Fn(u32) -> IpAddr) {
    let mut every = interval(Duration::from_millis(1000 / A_SECOND));
    // a host that stood still does not make up for it
    every.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut connections = JoinSet::new();
    for n in 0.. {
        every.tick().await;
        let own = socket::bind(SocketAddr::new(from(n), 0)).unwrap();
        let endpoint = client_endpoint(socket::for_quic(own).unwrap()).unwrap();
        let address = pairing.address.to_string().parse().unwrap();
        let pin = pairing.pin;
        connections.spawn(async move {
            let connection = connect(&endpoint, address, pin, TRAFFIC, PATIENCE).await;
            // until it is turned away, if ever
            if let Ok(connection) = connection {
                connection.closed().await;
            }
        });
    }
}

/// The holder's attempt; none if it is turned away.
async fn welcome(pairing: &Pairing) -> Option<Master> {
    loop {
        let mut master = Master::try_connect(pairing).await.ok()?;
        match timeout(PATIENCE, master.hello(pairing.token, 1000.0)).await {
            Ok(Ok(_)) => return Some(master),
            // the lease of the session before is free a moment after its farewell
            Ok(Err(Refusal::Busy)) => sleep(Duration::from_millis(20)).await,
            _ => return None,
        }
    }
}

/// How many of the holder's attempts, one after the other, succeed at once.
pub(super) async fn times_let_in(pairing: &Pairing, comes: usize) -> usize {
    let mut let_in = 0;
    for _ in 0..comes {
        if let Ok(Some(master)) = timeout(PATIENCE, welcome(pairing)).await {
            let_in += 1;
            patiently(master.farewell()).await;
        }
    }
    let_in
}

/// The same while others connect and stay silent.
async fn let_in(from: impl Fn(u32) -> IpAddr) -> usize {
    let host = run(options());
    let pairing = host.pairing.clone();
    let come = async {
        // they have taken every place
        sleep(Duration::from_secs(3)).await;
        times_let_in(&pairing, COMES).await
    };
    let let_in = tokio::select! {
        let_in = come => let_in,
        () = silent_ones(pairing.clone(), from) => unreachable!("it has no end"),
    };
    host.end().await;
    let_in
}

#[tokio::test]
async fn silent_connections_from_other_addresses_keep_the_holder_of_the_token_out_not_once() {
    let [a, b] = [127, 100];
    let from = move |n: u32| Ipv4Addr::new(a, b, (n >> 7 & 127) as u8, (n & 127) as u8 + 1).into();
    assert_eq!(let_in(from).await, COMES);
}

#[tokio::test]
async fn silent_connections_from_its_own_address_keep_the_holder_of_the_token_out_not_once() {
    assert_eq!(let_in(|_| Ipv4Addr::LOCALHOST.into()).await, COMES);
}

#[tokio::test]
async fn a_forged_address_is_sent_fewer_bytes_than_came_in_its_name() {
    let host = run(options());
    let address: SocketAddr = host.pairing.address.to_string().parse().unwrap();
    // a first packet of a real client, taken on its way
    let tap = UdpSocket::bind("127.0.0.1:0").await.unwrap();
    let own = socket::bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let endpoint = client_endpoint(socket::for_quic(own).unwrap()).unwrap();
    let (tapped, pin) = (tap.local_addr().unwrap(), host.pairing.pin);
    let client = connect(&endpoint, tapped, pin, TRAFFIC, PATIENCE);
    let mut first = [0; 2048];
    let length = tokio::select! {
        _ = client => unreachable!("nobody answers it"),
        got = tap.recv(&mut first) => got.unwrap(),
    };
    // the victim never asked for anything and answers nothing
    let victim = UdpSocket::bind("127.0.0.1:0").await.unwrap();
    victim.send_to(&first[..length], address).await.unwrap();
    let mut buffer = [0; 2048];
    let mut answered = patiently(victim.recv(&mut buffer)).await.unwrap();
    let wait = Duration::from_secs(3);
    while let Ok(got) = timeout(wait, victim.recv(&mut buffer)).await {
        answered += got.unwrap();
    }
    assert!(
        0 < answered && answered < length,
        "{answered} for {length} bytes"
    );
    host.end().await;
}
