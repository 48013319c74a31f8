//! The relay on loopback: lower bounds of time only, and generous patience.

use crate::counters::Tally;
use crate::io::driver::DirectionCounters;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};
use std::time::Instant;

use super::port::{Port, Received, Receiver, Sending};
use super::*;
use crate::config::Limit;
use crate::io::driver::Outcome;
use crate::io::record_file::RecordFile;

const PATIENCE: Duration = Duration::from_secs(30);
const LOCAL: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);
const LOCAL6: IpAddr = IpAddr::V6(Ipv6Addr::LOCALHOST);

fn socket(ip: IpAddr) -> UdpSocket {
    let socket = UdpSocket::bind((ip, 0)).unwrap();
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    socket
}

fn relay(listen: IpAddr, to: SocketAddr, up: &str, down: &str) -> RelayHandle {
    let (up, down) = (up.parse().unwrap(), down.parse().unwrap());
    Relay::bind((listen, 0).into(), to, up, down, 1, Extras::default()).unwrap()
}

fn receive(socket: &UdpSocket) -> (Vec<u8>, SocketAddr) {
    let mut buffer = [0; 2000];
    loop {
        match socket.recv_from(&mut buffer) {
            // a process that was stopped and goes on
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            received => {
                let (len, from) = received.unwrap();
                return (buffer[..len].to_vec(), from);
            }
        }
    }
}

/// Waits for something that must come, for as long as a slow machine may need.
fn until(relay: &RelayHandle, holds: impl Fn(&RelaySnapshot) -> bool) -> RelaySnapshot {
    let start = Instant::now();
    loop {
        let snapshot = relay.snapshot();
        if holds(&snapshot) {
            return snapshot;
        }
        assert!(start.elapsed() < PATIENCE, "it never came: {snapshot:?}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn offered_is_accounted_for(counters: &DirectionCounters) {
    let after = counters.link.dropped.total().packets
        + counters.in_flight
        + counters.sent.packets
        + counters.blocked.packets
        + counters.failed.packets
        + counters.abandoned.packets;
    let before = counters.link.offered.packets + counters.link.duplicated.packets;
    assert_eq!(before, after, "{counters:?}");
}

fn forwards_both_ways(listen: IpAddr, target: IpAddr) {
    let server = socket(target);
    let relay = relay(
        listen,
        server.local_addr().unwrap(),
        "delay 20ms",
        "delay 5ms",
    );
    let client = socket(listen);
    let start = Instant::now();
    client.send_to(b"up", relay.local_addr()).unwrap();
    let (contents, from) = receive(&server);
    assert_eq!(contents, b"up");
    assert!(start.elapsed() >= Duration::from_millis(20));
    let start = Instant::now();
    server.send_to(b"down", from).unwrap();
    assert_eq!(receive(&client), (b"down".to_vec(), relay.local_addr()));
    assert!(start.elapsed() >= Duration::from_millis(5));

    until(&relay, |seen| seen.down.sent.packets == 1);
    let [up, down] = relay.take_delays();
    assert_eq!((up.count, down.count), (1, 1));
    assert!(up.max >= Duration::from_millis(20) && down.max >= Duration::from_millis(5));
    assert_eq!(
        relay.take_delays().map(|delays| delays.count),
        [0, 0],
        "taken"
    );
    let end = relay.stop().unwrap();
    let tally = |packets, bytes| Tally { packets, bytes };
    assert_eq!(end.up.sent, tally(1, 2));
    assert_eq!(end.down.sent, tally(1, 4));
    assert_eq!(
        (end.clients, end.clients_met, end.lateness.count),
        (1, 1, 2)
    );
}

#[test]
fn datagrams_pass_both_ways_and_never_early() {
    forwards_both_ways(LOCAL, LOCAL);
}

#[test]
fn ipv6_works_and_so_does_a_target_of_the_other_family() {
    if UdpSocket::bind((LOCAL6, 0)).is_err() {
        assert!(std::env::var_os("CI").is_none(), "no ::1 on a CI machine");
        eprintln!("DID NOT RUN: this host has no ::1");
        return;
    }
    forwards_both_ways(LOCAL6, LOCAL6);
    forwards_both_ways(LOCAL6, LOCAL);
    forwards_both_ways(LOCAL, LOCAL6);
}

/// What came to a port: contents, class, sender.
fn take(port: &Port) -> (Vec<u8>, u8, SocketAddr) {
    let start = Instant::now();
    let mut seen = None;
    while seen.is_none() {
        assert!(start.elapsed() < PATIENCE, "it never came");
        let take = |got: Received<'_>| seen = Some((got.contents.to_vec(), got.class, got.from));
        Receiver::new().receive(port, take).unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
    seen.unwrap()
}

#[test]
fn the_traffic_class_passes_both_ways() {
    let (client, server) = (socket(LOCAL), socket(LOCAL));
    let relay = relay(LOCAL, server.local_addr().unwrap(), "delay 1ms", "none");
    let [client, server] = [client, server].map(|socket| Port::try_new(socket).unwrap());
    let send = |port: &Port, to, class| {
        let from = None;
        let outcome = port.send(Sending { to, from, class }, b"class", &mut 0);
        assert_eq!(outcome, Outcome::Sent);
    };
    // expedited forwarding with ECT(0), then CS1 with ECT(1)
    send(&client, relay.local_addr(), 46 << 2 | 2);
    let (contents, class, from) = take(&server);
    assert_eq!((&contents[..], class), (&b"class"[..], 46 << 2 | 2));
    send(&server, from, 8 << 2 | 1);
    assert_eq!(take(&client).1, 8 << 2 | 1);
}

#[test]
fn clients_do_not_mix() {
    let server = socket(LOCAL);
    let relay = relay(
        LOCAL,
        server.local_addr().unwrap(),
        "delay 1ms",
        "delay 1ms",
    );
    let clients: Vec<UdpSocket> = (0..5).map(|_| socket(LOCAL)).collect();
    for round in 0..10 {
        for (number, client) in clients.iter().enumerate() {
            let question = [round, number as u8];
            client.send_to(&question, relay.local_addr()).unwrap();
        }
        for _ in &clients {
            let (contents, from) = receive(&server);
            server.send_to(&contents, from).unwrap();
        }
        for (number, client) in clients.iter().enumerate() {
            assert_eq!(receive(client).0, [round, number as u8]);
        }
    }
    assert_eq!(relay.stop().unwrap().clients_met, 5);
}

#[test]
fn fifo_keeps_the_order_and_every_loss_has_its_count() {
    let server = socket(LOCAL);
    let to = server.local_addr().unwrap();
    let relay = relay(LOCAL, to, "delay 10ms 10ms loss 20%", "none");
    let client = socket(LOCAL);
    for number in 0..200_u8 {
        client.send_to(&[number], relay.local_addr()).unwrap();
    }
    let end = until(&relay, |seen| {
        seen.up.link.offered.packets == 200 && seen.up.in_flight == 0
    });
    offered_is_accounted_for(&end.up);
    assert!(end.up.link.dropped.loss.packets > 0);
    let arrived: Vec<u8> = (0..end.up.sent.packets)
        .map(|_| receive(&server).0[0])
        .collect();
    assert!(arrived.is_sorted(), "{arrived:?}");
}

#[test]
fn the_relay_outlives_a_target_where_nobody_listens() {
    let vacant = socket(LOCAL).local_addr().unwrap();
    let relay = relay(LOCAL, vacant, "none", "none");
    let client = socket(LOCAL);
    let start = Instant::now();
    while relay.snapshot().unreachable < 3 {
        client.send_to(b"anybody?", relay.local_addr()).unwrap();
        std::thread::sleep(Duration::from_millis(2));
        assert!(start.elapsed() < PATIENCE, "{:?}", relay.snapshot());
    }
    // and serves once somebody does
    let server = UdpSocket::bind(vacant).unwrap();
    server.set_read_timeout(Some(PATIENCE)).unwrap();
    client.send_to(b"you?", relay.local_addr()).unwrap();
    while receive(&server).0 != b"you?" {}
    assert!(relay.is_running());
    let end = relay.stop().unwrap();
    offered_is_accounted_for(&end.up);
    assert_eq!(end.receive_errors, 0);
}

#[test]
fn the_relay_outlives_a_client_that_is_gone_and_a_target_that_begins_again() {
    let server = socket(LOCAL);
    let to = server.local_addr().unwrap();
    let relay = relay(LOCAL, to, "delay 1ms", "delay 1ms");
    let (gone, stays) = (socket(LOCAL), socket(LOCAL));
    gone.send_to(b"here", relay.local_addr()).unwrap();
    let (_, to_gone) = receive(&server);
    drop(gone);
    // the client's host answers these with "nobody listens here"
    for _ in 0..20 {
        server.send_to(b"for you", to_gone).unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
    stays.send_to(b"still here", relay.local_addr()).unwrap();
    let (heard, to_stays) = receive(&server);
    assert_eq!(heard, b"still here");
    server.send_to(b"and you", to_stays).unwrap();
    assert_eq!(receive(&stays).0, b"and you");

    // the target dies; while it is gone, what is sent to it is lost
    drop(server);
    for _ in 0..20 {
        stays.send_to(b"lost", relay.local_addr()).unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
    until(&relay, |seen| {
        seen.unreachable > 0 && seen.up.in_flight == 0
    });
    let again = UdpSocket::bind(to).unwrap();
    again.set_read_timeout(Some(PATIENCE)).unwrap();
    stays.send_to(b"again", relay.local_addr()).unwrap();
    let (heard, from) = receive(&again);
    // its client has kept its port
    assert_eq!((heard, from), (b"again".to_vec(), to_stays));
    let seen = relay.stop().unwrap();
    assert_eq!((seen.clients, seen.clients_met), (2, 2));
    offered_is_accounted_for(&seen.up);
    offered_is_accounted_for(&seen.down);
    // forgotten or not, nothing was refused
    assert_eq!(seen.refused, Tally::default());
}

#[test]
fn empty_and_large_datagrams_pass_whole() {
    let server = socket(LOCAL);
    let relay = relay(LOCAL, server.local_addr().unwrap(), "delay 1ms", "none");
    let client = socket(LOCAL);
    for len in [0, 1, 1472] {
        client.send_to(&vec![3; len], relay.local_addr()).unwrap();
        assert_eq!(receive(&server).0, vec![3; len]);
    }
}

#[test]
fn stopping_is_prompt_with_packets_in_flight_and_frees_the_address() {
    let server = socket(LOCAL);
    let relay = relay(LOCAL, server.local_addr().unwrap(), "delay 3600s", "none");
    let client = socket(LOCAL);
    client.send_to(b"late", relay.local_addr()).unwrap();
    until(&relay, |seen| seen.up.in_flight == 1);
    let address = relay.local_addr();
    // would take an hour if it waited for the packet
    let end = relay.stop().unwrap();
    assert_eq!(end.up.in_flight, 1);
    offered_is_accounted_for(&end.up);
    UdpSocket::bind(address).unwrap();
}

#[test]
fn what_cannot_work_is_refused_at_the_start() {
    let config = LinkConfig::default;
    let start =
        |listen, to| Relay::bind(listen, to, config(), config(), 1, Extras::default()).unwrap_err();
    let any = SocketAddr::from((LOCAL, 0));
    assert!(matches!(start(any, any), RelayError::Target { .. }));
    let taken = socket(LOCAL);
    let address = taken.local_addr().unwrap();
    assert!(matches!(
        start(address, (LOCAL, 9).into()),
        RelayError::Listen { .. }
    ));
    assert!(matches!(start(address, address), RelayError::Loop { .. }));
    let bad = LinkConfig {
        limit: Limit {
            packets: 0,
            bytes: 1,
        },
        ..config()
    };
    let refused = Relay::bind(any, address, config(), bad, 1, Extras::default());
    assert!(matches!(refused, Err(RelayError::Config(_))));
}

#[test]
fn a_new_port_toward_the_target_looks_like_a_nat_that_forgot() {
    let server = socket(LOCAL);
    let relay = relay(LOCAL, server.local_addr().unwrap(), "none", "none");
    let client = socket(LOCAL);
    client.send_to(b"before", relay.local_addr()).unwrap();
    let (_, before) = receive(&server);
    relay.rebind();
    until(&relay, |seen| seen.rebinds == 1);
    client.send_to(b"after", relay.local_addr()).unwrap();
    let (contents, after) = receive(&server);
    assert_eq!(contents, b"after");
    assert_ne!(before, after);
    // the way back goes through the new port, and the client sees no change
    server.send_to(b"answer", after).unwrap();
    assert_eq!(receive(&client), (b"answer".to_vec(), relay.local_addr()));
    let end = relay.stop().unwrap();
    assert_eq!((end.clients_met, end.rebinds), (1, 1));
}

#[test]
fn rebinding_goes_on_by_itself_when_asked_for() {
    let server = socket(LOCAL);
    let extras = Extras {
        rebind_every: Some(Duration::from_millis(5)),
        ..Extras::default()
    };
    let (any, to) = ((LOCAL, 0).into(), server.local_addr().unwrap());
    let none = LinkConfig::default;
    let relay = Relay::bind(any, to, none(), none(), 1, extras).unwrap();
    socket(LOCAL).send_to(b"hello", relay.local_addr()).unwrap();
    receive(&server);
    until(&relay, |seen| seen.rebinds >= 3);
}

#[test]
fn a_running_relay_takes_new_settings() {
    let server = socket(LOCAL);
    let relay = relay(LOCAL, server.local_addr().unwrap(), "loss 100%", "none");
    let client = socket(LOCAL);
    client.send_to(b"lost", relay.local_addr()).unwrap();
    until(&relay, |seen| seen.up.link.dropped.loss.packets == 1);
    let bad = LinkConfig {
        limit: Limit {
            packets: 0,
            bytes: 1,
        },
        ..LinkConfig::default()
    };
    assert!(relay.reconfigure(bad, LinkConfig::default()).is_err());
    let none = LinkConfig::default;
    relay.reconfigure(none(), none()).unwrap();
    // the order is obeyed soon, not at once
    let start = Instant::now();
    server
        .set_read_timeout(Some(Duration::from_millis(20)))
        .unwrap();
    let mut buffer = [0; 10];
    while server.recv_from(&mut buffer).is_err() {
        assert!(start.elapsed() < PATIENCE);
        client.send_to(b"passes", relay.local_addr()).unwrap();
    }
    assert_eq!(&buffer[..6], b"passes");
}

#[test]
fn every_packet_is_on_record_in_both_forms() {
    let directory = tempfile::tempdir().unwrap();
    for name in ["record.csv", "record.bin"] {
        let path = directory.path().join(name);
        let words = "delay 2ms loss 30% duplicate 30% corrupt 20%";
        let heading = crate::record::Heading {
            seed: 1,
            up: words.to_owned(),
            down: "none".to_owned(),
        };
        let server = socket(LOCAL);
        let file = RecordFile::create(&path, &heading).unwrap();
        let extras = Extras {
            record: Some(file.writer()),
            ..Extras::default()
        };
        let (any, to) = ((LOCAL, 0).into(), server.local_addr().unwrap());
        let up = words.parse().unwrap();
        let relay = Relay::bind(any, to, up, LinkConfig::default(), 1, extras).unwrap();
        let client = socket(LOCAL);
        for number in 0..100_u8 {
            client.send_to(&[number; 50], relay.local_addr()).unwrap();
        }
        until(&relay, |seen| {
            seen.up.link.offered.packets == 100 && seen.up.in_flight == 0
        });
        let end = relay.stop().unwrap();
        assert_eq!((end.unrecorded, file.finish().unwrap()), (0, 0));
        offered_is_accounted_for(&end.up);
        let (read, entries) = crate::record::read(&std::fs::read(&path).unwrap()).unwrap();
        assert_eq!(read, heading);
        let summary = crate::record::summary::Summary::of(&entries, crate::Direction::Up);
        assert_eq!(summary.sent, end.up.sent, "{name}");
        assert!(end.up.link.duplicated.packets > 0 && end.up.link.corrupted.packets > 0);
        assert_eq!(summary.corrupted, end.up.link.corrupted.packets);
        let entry = |number| entries.iter().any(|entry| entry.number == number);
        assert!((0..100).all(entry), "{name}");
    }
}

#[test]
fn a_thousand_clients_have_a_port_each_and_are_answered_each() {
    const CLIENTS: usize = 1000;
    let server = socket(LOCAL);
    let none = || LinkConfig::default();
    let extras = Extras {
        clients: Some(CLIENTS),
        ..Extras::default()
    };
    let to = server.local_addr().unwrap();
    let relay = Relay::bind((LOCAL, 0).into(), to, none(), none(), 1, extras).unwrap();
    let mut ports = std::collections::BTreeSet::new();
    for client in 0..CLIENTS {
        // an address each, and a socket only while it is needed
        let [.., high, low] = client.to_be_bytes();
        let client = socket(Ipv4Addr::new(127, 1, high, low).into());
        client.send_to(&[high, low], relay.local_addr()).unwrap();
        let (contents, from) = receive(&server);
        assert_eq!(contents, [high, low]);
        ports.insert(from);
        server.send_to(&contents, from).unwrap();
        assert_eq!(receive(&client).0, [high, low]);
    }
    assert_eq!(ports.len(), CLIENTS);
    // the first one has said nothing since, and makes room once that is long enough
    let newcomer = socket(Ipv4Addr::new(127, 2, 0, 1).into());
    let start = Instant::now();
    while relay.snapshot().clients_met < 1001 {
        assert!(start.elapsed() < PATIENCE);
        newcomer.send_to(b"one more", relay.local_addr()).unwrap();
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(receive(&server).0, b"one more");
    let end = relay.stop().unwrap();
    assert_eq!((end.clients, end.clients_displaced), (1000, 1));
}

/// Each client's answers are in a socket of their own; the link is that of all.
#[test]
fn what_comes_for_several_clients_at_once_reaches_each_whole_and_in_order() {
    let server = socket(LOCAL);
    let relay = relay(LOCAL, server.local_addr().unwrap(), "none", "delay 3ms");
    let clients = [socket(LOCAL), socket(LOCAL)];
    let ports = clients.each_ref().map(|client| {
        client.send_to(b"hello", relay.local_addr()).unwrap();
        receive(&server).1
    });
    // a burst to either in turn, of which the relay reads much at once
    for number in 0..50_u8 {
        for port in &ports {
            server.send_to(&[number], port).unwrap();
        }
    }
    for client in &clients {
        for number in 0..50_u8 {
            assert_eq!(receive(client).0, [number]);
        }
    }
    let end = until(&relay, |seen| seen.down.sent.packets == 100);
    offered_is_accounted_for(&end.down);
    assert_eq!(relay.stop().unwrap().down.link.offered.packets, 100);
}
