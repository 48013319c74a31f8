//! `mmt netem` as a process: who finds a place at the relay, and what it says of a relay that stood still.

use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde_json::Value;

use super::{mmt, start};
use crate::harness::process::Running;

const PATIENCE: Duration = Duration::from_secs(30);

/// A relay with one place, two clients of it, and its target.
struct Relayed {
    relay: Running,
    address: SocketAddr,
    client: UdpSocket,
    other: UdpSocket,
    target: UdpSocket,
}

impl Relayed {
    fn start(home: &tempfile::TempDir, more: &[&str]) -> Self {
        let [client, other, target] = [(); 3].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
        client.set_read_timeout(Some(PATIENCE)).unwrap();
        target.set_read_timeout(Some(PATIENCE)).unwrap();
        let to = target.local_addr().unwrap().to_string();
        let arguments = ["netem", "--listen", "127.0.0.1:0", "--to", &to, "--json"];
        let one = ["--clients", "1"];
        let (relay, line) = start(mmt(home, &[&arguments[..], &one, more].concat()));
        Self {
            relay,
            address: line.parse().unwrap(),
            client,
            other,
            target,
        }
    }

    /// The client says something, which reaches the target; where it came from.
    fn passes(&self, contents: &[u8]) -> SocketAddr {
        self.client.send_to(contents, self.address).unwrap();
        let (length, from) = self.target.recv_from(&mut [0; 10]).unwrap();
        assert_eq!(length, contents.len());
        from
    }

    fn is_answered(&self, from: SocketAddr) {
        self.target.send_to(b"answer", from).unwrap();
        assert_eq!(self.client.recv(&mut [0; 10]).unwrap(), 6);
    }

    /// Its messages and its report.
    fn end(self) -> (String, Value) {
        self.relay.interrupt().unwrap();
        let ended = self.relay.end(super::PATIENCE).unwrap();
        let report = ended.document(1).unwrap();
        (ended.err, report)
    }
}

#[test]
fn a_client_too_many_and_a_relay_that_stood_still_are_in_its_report() {
    let home = tempfile::tempdir().unwrap();
    let relayed = Relayed::start(&home, &["--up", "delay 5ms"]);
    // who has talked for two seconds may be silent for as long
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(2) {
        let from = relayed.passes(b"first");
        relayed.is_answered(from);
        std::thread::sleep(Duration::from_millis(20));
    }
    relayed
        .other
        .send_to(b"one too many", relayed.address)
        .unwrap();
    relayed.passes(b"second");
    relayed.relay.signal(Signal::STOP).unwrap();
    relayed.client.send_to(b"early", relayed.address).unwrap();
    std::thread::sleep(Duration::from_millis(200));
    relayed.relay.signal(Signal::CONT).unwrap();
    assert_eq!(relayed.target.recv(&mut [0; 10]).unwrap(), 5);
    let (messages, report) = relayed.end();
    assert!(messages.contains("(--clients)"), "{messages}");
    assert_eq!(report["refused_clients"], true);
    assert_eq!(report["displaced_clients"], false);
    assert_eq!(report["counters"]["refused"]["packets"], 1);
    assert_eq!(report["counters"]["clients"], 1);
    // it came while the relay stood still, and was due 5 ms later
    let late = &report["counters"]["lateness"]["max_us"];
    assert!(late.as_f64().unwrap() >= 190e3, "{late}");
    assert_eq!(report["degraded"], true);
}

#[test]
fn a_client_that_nobody_answers_makes_room_for_a_newer_one() {
    let home = tempfile::tempdir().unwrap();
    let relayed = Relayed::start(&home, &[]);
    relayed.passes(b"first");
    relayed.other.send_to(b"newer", relayed.address).unwrap();
    assert_eq!(relayed.target.recv(&mut [0; 10]).unwrap(), 5);
    let (messages, report) = relayed.end();
    assert!(messages.contains("(1) made room"), "{messages}");
    assert_eq!(report["displaced_clients"], true);
    assert_eq!(report["refused_clients"], false);
    assert_eq!(report["counters"]["clients_displaced"], 1);
    assert_eq!(report["counters"]["clients_met"], 2);
    assert_eq!(report["counters"]["clients"], 1);
}
