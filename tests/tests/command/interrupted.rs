//! The first Ctrl-C, SIGTERM or SIGHUP ends a long command and keeps what is done.

use std::fs;

use rustix::process::Signal;
use serde_json::Value;

use super::runs::recording;
use super::{PATIENCE, hearing_hang_up, mmt, start};
use crate::harness::process::Running;

#[test]
fn experiments_that_are_done_when_a_person_ends_reproduce_are_kept() {
    let home = tempfile::tempdir().unwrap();
    // the second experiment takes far longer than any machine needs for the first
    let mut command = mmt(&home, &["reproduce", "all", "--seeds", "10000"]);
    command.args(["--jobs", "1", "--out", "kept"]);
    let (running, _) = start(command);
    running.signal(Signal::INT).unwrap();
    let ended = running.end(PATIENCE).unwrap();
    assert_eq!(ended.status.code(), Some(1), "{}", ended.err);
    assert!(
        ended.err.contains("interrupted: 1 of ") && ended.err.contains("kept in kept"),
        "{}",
        ended.err
    );
    let manifest = fs::read(home.path().join("kept/manifest.json")).unwrap();
    let manifest: Value = serde_json::from_slice(&manifest).unwrap();
    let experiments = manifest["experiments"].as_array().unwrap();
    assert_eq!(experiments.len(), 1);
    let files = manifest["files"].as_object().unwrap();
    assert!(!files.is_empty());
    for name in files.keys() {
        assert!(home.path().join("kept").join(name).exists(), "{name}");
    }
}

#[test]
fn seeds_that_are_done_when_a_person_ends_a_swarm_are_judged() {
    let home = tempfile::tempdir().unwrap();
    let swarm = ["swarm", "--seeds", "1000000", "--duration", "3s"];
    let running = Running::start(mmt(&home, &swarm)).unwrap();
    running.wait_for_handler(PATIENCE);
    running.signal(Signal::INT).unwrap();
    let ended = running.end(PATIENCE).unwrap();
    assert_eq!(ended.status.code(), Some(1), "{}", ended.err);
    assert!(
        ended.err.contains("of 1000000 seeds are done"),
        "{}",
        ended.err
    );
    assert!(
        ended.out.join("\n").contains("seeds of 3 s"),
        "{:?}",
        ended.out
    );
}

#[test]
fn a_demo_that_a_person_ends_before_its_session_begins_ends_well() {
    let home = tempfile::tempdir().unwrap();
    let running = Running::start(mmt(&home, &["demo", "--no-console"])).unwrap();
    running.wait_for_handler(PATIENCE);
    running.signal(Signal::INT).unwrap();
    let ended = running.end(PATIENCE).unwrap();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.err);
}

#[test]
fn files_that_are_done_when_a_replay_is_ended_are_printed_whole() {
    for signal in [Signal::TERM, Signal::HUP] {
        let home = tempfile::tempdir().unwrap();
        fs::write(home.path().join("short.txt"), recording(2)).unwrap();
        fs::write(home.path().join("long.txt"), recording(60)).unwrap();
        let arguments = ["replay", "--splits", "10000", "short.txt", "long.txt"];
        let (running, first) = start(hearing_hang_up(&mmt(&home, &arguments)));
        running.signal(signal).unwrap();
        let ended = running.end(PATIENCE).unwrap();
        assert_eq!(ended.status.code(), Some(1), "{}", ended.err);
        assert!(ended.err.contains("1 of 2 files are done"), "{}", ended.err);
        assert_eq!(first, "short.txt");
        assert!(ended.out.join("\n").contains("Held-out pushes"));
    }
}
