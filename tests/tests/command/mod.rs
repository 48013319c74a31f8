//! The command `mmt` in a home of its own, so that no test meets what another one, or the user, has kept.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::indexing_slicing,
    clippy::unwrap_used,
    reason = "a test starts the command, reads and writes files for it, and fails by panicking"
)]

use std::process::{Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::harness::judge::judged;
use crate::harness::process::{PROGRAM, Running};

mod bench;
mod device;
mod doctor;
mod hostile;
mod identity;
mod interrupted;
mod manual;
mod netem;
mod raw_udp;
mod relay;
mod reproduce;
mod runs;
mod shell;
mod swarm;
mod sweep;
mod wrong_input;

/// For what takes seconds; the host may be busy.
const PATIENCE: Duration = Duration::from_secs(60);

/// `mmt` with these arguments, nothing on stdin; it keeps and finds its files in `home`.
fn mmt(home: &tempfile::TempDir, arguments: &[&str]) -> Command {
    let mut command = Command::new(PROGRAM);
    command
        .args(arguments)
        .env("XDG_STATE_HOME", home.path())
        .env_remove("MMT_LOG")
        .current_dir(home.path())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// The same command, which hears SIGHUP: whoever runs the test may ignore it, and a child inherits that.
fn hearing_hang_up(command: &Command) -> Command {
    let mut hearing = Command::new("env");
    hearing
        .arg("--default-signal=HUP")
        .arg(command.get_program());
    hearing.args(command.get_args());
    if let Some(place) = command.get_current_dir() {
        hearing.current_dir(place);
    }
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => hearing.env(name, value),
            None => hearing.env_remove(name),
        };
    }
    hearing
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    hearing
}

/// Starts a command that prints a line and goes on, and waits for that line.
fn start(command: Command) -> (Running, String) {
    let mut running = Running::start(command).unwrap();
    let line = running.first_line(PATIENCE).unwrap();
    (running, line)
}

/// What a command printed after its first line, and its exit code.
fn finish(running: Running) -> (String, Option<i32>) {
    let ended = running.end(PATIENCE).unwrap();
    (ended.out[1..].join("\n"), ended.status.code())
}

/// The JSON document on stdout; if there is none, the test fails with the reason and stderr.
fn document(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stderr);
    let document = serde_json::from_slice(&output.stdout);
    document
        .map_err(|why| format!("{why}; stderr: {text}"))
        .unwrap()
}
