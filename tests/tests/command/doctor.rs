//! `mmt doctor`: what it finds, and how it ends.

use serde_json::Value;

use super::{document, finish, judged, mmt, start};

/// The verdict on a subject, and what was found.
fn finding<'a>(document: &'a Value, subject: &str) -> (&'a str, &'a str) {
    let findings = document["findings"].as_array().unwrap();
    let found = findings.iter().find(|one| one["subject"] == subject);
    let found = found
        .ok_or_else(|| format!("no {subject}: {document:#}"))
        .unwrap();
    let text = |key: &str| found[key].as_str().unwrap();
    (text("verdict"), text("found"))
}

#[test]
fn each_finding_that_is_not_fit_has_its_remedy_and_the_exit_code_is_the_verdict() {
    let home = tempfile::tempdir().unwrap();
    let output = mmt(&home, &["doctor", "--json"]).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    let document: Value = serde_json::from_str(&text).unwrap();
    let fit = document["fit"].as_bool().unwrap();
    assert_eq!(output.status.code(), Some(i32::from(!fit)), "{text}");
    let mut verdicts = Vec::new();
    for one in document["findings"].as_array().unwrap() {
        assert_eq!(one["verdict"] == "fit", one["remedy"].is_null(), "{one}");
        verdicts.push(one["verdict"].as_str().unwrap());
    }
    assert_eq!(fit, !verdicts.contains(&"unfit"));
    for subject in [
        "1 kHz loop",
        "real time",
        "locked memory",
        "timer slack",
        "cores",
        "governor",
        "clock source",
        "socket buffers",
        "own address",
    ] {
        finding(&document, subject);
    }
}

#[test]
fn a_slave_that_answers_is_looked_at_and_not_disturbed_and_one_with_another_key_is_unfit() {
    let home = tempfile::tempdir().unwrap();
    let (slave, pairing) = start(mmt(
        &home,
        &["slave", "--listen", "127.0.0.1:0", "--once", "--json"],
    ));
    let doctor = |pairing: &str| {
        let output = mmt(&home, &["doctor", pairing, "--json"]).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        serde_json::from_str::<Value>(&text).unwrap()
    };
    let seen = doctor(pairing.trim());
    assert_eq!(finding(&seen, "slave").0, "fit", "{seen:#}");
    assert!(finding(&seen, "path").1.starts_with("round trip"));
    finding(&seen, "MTU");
    let (head, pin) = pairing.trim().split_once("pin=").unwrap();
    let other = if pin.starts_with('0') { "1" } else { "0" };
    let altered = doctor(&format!("{head}pin={other}{}", &pin[1..]));
    assert_eq!(finding(&altered, "slave").0, "unfit");
    assert_eq!(altered["fit"], false);
    // it waits for a master still
    let master = judged(mmt(
        &home,
        &["master", pairing.trim(), "--duration", "1s", "--json"],
    ));
    assert_eq!(document(&master)["ending"], "finished");
    assert_eq!(finish(slave).1, Some(0));
}

#[test]
fn a_wrong_pairing_string_is_wrong_input_and_nothing_is_measured() {
    let home = tempfile::tempdir().unwrap();
    let output = mmt(&home, &["doctor", "mmt://h:1"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(output.stdout.is_empty());
}
