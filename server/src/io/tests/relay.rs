//! A relay before the slave, whose places strangers take.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use mmt_netem::io::relay::{Extras, Relay, RelayHandle, RelaySnapshot};
use mmt_shared::pairing::Address;
use tokio::net::UdpSocket;
use tokio::time::{MissedTickBehavior, interval, timeout};

use super::crowd::{A_SECOND, COMES, silent_ones, times_let_in};
use super::master::PATIENCE;
use super::*;

/// Many more strangers than a relay has places.
const CROWD: u64 = 200;

/// How often the holder of the token comes who is far away: a session takes it six seconds.
const COMES_FROM_FAR: usize = 4;

/// A relay before this slave with this network each way, and what a master needs to come through it.
fn relay_before(host: &Running, network: &str) -> (RelayHandle, Pairing) {
    let to = host.pairing.address.to_string().parse().unwrap();
    let delay = || network.parse().unwrap();
    let any = (Ipv4Addr::LOCALHOST, 0).into();
    let relay = Relay::bind(any, to, delay(), delay(), 1, Extras::default()).unwrap();
    let address: Address = relay.local_addr().to_string().parse().unwrap();
    let pairing = Pairing {
        address,
        ..host.pairing.clone()
    };
    (relay, pairing)
}

/// The n-th stranger's address, one of 16 256.
fn stranger(n: u32) -> IpAddr {
    Ipv4Addr::new(127, 100, (n >> 7 & 127) as u8, (n & 127) as u8 + 1).into()
}

/// The owner's, with one port after the other.
fn owner(_: u32) -> IpAddr {
    Ipv4Addr::LOCALHOST.into()
}

/// Strangers without end, each of whom sends one datagram. QUIC answers every other one: it has no such version.
async fn silent_sources(relay: SocketAddr, from: impl Fn(u32) -> IpAddr) {
    let mut every = interval(Duration::from_millis(1000 / A_SECOND));
    // a host that stood still does not make up for it
    every.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut sources = Vec::new();
    for n in 0.. {
        every.tick().await;
        let source = UdpSocket::bind((from(n), 0)).await.unwrap();
        let mut datagram = [0; 1200];
        datagram[0] = if n % 2 == 0 { 0xc0 } else { 0 };
        datagram[1..7].copy_from_slice(&[0x1a, 0x2a, 0x3a, 0x4a, 8, 1]);
        source.send_to(&datagram, relay).await.unwrap();
        sources.push(source);
    }
}

/// How many of the holder's attempts succeed at once through a relay while strangers come, and what the relay saw.
async fn let_in<S: Future<Output = ()>>(
    strangers: impl Fn(Pairing) -> S,
) -> (usize, RelaySnapshot) {
    let host = run(options());
    let (relay, pairing) = relay_before(&host, "delay 20ms");
    let come = async {
        until_crowded(&relay, CROWD).await;
        times_let_in(&pairing, COMES).await
    };
    let let_in = tokio::select! {
        let_in = come => let_in,
        () = strangers(pairing.clone()) => unreachable!("it has no end"),
    };
    host.end().await;
    (let_in, relay.stop().unwrap())
}

/// Until so many have come.
async fn until_crowded(relay: &RelayHandle, come: u64) {
    while relay.snapshot().clients_met < come {
        sleep(Duration::from_millis(20)).await;
    }
}

/// Such attempts from a stranger's address and from the owner's, each with a slave and a relay of its own.
fn assert_always_let_in(runs: [(usize, RelaySnapshot); 2]) {
    for (let_in, seen) in runs {
        assert_eq!(let_in, COMES, "{seen:?}");
        assert!(seen.clients_displaced > 0);
    }
}

#[tokio::test]
async fn silent_sources_keep_the_holder_of_the_token_out_of_the_relay_not_once() {
    let address = |pairing: Pairing| pairing.address.to_string().parse().unwrap();
    let (others, own) = tokio::join!(
        let_in(|pairing| silent_sources(address(pairing), stranger)),
        let_in(|pairing| silent_sources(address(pairing), owner)),
    );
    assert_always_let_in([others, own]);
}

#[tokio::test]
async fn silent_connections_keep_the_holder_of_the_token_out_of_the_relay_not_once() {
    let (others, own) = tokio::join!(
        let_in(|pairing| silent_ones(pairing, stranger)),
        let_in(|pairing| silent_ones(pairing, owner)),
    );
    assert_always_let_in([others, own]);
}

/// How often the holder of the token is let in whose round trip takes a second and a half, while others crowd the slave itself.
async fn let_in_from_far(from: impl Fn(u32) -> IpAddr) -> usize {
    let host = run(options());
    let (relay, pairing) = relay_before(&host, "delay 750ms");
    let come = async {
        // the crowd is as large as it gets
        sleep(Duration::from_secs(3)).await;
        times_let_in(&pairing, COMES_FROM_FAR).await
    };
    let let_in = tokio::select! {
        let_in = come => let_in,
        () = silent_ones(host.pairing.clone(), from) => unreachable!("it has no end"),
    };
    host.end().await;
    relay.stop().unwrap();
    let_in
}

#[tokio::test]
async fn others_or_its_own_address_crowd_the_slave_and_a_holder_of_the_token_who_is_far_away_is_let_in()
 {
    let let_in = tokio::join!(let_in_from_far(stranger), let_in_from_far(owner));
    assert_eq!(let_in, (COMES_FROM_FAR, COMES_FROM_FAR));
}

#[tokio::test]
async fn a_session_through_the_relay_goes_on_whoever_comes() {
    let host = run(options());
    let (relay, pairing) = relay_before(&host, "delay 20ms");
    let (mut master, _) = patiently(Master::operate(&pairing)).await;
    let session = async {
        while relay.snapshot().clients_met < CROWD {
            master.push(10).await;
        }
        // what was on its way has come
        master.listen(2).await;
        // every one holds a command, and what this host could not send at all is not among them
        let left = master.connection.stats().frame_tx.datagram;
        let (ending, totals) = master.farewell().await;
        (left, ending, totals)
    };
    let (left, ending, totals) = tokio::select! {
        end = timeout(PATIENCE, session) => end.unwrap(),
        () = silent_sources(relay.local_addr(), stranger) => unreachable!("it has no end"),
    };
    assert_eq!(ending, Ending::Finished);
    let report = host.end().await.unwrap();
    let came = report.messages.up.commands;
    assert_eq!(totals.session.received.commands, came);
    assert!(came > Some(0));
    assert_eq!(came, Some(left));
    let seen = relay.stop().unwrap();
    assert!(seen.clients_displaced > CROWD / 2, "{seen:?}");
    assert_eq!((seen.refused.packets, seen.up.abandoned.packets), (0, 0));
}
