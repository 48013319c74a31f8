//! The commands at work, as processes: what they print where, and how they end.

use serde_json::Value;
use std::fmt::Write;

use super::{document, finish, judged, mmt, start};

/// A recording of pushes along +x of a block that takes 2 N, each 1 cm long.
pub(super) fn recording(pushes: u32) -> String {
    let mut text = format!("{pushes}\n");
    for push in 0..pushes {
        let (from, to) = (10.0 * f64::from(push), 10.0 * f64::from(push + 1));
        for x in [from, to] {
            writeln!(text, "{x} 0 0 1 0 0 0").unwrap();
        }
        writeln!(text, "100").unwrap();
        for sample in 0..100_u32 {
            let newtons = if sample < 20 { 0.0 } else { -2.0 };
            writeln!(text, "{} {newtons} 0", f64::from(sample) * 0.01).unwrap();
        }
        writeln!(text, "34").unwrap();
        for sample in 0..34_u32 {
            let x = from + 10.0 * f64::from(sample) / 33.0;
            writeln!(text, "{} {x} 50 0 1 0 0 0", f64::from(sample) * 0.03).unwrap();
        }
    }
    text
}

fn replay(arguments: &[&str]) -> String {
    let home = tempfile::tempdir().unwrap();
    for name in ["a.txt", "b.txt"] {
        std::fs::write(home.path().join(name), recording(8)).unwrap();
    }
    let output = mmt(&home, arguments).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    assert!(errors.is_empty(), "a pipe shows no progress bar: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn a_replay_prints_the_tables_of_every_file() {
    let text = replay(&["replay", "a.txt", "b.txt"]);
    for part in [
        "a.txt",
        "b.txt",
        "(ii) surface, point",
        "All 8 pushes",
        "Held-out pushes",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn a_replay_as_json_is_one_document_with_the_keys_of_every_report() {
    let text = replay(&["replay", "--json", "--seed", "3", "a.txt", "b.txt"]);
    let document: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(document["command"], "replay");
    assert_eq!(document["seed"], 3);
    assert_eq!(document["ending"], "finished");
    assert_eq!(document["pushes"]["completed"], 16);
    assert!(document["model"]["mass_kg"]["estimate"].is_null());
    assert!(document["wire"]["up"]["datagrams"].is_null());
    assert_eq!(document["configuration"]["replay"]["deadband"], 0.10);
    let files = document["replay"]["files"].as_array().unwrap();
    assert_eq!(files.len(), 2);
    let surface = |file: &Value| {
        let laws = file["laws"].as_array().unwrap();
        let law = laws
            .iter()
            .find(|law| law["law"] == document["replay"]["law"]);
        law.unwrap()["updates"]["sent"].as_u64().unwrap()
    };
    let sent: u64 = files.iter().map(surface).sum();
    assert!(sent > 0);
    assert_eq!(document["updates"]["sent"], sent);
    let causes = document["updates"]["by_cause"].as_object().unwrap();
    let by_cause: u64 = causes.values().filter_map(Value::as_u64).sum();
    assert_eq!(by_cause, sent);
}

#[test]
fn a_slave_that_nobody_comes_to_prints_its_pairing_string_and_an_empty_report() {
    let home = tempfile::tempdir().unwrap();
    let arguments = [
        "slave",
        "--listen",
        "127.0.0.1:0",
        "--advertise",
        "robot.example.org",
        "--json",
    ];
    let (slave, line) = start(mmt(&home, &arguments));
    assert!(line.starts_with("mmt://robot.example.org:"), "{line}");
    slave.interrupt().unwrap();
    let (rest, code) = finish(slave);
    assert_eq!(code, Some(0));
    let document: Value = serde_json::from_str(&rest).unwrap();
    assert_eq!(document["command"], "slave");
    assert_eq!(document["ending"], "interrupted");
    assert!(document["updates"]["sent"].is_null());
}

#[test]
fn a_master_that_nobody_answers_reports_that_with_a_code_of_its_own() {
    let home = tempfile::tempdir().unwrap();
    // bound, so that no ICMP comes back, and never read from
    let silent = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    let (pin, token) = ("0f".repeat(32), "a5".repeat(32));
    let pairing = format!(
        "mmt://{}?pin={pin}&token={token}",
        silent.local_addr().unwrap()
    );
    let output = mmt(&home, &["master", &pairing]).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{text}");
    assert!(
        text.contains("nothing answered") && !text.contains("panicked"),
        "{text}"
    );
}

#[test]
fn a_slave_and_a_master_as_processes_both_end_with_a_report() {
    let home = tempfile::tempdir().unwrap();
    let (slave, line) = start(mmt(
        &home,
        &["slave", "--listen", "127.0.0.1:0", "--once", "--json"],
    ));
    let pairing = line;
    let arguments = ["master", &pairing, "--duration", "2s", "--json"];
    let output = judged(mmt(&home, &arguments));
    let text = String::from_utf8_lossy(&output.stderr);
    let master = document(&output);
    let (rest, code) = finish(slave);
    assert_eq!(code, Some(0));
    let slave: Value = serde_json::from_str(&rest).unwrap();
    assert_eq!(master["command"], "master");
    assert_eq!(slave["command"], "slave");
    assert!(master["haptic_loop"]["ticks"].as_u64().unwrap() > 0);
    assert!(slave["slave_loop"]["ticks"].as_u64().unwrap() > 0);
    assert_eq!(master["ending"], "finished", "{text}");
    assert_eq!(output.status.code(), Some(0), "{text}");
}
