//! How the live processes end: in time, with their report, with the exit code that is promised.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "starts and signals processes, lets sessions go on for a while"
)]

use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde_json::Value;

use crate::harness::process::{Ended, PROGRAM, Running, did_not_run, number};
use crate::harness::{in_real_time, root};

/// For what needs no more than a start or an end, on a host that stands still for a while.
const SOON: Duration = Duration::from_secs(60);
/// What is promised from the signal to the end of the process, the farewell included, which a link of no delay costs nothing; and
/// what a host that others use as well may add.
const PROMPTLY: (Duration, Duration) = (Duration::from_secs(1), Duration::from_secs(2));

/// A slave on a port of the system's choice, and its pairing string.
fn slave(options: &[&str]) -> (Running, String) {
    Running::slave(options).unwrap()
}

/// A master whose session has begun.
fn master(pairing: &str, options: &[&str]) -> Running {
    let arguments = [&["master", pairing, "--json"], options].concat();
    let mut master = Running::mmt(&arguments).unwrap();
    let begun = master.wait_for_line(SOON, |line| line.contains("the session begins"));
    begun.unwrap();
    master
}

fn ending(report: &Value) -> &str {
    let ending = report.pointer("/ending").and_then(Value::as_str);
    ending.unwrap_or("none")
}

/// What must be true of whatever ended, and how: an exit code, no panic.
fn ended_with(code: i32, ended: &Ended) {
    assert_eq!(ended.status.code(), Some(code), "{}", ended.err);
    assert!(!ended.err.contains("panicked at"), "{}", ended.err);
}

/// Whether a process that was asked to end `since` has kept its promise.
fn promptly(ended: &Ended, since: Instant) {
    let (promised, host) = PROMPTLY;
    let took = ended.at.saturating_duration_since(since);
    assert!(took < promised + host, "{took:?}: {}", ended.err);
}

#[test]
fn the_master_that_is_interrupted_ends_both_sides_with_their_reports() {
    in_real_time(|| {
        let (slave, pairing) = slave(&["--once"]);
        let master = master(&pairing, &["--duration", "60s"]);
        std::thread::sleep(Duration::from_secs(10));
        let asked = Instant::now();
        master.signal(Signal::TERM).unwrap();
        let (master, slave) = (master.end(SOON).unwrap(), slave.end(SOON).unwrap());
        for (ended, skip) in [(&master, 0), (&slave, 1)] {
            ended_with(0, ended);
            promptly(ended, asked);
            let report = ended.document(skip).unwrap();
            assert_eq!(ending(&report), "interrupted", "{}", ended.err);
            let error = number(&report, "/force/relative_error");
            assert!(error > Some(0.0), "{error:?}: {}", ended.err);
        }
    });
}

#[test]
fn the_slave_that_is_interrupted_ends_both_sides_with_their_reports() {
    in_real_time(|| {
        let (slave, pairing) = slave(&[]);
        let master = master(&pairing, &["--duration", "60s"]);
        std::thread::sleep(Duration::from_secs(3));
        let asked = Instant::now();
        slave.interrupt().unwrap();
        let (master, slave) = (master.end(SOON).unwrap(), slave.end(SOON).unwrap());
        for (ended, skip) in [(&master, 0), (&slave, 1)] {
            ended_with(0, ended);
            promptly(ended, asked);
            let report = ended.document(skip).unwrap();
            assert_eq!(ending(&report), "interrupted", "{}", ended.err);
            let datagrams = number(&report, "/wire/up/datagrams");
            assert!(datagrams > Some(10.0), "{datagrams:?}: {}", ended.err);
        }
    });
}

/// A slave whose master is killed in the middle of a session, once the slave has noticed.
fn slave_of_a_killed_master(options: &[&str]) -> Running {
    let (mut slave, pairing) = slave(options);
    let master = master(&pairing, &[]);
    std::thread::sleep(Duration::from_secs(1));
    // dropped, it is killed
    drop(master);
    let noticed = slave.wait_for_line(SOON, |line| {
        line.contains("the master has been silent for 2s: the session is over")
            || line.contains("the connection was lost")
    });
    noticed.unwrap();
    slave
}

#[test]
fn a_slave_of_one_session_whose_master_is_killed_ends_with_its_report_and_exit_code_1() {
    in_real_time(|| {
        let slave = slave_of_a_killed_master(&["--once"]).end(SOON).unwrap();
        ended_with(1, &slave);
        let report = slave.document(1).unwrap();
        assert_eq!(ending(&report), "failed", "{}", slave.err);
        assert!(number(&report, "/slave_loop/ticks") > Some(0.0));
        assert!(slave.err.contains("ended early"), "{}", slave.err);
    });
}

#[test]
fn a_slave_that_goes_on_serving_is_not_judged_by_its_last_session() {
    in_real_time(|| {
        let slave = slave_of_a_killed_master(&[]);
        slave.interrupt().unwrap();
        let slave = slave.end(SOON).unwrap();
        ended_with(0, &slave);
        assert_eq!(ending(&slave.document(1).unwrap()), "failed");
    });
}

/// `mmt`, which can write no file longer than so many blocks of 512 or 1024 bytes: a disk that becomes full.
fn on_a_small_disk(blocks: u32, arguments: &[&str]) -> Running {
    let mut command = Command::new("sh");
    // a process that ignores the signal gets an error instead
    let limited = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$@\"");
    command.args(["-c", &limited, "sh", PROGRAM]);
    command.args(arguments);
    Running::start(command).unwrap()
}

#[test]
fn a_record_of_packets_on_a_full_disk_does_not_cost_the_report() {
    in_real_time(|| {
        let place = tempfile::tempdir().unwrap();
        let record = place.path().join("packets.csv");
        let record = record.to_str().unwrap();
        let demo = [
            "demo",
            "--duration",
            "2s",
            "--json",
            "--netem-record",
            record,
        ];
        let demo = on_a_small_disk(4, &demo).end(SOON).unwrap();
        ended_with(1, &demo);
        assert_eq!(ending(&demo.document(0).unwrap()), "finished");
        assert!(demo.err.contains("packets.csv"), "{}", demo.err);
        assert!(demo.err.contains("File too large"), "{}", demo.err);
    });
}

#[test]
fn a_relay_whose_record_is_on_a_full_disk_prints_its_report() {
    let place = tempfile::tempdir().unwrap();
    let record = place.path().join("packets.csv");
    let listen = ["netem", "--listen", "127.0.0.1:0", "--to", "127.0.0.1:9"];
    let record = ["--json", "--record", record.to_str().unwrap()];
    let mut relay = on_a_small_disk(4, &[&listen[..], &record].concat());
    let address = relay.first_line(SOON).unwrap();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    // a line of the record is longer than 40 bytes
    for _ in 0..500 {
        socket.send_to(&[0; 100], &address).unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
    relay.interrupt().unwrap();
    let relay = relay.end(SOON).unwrap();
    ended_with(1, &relay);
    let report = relay.document(1).unwrap();
    let offered = number(&report, "/counters/up/link/offered/packets");
    assert!(offered > Some(400.0), "{report:#}");
    assert!(relay.err.contains("File too large"), "{}", relay.err);
}

#[test]
fn a_path_that_cannot_be_written_does_not_cost_the_report() {
    in_real_time(|| {
        let (slave, pairing) = slave(&["--once"]);
        let path = ["--duration", "2s", "--record-path", "/dev/full"];
        let master = master(&pairing, &path).end(SOON).unwrap();
        ended_with(1, &master);
        assert_eq!(ending(&master.document(0).unwrap()), "finished");
        assert!(master.err.contains("/dev/full"), "{}", master.err);
        ended_with(0, &slave.end(SOON).unwrap());
    });
}

/// What blocks a thread of a program for good, compiled; none where there is no compiler.
fn hang(place: &Path) -> Option<PathBuf> {
    let shim = place.join("hang.so");
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-O1", "-Wall", "-Wextra", "-Werror"]);
    compiler.arg("-o").arg(&shim);
    compiler.arg(root().join("tests/faults/hang.c"));
    let Ok(compiling) = Running::start(compiler) else {
        did_not_run("a tick that hangs in a process", "there is no cc");
        return None;
    };
    let ended = compiling.end(SOON).unwrap();
    assert!(ended.status.success(), "{}", ended.err);
    Some(shim)
}

#[test]
fn a_slave_whose_tick_hangs_ends_with_exit_code_6_and_its_master_with_1() {
    in_real_time(|| {
        let place = tempfile::tempdir().unwrap();
        let Some(shim) = hang(place.path()) else {
            return;
        };
        let when = place.path().join("now");
        let mut command = Command::new(PROGRAM);
        command.args(["slave", "--listen", "127.0.0.1:0", "--json"]);
        command.env("LD_PRELOAD", shim);
        command.env("HANG_THREAD", "mmt-slave");
        command.env("HANG_WHEN", &when);
        let mut slave = Running::start(command).unwrap();
        let pairing = slave.pairing().unwrap();
        let master = master(&pairing, &["--duration", "60s"]);
        std::thread::sleep(Duration::from_secs(1));
        std::fs::write(&when, "").unwrap();
        let (slave, master) = (slave.end(SOON).unwrap(), master.end(SOON).unwrap());
        ended_with(6, &slave);
        assert!(slave.err.contains("has hung"), "{}", slave.err);
        ended_with(1, &master);
        assert_eq!(ending(&master.document(0).unwrap()), "failed");
    });
}
