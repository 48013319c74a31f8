//! What a hostile peer or a careless host does to the command: text for the terminal, a log that nobody reads.

use std::io::Write;
use std::process::Stdio;

use mmt_shared::io::congestion::RateCap;
use mmt_shared::io::connect::connect;
use mmt_shared::io::quic::{Traffic, client_endpoint};
use mmt_shared::io::socket;
use mmt_shared::io::transport::CLOSE_FINISHED;
use mmt_shared::pairing::Pairing;
use rustix::process::{Pid, Signal, kill_process};

use super::{PATIENCE, hearing_hang_up, mmt, start};

const SLAVE: [&str; 5] = ["slave", "--listen", "127.0.0.1:0", "--json", "--identity"];

/// Connects as anybody can, without the token, and closes with this reason.
fn close_with(pairing: &Pairing, reason: &[u8]) {
    let runtime = tokio::runtime::Builder::new_current_thread();
    let runtime = { runtime }.enable_all().build().unwrap();
    runtime.block_on(async {
        let address = pairing.address.to_string().parse().unwrap();
        let own = socket::bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let endpoint = client_endpoint(socket::for_quic(own).unwrap()).unwrap();
        let traffic = Traffic {
            datagram_max: 400,
            rate_cap: RateCap {
                bytes_per_s: 300_000,
            },
        };
        let connected = connect(&endpoint, address, pairing.pin, traffic, PATIENCE);
        connected.await.unwrap().close(CLOSE_FINISHED, reason);
        endpoint.wait_idle().await;
    });
}

#[test]
fn the_words_of_a_stranger_steer_no_terminal_and_forge_no_line() {
    let home = tempfile::tempdir().unwrap();
    let (mut slave, line) = start(mmt(&home, &[&SLAVE[..], &["identity"]].concat()));
    let hostile = "bye\x1b[2J\r\n INFO 10.0.0.7 operates\u{202e}\u{9b}31m";
    close_with(&line.parse().unwrap(), hostile.as_bytes());
    let shown = slave.wait_for_line(PATIENCE, |line| line.contains("10.0.0.7 operates"));
    let shown = shown.unwrap();
    assert!(
        shown.contains("was not let in") && shown.contains("?? INFO"),
        "{shown:?}"
    );
    slave.interrupt().unwrap();
    let ended = slave.end(PATIENCE).unwrap();
    let unfit = |c: char| (c.is_control() && c != '\n') || matches!(c, '\u{202a}'..='\u{202e}');
    assert!(!ended.err.contains(unfit), "{:?}", ended.err);
}

#[test]
fn a_slave_whose_log_nobody_reads_ends_on_sigterm_and_on_sighup_with_its_report() {
    for signal in [Signal::TERM, Signal::HUP] {
        let home = tempfile::tempdir().unwrap();
        // what a pipe holds by default: from here on every write to it waits
        let (_unread, mut full) = std::io::pipe().unwrap();
        full.write_all(&[b'.'; 65_536]).unwrap();
        let slave = mmt(&home, &[&SLAVE[..], &["identity"]].concat());
        let mut command = hearing_hang_up(&slave);
        let mut child = command.stderr(Stdio::from(full)).spawn().unwrap();
        // the process alone holds the other end now
        drop(command);
        let mut out = std::io::BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        std::io::BufRead::read_line(&mut out, &mut line).unwrap();
        close_with(&line.trim().parse().unwrap(), b"bye");
        let pid = Pid::from_raw(i32::try_from(child.id()).unwrap()).unwrap();
        kill_process(pid, signal).unwrap();
        let (send, ended) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let mut report = String::new();
            let read = std::io::Read::read_to_string(&mut out, &mut report);
            send.send(read.map(|_| report))
        });
        let report = ended.recv_timeout(PATIENCE);
        // it is killed whatever comes, so that the test ends
        let status = if report.is_ok() {
            child.wait()
        } else {
            child.kill().and_then(|()| child.wait())
        };
        let report: serde_json::Value = serde_json::from_str(&report.unwrap().unwrap()).unwrap();
        assert_eq!(report["command"], "slave");
        assert!(status.unwrap().success(), "{signal:?}");
    }
}
