//! People who look on, by the command: beside an operator, and until their token is revoked.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
#![allow(clippy::disallowed_methods, reason = "starts processes")]

use std::path::Path;
use std::time::Duration;

use crate::harness::in_real_time;
use crate::harness::process::{Ended, ProcessError, Running, number};
use rustix::process::Signal;

/// For what takes seconds; the host may be busy.
const GENEROUS: Duration = Duration::from_secs(120);

fn ok<T>(result: Result<T, ProcessError>) -> T {
    result.unwrap_or_else(|error| panic!("{error}"))
}

/// `mmt identity` on the identity in this folder.
fn identity(folder: &Path, words: &[&str]) -> Ended {
    let directory = folder.display().to_string();
    let arguments = [&["identity"], words, &["--identity", &directory]].concat();
    let ended = ok(ok(Running::mmt(&arguments)).end(GENEROUS));
    assert_eq!(ended.status.code(), Some(0), "{}", ended.err);
    ended
}

fn observer(pairing: &str) -> Running {
    ok(Running::mmt(&["master", pairing, "--observe", "--json"]))
}

#[test]
fn who_looks_on_sees_the_operators_work_stops_nothing_and_goes_when_its_token_is_revoked() {
    in_real_time(|| {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().display().to_string();
        let listen = ["slave", "--listen", "127.0.0.1:0"];
        let options = ["--identity", &place, "--observers", "2", "--json"];
        let mut slave = ok(Running::mmt(&[&listen[..], &options].concat()));
        let pairing = ok(slave.first_line(GENEROUS));
        let eve = identity(
            folder.path(),
            &["rotate", "--name", "eve", "--role", "observer"],
        );
        let eve = eve.out.first().unwrap();
        let (mut first, mut second) = (observer(eve), observer(&pairing));
        for looking in [&mut first, &mut second] {
            ok(looking.wait_for_line(GENEROUS, |line| line.contains("looks on")));
        }
        // its signal is no emergency stop
        ok(first.signal(Signal::USR1));
        let third = ok(observer(eve).end(GENEROUS));
        assert_eq!(third.status.code(), Some(3), "{}", third.err);
        assert!(third.err.contains("as many observers"), "{}", third.err);
        let operator = ["master", &pairing, "--duration", "5s", "--json"];
        let operator = ok(ok(Running::mmt(&operator)).end(GENEROUS));
        assert_eq!(operator.status.code(), Some(0), "{}", operator.err);
        let operator = ok(operator.document(0));
        assert!(
            number(&operator, "/updates/applied") > Some(0.0),
            "it pushed"
        );

        ok(second.interrupt());
        let second = ok(second.end(GENEROUS));
        assert_eq!(second.status.code(), Some(0), "{}", second.err);
        let report = ok(second.document(0));
        let get =
            |path: &str| number(&report, path).unwrap_or_else(|| panic!("{path} in {report:#}"));
        assert_eq!(report["ending"], "interrupted");
        assert_eq!(report["configuration"]["role"], "observer");
        assert!(get("/updates/applied") > 0.0 && get("/messages/down/scenes") > 0.0);
        assert_eq!(get("/messages/up/commands"), 0.0);
        assert!(get("/link/rtt_ms/p50") > 0.0 && get("/link/loss_down") < 1.0);
        assert!(report["force"]["largest_n"].is_null(), "it has no hand");

        identity(folder.path(), &["revoke", "eve"]);
        let first = ok(first.end(GENEROUS));
        assert_eq!(first.status.code(), Some(1), "{}", first.err);
        assert!(first.err.contains("replaced or revoked"), "{}", first.err);
        ok(slave.interrupt());
        let slave = ok(slave.end(GENEROUS));
        assert_eq!(slave.status.code(), Some(0), "{}", slave.err);
        for who in [
            "looks on as eve",
            "looks on as operator",
            "operates as operator",
        ] {
            assert!(slave.err.contains(who), "{who}: {}", slave.err);
        }
        let slave = ok(slave.document(1));
        assert_eq!(number(&slave, "/drops/observers_full"), Some(1.0));
        assert_eq!(
            number(&slave, "/drops/observer_commands_refused"),
            Some(0.0)
        );
    });
}
