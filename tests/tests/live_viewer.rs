//! `mmt live` as a viewer sees it: a demo keeps a record, and `tests/protocol/viewer.py` reads from the WebSocket as it runs.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
#![allow(clippy::disallowed_methods, reason = "starts processes")]

use std::process::Command;
use std::time::Duration;

use harness::process::{Running, number};
use harness::python::python;
use harness::{in_real_time, root};

mod harness;

/// It takes 12 s; the host may be busy.
const GENEROUS: Duration = Duration::from_secs(120);

#[test]
fn a_viewer_that_knows_only_foxgloves_protocol_sees_a_session_as_it_runs_and_cannot_write() {
    let Some(python) = python("a viewer of a running session", "websockets, rosbags") else {
        return;
    };
    in_real_time(|| {
        let folder = tempfile::tempdir().unwrap();
        let record = folder.path().join("run.mcap");
        let record = record.to_str().unwrap();
        let mut live = Running::mmt(&["live", record, "--port", "0"]).unwrap();
        let address = live
            .wait_for_line(GENEROUS, |line| line.starts_with("ws://127.0.0.1:"))
            .unwrap();
        let demo = ["demo", "--duration", "12s", "--json", "--record", record];
        let demo = Running::mmt(&demo).unwrap();
        let mut command = Command::new(&python);
        command.arg(root().join("tests/protocol/viewer.py"));
        command.args([&address, "9"]);
        let viewer = Running::start(command).unwrap().end(GENEROUS).unwrap();
        assert!(viewer.status.success(), "{}", viewer.err);
        let seen = viewer.document(0).unwrap();
        for topic in ["tf", "master~1force", "slave~1parameters"] {
            let came = number(&seen, &format!("/messages/~1{topic}")).unwrap();
            assert!(came > 10.0, "{seen:#}");
        }
        assert!(number(&seen, "/hip_way_m").unwrap() > 0.05, "{seen:#}");
        assert!(number(&seen, "/mass_kg").unwrap() > 0.0, "{seen:#}");
        assert_eq!(
            seen["capabilities"].as_array().unwrap().len(),
            0,
            "{seen:#}"
        );
        assert!(demo.end(GENEROUS).unwrap().status.success());
        // the record is whole: so is the show
        let ended = live.end(GENEROUS).unwrap();
        assert!(ended.status.success(), "{}", ended.err);
        assert!(ended.err.contains("its session has ended"), "{}", ended.err);

        let late = Running::mmt(&["live", record, "--port", "0"]).unwrap();
        let late = late.end(GENEROUS).unwrap();
        assert_eq!(late.status.code(), Some(2));
        assert!(late.err.contains("open the file itself"), "{}", late.err);
    });
}
