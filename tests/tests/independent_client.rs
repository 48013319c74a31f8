//! A master in another language (`tests/protocol/client.py`, which knows `docs/protocol.md` only) against the
//! real slave, and what the dissector makes of their session.
//!
//! Needs Python with aioquic, and tshark: without, it says so, and with `CI` set it fails.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
#![allow(clippy::disallowed_methods, reason = "starts processes")]

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use crate::harness::process::{Ended, ProcessError, Running, did_not_run, number};
use crate::harness::python::python;
use crate::harness::tshark::{TsharkError, tshark};
use crate::harness::{in_real_time, root};
use serde_json::{Value, json};

/// For what takes seconds; the host may be busy.
const GENEROUS: Duration = Duration::from_secs(60);
/// Exit codes of the client, as its opening lists them.
const REFUSED: i32 = 3;
const WRONG_PIN: i32 = 4;
const NO_PROTOCOL: i32 = 5;

fn ok<T>(result: Result<T, ProcessError>) -> T {
    result.unwrap_or_else(|error| panic!("{error}"))
}

/// A slave with an identity of its own, and its pairing string.
fn slave(place: &Path) -> (Running, String) {
    let identity = place.join("identity");
    let identity = identity.to_str().unwrap();
    ok(Running::slave(&["--once", "--identity", identity]))
}

fn client(python: &str, pairing: &str, options: &[&str]) -> Ended {
    let mut command = Command::new(python);
    command.arg(root().join("tests/protocol/client.py"));
    command.arg(pairing).args(options);
    ok(ok(Running::start(command)).end(GENEROUS))
}

/// The document of a client that ended with this code.
fn said(ended: &Ended, code: i32) -> Value {
    assert_eq!(
        ended.status.code(),
        Some(code),
        "{:?} {}",
        ended.out,
        ended.err
    );
    ok(ended.document(0))
}

fn get(document: &Value, path: &str) -> f64 {
    number(document, path).unwrap_or_else(|| panic!("{path} in {document:#}"))
}

/// The pairing string with another first digit of `key`.
fn altered(pairing: &str, key: &str) -> String {
    let (head, tail) = pairing.split_once(&format!("{key}=")).unwrap();
    let (first, rest) = tail.split_at(1);
    let other = if first == "0" { "1" } else { "0" };
    format!("{head}{key}={other}{rest}")
}

#[test]
fn a_master_that_knows_only_the_document_pushes_the_box_of_the_real_slave() {
    in_real_time(|| {
        let test = "the session of the independent client";
        let Some(python) = python(test, "aioquic") else {
            return;
        };
        let place = tempfile::tempdir().unwrap();
        let (capture, keys) = (place.path().join("session.pcap"), place.path().join("keys"));
        let (slave, pairing) = slave(place.path());
        let options = [
            "--capture",
            capture.to_str().unwrap(),
            "--keys",
            keys.to_str().unwrap(),
        ];
        let client = said(&client(&python, &pairing, &options), 0);
        let slave = ok(slave.end(GENEROUS));
        assert_eq!(slave.status.code(), Some(0), "{}", slave.err);
        let slave = ok(slave.document(1));
        assert_eq!(client.pointer("/outcome"), Some(&json!("finished")));
        assert_eq!(slave.pointer("/ending"), Some(&json!("finished")));
        it_pushed(&client);
        both_counted_the_same(&client, &slave);
        the_dissector_shows_it(test, &client, &capture, &keys, &pairing);
    });
}

/// Contact came and went, updates told so, and what they told is what the object is.
fn it_pushed(client: &Value) {
    let triggered = ["master_only_contact", "slave_only_contact", "contact_lost"];
    let counts = triggered.map(|cause| number(client, &format!("/causes/{cause}")));
    let contact: f64 = counts.iter().flatten().sum();
    assert!(contact >= 1.0, "{client:#}");
    assert_eq!(client.pointer("/touched"), Some(&json!(true)), "{client:#}");
    let applied = get(client, "/updates_applied");
    assert!(applied >= 3.0, "{client:#}");
    let moved = get(client, "/last_state/x") - get(client, "/welcome/state/x");
    assert!(moved > 0.05, "the object moved by {moved} m");
    let before = get(client, "/welcome/state/m");
    // how well it is known in so short a push depends on the host; that it is learnt and sent does not
    assert_ne!(get(client, "/last_state/m"), before, "the mass");
    assert!(get(client, "/rtt_ms") >= 0.0);
}

/// No message was malformed to either side, and what one sent the other received: nothing is lost here.
fn both_counted_the_same(client: &Value, slave: &Value) {
    let theirs = "/slave_farewell/report/session";
    for name in
        ["malformed", "too_old", "implausible", "duplicate"].map(|why| format!("datagrams_{why}"))
    {
        assert_eq!(get(client, &format!("/{name}")), 0.0, "{name}");
        assert_eq!(
            get(client, &format!("{theirs}/drops/{name}")),
            0.0,
            "{name}"
        );
    }
    assert_eq!(get(client, "/updates_dropped/rejected"), 0.0);
    let commands = get(client, "/sent/commands");
    assert!(commands > 100.0, "{commands}");
    // a host that was starved drops some on its way to the loop; nobody makes one up
    let received = get(client, &format!("{theirs}/received/commands"));
    assert!(
        0.0 < received && received <= commands,
        "{received} of {commands}"
    );
    assert_eq!(get(slave, "/messages/up/commands"), received);
    assert!(get(client, "/sent/heartbeats") >= 1.0 && get(client, "/received/heartbeats") >= 1.0);
    let updates = get(client, "/received/updates");
    assert!(updates <= get(client, &format!("{theirs}/sent/updates")));
}

/// The decrypted session in tshark: every message of the client and the slave, by type, and none malformed.
fn the_dissector_shows_it(test: &str, client: &Value, capture: &Path, keys: &Path, pairing: &str) {
    let port = pairing
        .split(['/', '?', ':'])
        .find_map(|part| part.parse::<u16>().ok());
    let mut options = vec![
        "-o".to_owned(),
        format!("tls.keylog_file:{}", keys.display()),
        "-o".to_owned(),
        format!("mmt.slave_port:{}", port.unwrap()),
    ];
    options.extend(["-d".to_owned(), format!("udp.port=={},quic", port.unwrap())]);
    let columns = "-T fields -e mmt.type -e mmt.malformed";
    options.extend(columns.split(' ').map(str::to_owned));
    // docs/protocol.md, section 9: Wireshark 4.0 does not follow a Retry
    let rest = capture.with_extension("rest");
    let cut = std::process::Command::new("editcap")
        .args([capture, &rest])
        .arg("1-2")
        .status();
    let text = match tshark(&rest, &options) {
        Ok(text) => text,
        Err(TsharkError::Missing(error)) => {
            return did_not_run(test, &format!("tshark does not start: {error}"));
        }
        Err(error) => panic!("{error}"),
    };
    assert!(cut.unwrap().success(), "editcap comes with tshark");
    let malformed = text.lines().filter_map(|line| line.split_once('\t'));
    assert_eq!(
        malformed.filter(|(_, said)| !said.is_empty()).count(),
        0,
        "{text}"
    );
    let shown = |kind| {
        text.split([',', '\n', '\t'])
            .filter(|name| *name == kind)
            .count()
    };
    let counted = |kind: &str| get(client, kind) as usize;
    assert_eq!(shown("command"), counted("/sent/commands"));
    assert_eq!(shown("update"), counted("/received/updates"));
    // before the welcome was read and after the last count there are more
    assert!(shown("heartbeat") >= counted("/sent/heartbeats") + counted("/received/heartbeats"));
    // the slave's farewell is longer than a packet, and such a message stays unshown (docs/protocol.md, section 9)
    for (kind, count) in [("hello", 1), ("welcome", 1), ("farewell", 1)] {
        assert_eq!(shown(kind), count, "{kind}");
    }
}

#[test]
fn who_has_another_pin_or_token_or_version_gets_no_session() {
    in_real_time(|| {
        let Some(python) = python("the refusals of the independent client", "aioquic") else {
            return;
        };
        let place = tempfile::tempdir().unwrap();
        let (slave, pairing) = slave(place.path());
        let refused = said(&client(&python, &altered(&pairing, "token"), &[]), REFUSED);
        assert_eq!(
            refused,
            json!({ "outcome": "refused", "refusal": "wrong_token" })
        );
        let other = said(&client(&python, &altered(&pairing, "pin"), &[]), WRONG_PIN);
        assert_eq!(other.pointer("/outcome"), Some(&json!("wrong_pin")));
        let offered = other.pointer("/offered").and_then(Value::as_str).unwrap();
        assert!(pairing.contains(&format!("pin={offered}")), "{offered}");
        let none = said(
            &client(&python, &pairing, &["--alpn", "mmt/2"]),
            NO_PROTOCOL,
        );
        assert_eq!(none.pointer("/code"), Some(&json!(0x178)));
        ok(slave.interrupt());
        let slave = ok(slave.end(GENEROUS));
        assert!(!slave.err.contains("panicked"), "{}", slave.err);
        for what in ["WrongToken", "no handshake with"] {
            assert!(slave.err.contains(what), "{what}: {}", slave.err);
        }
    });
}

#[test]
fn an_observer_that_knows_only_the_document_sees_what_the_master_beside_it_is_sent() {
    in_real_time(|| {
        let Some(python) = python("the observer of the independent client", "aioquic") else {
            return;
        };
        let place = tempfile::tempdir().unwrap();
        let (mut slave, pairing) = slave(place.path());
        let mut command = Command::new(&python);
        command.arg(root().join("tests/protocol/client.py"));
        command.args([&pairing, "--observe"]);
        let observer = ok(Running::start(command));
        ok(slave.wait_for_line(GENEROUS, |line| line.contains("looks on as operator")));
        said(&client(&python, &pairing, &[]), 0);
        // the slave ends after its first session; so does the observer
        let observer = said(&ok(observer.end(GENEROUS)), 0);
        let slave = ok(slave.end(GENEROUS));
        assert_eq!(slave.status.code(), Some(0), "{}", slave.err);
        it_pushed(&observer);
        let resume = observer.pointer("/welcome/resume").cloned();
        assert_eq!(resume, Some(json!("00".repeat(32))));
        assert!(get(&observer, "/received/scenes") > 1.0);
        assert_eq!(get(&observer, "/sent/commands"), 0.0);
        assert_eq!(get(&observer, "/updates_dropped/rejected"), 0.0);
        assert_eq!(get(&observer, "/received/tools"), 0.0);
        let ending = observer.pointer("/slave_farewell/ending");
        assert_eq!(ending, Some(&json!("interrupted")), "{observer:#}");
        let slave = ok(slave.document(1));
        assert_eq!(get(&slave, "/drops/observer_commands_refused"), 0.0);
    });
}
