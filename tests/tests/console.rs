//! The operator's console in a real browser: `tests/console/check.py` against a running demo, `blind.py` with a study,
//! `observe.py` beside an operator.
//!
//! Needs Python with playwright, and chromium: without, it says so, and with `CI` set it fails.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
#![allow(clippy::disallowed_methods, reason = "starts processes")]

use std::process::{Command, Stdio};
use std::time::Duration;

use harness::process::{PROGRAM, Running, did_not_run};
use harness::root;

mod harness;

/// It takes 15 s; the host may be busy.
const GENEROUS: Duration = Duration::from_secs(240);

fn runs(command: &mut Command) -> bool {
    let quiet = command.stdout(Stdio::null()).stderr(Stdio::null());
    quiet.status().is_ok_and(|status| status.success())
}

#[test]
fn a_person_at_a_browser_pushes_the_box_and_changes_the_run() {
    holds("check.py", "a drag moves the box");
}

#[test]
fn a_participant_of_a_blind_comparison_answers_both_parts_and_learns_nothing() {
    holds("blind.py", "the next participant has the other order");
}

#[test]
fn an_observers_page_shows_the_operators_work_and_moves_and_stops_nothing() {
    holds("observe.py", "and stops nothing");
}

/// Runs a script of `tests/console`, which must find that this promise holds.
fn holds(script: &str, promise: &str) {
    let own = root().join("target/python/bin/python");
    let pythons = [own.to_string_lossy().into_owned(), "python3".to_owned()];
    let mut pythons = pythons.into_iter();
    let has = |python: &String| runs(Command::new(python).args(["-c", "import playwright"]));
    let python = pythons.find(has);
    let browser = runs(Command::new("chromium").arg("--version"));
    let Some(python) = python.filter(|_| browser) else {
        let how = "no Python has playwright, or there is no chromium: `target/python/bin/pip install -r \
                   tests/console/requirements.txt`, and the system's package chromium";
        did_not_run("the console in a browser", how);
        return;
    };
    let mut command = Command::new(python);
    command
        .arg(root().join("tests/console").join(script))
        .arg(PROGRAM);
    let ended = Running::start(command).and_then(|check| check.end(GENEROUS));
    let ended = ended.unwrap_or_else(|error| panic!("{error}"));
    let printed = ended.out.join("\n");
    assert!(ended.status.success(), "{printed}\n{}", ended.err);
    assert!(printed.contains(promise), "{printed}");
}
