//! Records of sessions as people make and use them: the command records, runs again, exports; foreign decoders read.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "a test may panic"
)]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "starts processes, reads and writes files"
)]

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use mmt_client::operator::trace::Trace;
use serde_json::Value;

use crate::harness::process::{Ended, Running, number};
use crate::harness::python::python;
use crate::harness::{in_real_time, root};

/// For what takes seconds; the host may be busy.
const GENEROUS: Duration = Duration::from_secs(120);

fn mmt(arguments: &[&str]) -> Ended {
    Running::mmt(arguments).unwrap().end(GENEROUS).unwrap()
}

/// What a command that succeeded printed.
fn done(arguments: &[&str]) -> Ended {
    let mut ended = mmt(arguments);
    // a host that stands still for a second ends a session, as it must
    if ended.err.contains("for 1 s nothing came") {
        ended = mmt(arguments);
    }
    assert_eq!(ended.status.code(), Some(0), "{arguments:?}: {}", ended.err);
    ended
}

/// The sessions of a record that ran again.
fn replayed(record: &str) -> (Value, Vec<(String, f64)>) {
    let document = done(&["replay", record, "--json"]).document(0).unwrap();
    let record = document["records"][0].clone();
    let sessions = record["sessions"].as_array().unwrap().iter();
    let sessions = sessions
        .map(|session| {
            assert_eq!(session["has_gap"], false, "{document:#}");
            let side = session["side"].as_str().unwrap().to_owned();
            (side, number(session, "/ticks").unwrap())
        })
        .collect();
    (record, sessions)
}

/// Whether what these records show keeps what is promised, both ends together; how many invariants were looked at.
fn checked(records: &[&str]) -> usize {
    let arguments = [&["check"], records, &["--json"]].concat();
    let document = done(&arguments).document(0).unwrap();
    assert_eq!(document["holds"], true, "{document:#}");
    document["invariants"].as_array().unwrap().len()
}

/// The recorded hand over the recorded network, and over one of half a second with an update each 20 ms.
fn what_if_it_had_been_slower(record: &str) {
    let other = ["--scheme", "timer 20ms", "--netem", "delay 250ms", "--json"];
    let asked = [&["replay", record][..], &other].concat();
    let answer = done(&asked).document(0).unwrap();
    let rows = answer.as_array().unwrap();
    let rate = |row: usize| number(&rows[row], "/packet_rate_hz").unwrap();
    assert_eq!(rows[0]["run"], "as recorded");
    assert_eq!(rows[1]["scheme"], "timer 20ms");
    assert_eq!(rows[1]["network"], "delay 250ms");
    // the timer runs in free space as well
    assert!(
        (rate(1) - 50.0).abs() < 5.0 && rate(0) < rate(1),
        "{answer:#}"
    );
    // virtual time: the same question has the same answer
    assert_eq!(done(&asked).document(0).unwrap(), answer);
}

/// The rows of an exported table by column, and how many there are.
fn column(table: &Path, name: &str) -> Vec<String> {
    let text = std::fs::read_to_string(table).unwrap();
    let mut lines = text.lines();
    let place = lines.next().unwrap().split(',').position(|of| of == name);
    let place = place.unwrap_or_else(|| panic!("{name} in {}", table.display()));
    lines
        .map(|line| line.split(',').nth(place).unwrap().to_owned())
        .collect()
}

#[test]
fn a_demo_is_recorded_runs_again_and_is_read_by_decoders_that_know_nothing_of_it() {
    in_real_time(|| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("demo.mcap");
        let record = path.to_str().unwrap();
        let demo = done(&["demo", "--duration", "12s", "--json", "--record", record]);
        let report = demo.document(0).unwrap();
        let (again, sessions) = replayed(record);
        assert_eq!(again["is_whole"], true);
        assert!(checked(&[record]) >= 24);
        what_if_it_had_been_slower(record);
        let sides: Vec<&str> = sessions.iter().map(|(side, _)| side.as_str()).collect();
        assert_eq!(sides, ["master", "slave"]);
        for ((side, ticks), of) in sessions.iter().zip(["haptic_loop", "slave_loop"]) {
            let live = number(&report, &format!("/{of}/ticks")).unwrap();
            assert_eq!(*ticks, live, "every tick of the {side}");
        }
        let tables = folder.path().join("tables");
        done(&["export", record, "--out", tables.to_str().unwrap()]);
        let sent = column(&tables.join("slave-packets.csv"), "fate");
        let kinds = column(&tables.join("slave-packets.csv"), "kind");
        let sent = sent.iter().zip(&kinds);
        let sent = sent
            .filter(|(fate, kind)| *fate == "sent" && *kind == "update")
            .count();
        assert_eq!(Some(sent as f64), number(&report, "/updates/sent"));
        let hand = std::fs::read_to_string(tables.join("hand.csv")).unwrap();
        let hand = Trace::from_csv(&hand).unwrap();
        assert!(
            hand.duration() > Duration::from_secs(3),
            "a trace for an operator"
        );
        decoded(record, &tables);
        for command in ["report", "check"] {
            let twice = Running::mmt(&[command, record, record]).unwrap();
            let twice = twice.end(GENEROUS).unwrap();
            assert_eq!(twice.status.code(), Some(2), "{}", twice.err);
            // whichever end began it first
            let why = ["session 1 of the", "was given before"];
            assert!(
                why.iter().all(|part| twice.err.contains(part)),
                "{}",
                twice.err
            );
        }
        reported(record, &folder.path().join("report"), &report);
    });
}

/// The table and the figures of a run, held against the report that the run itself printed.
fn reported(record: &str, out: &Path, live: &Value) {
    let folder = out.to_str().unwrap();
    let report = done(&["report", record, "--json", "--out", folder]);
    let report = report.document(0).unwrap();
    let run = &report["run"][0];
    assert_eq!(number(run, "/updates"), number(live, "/updates/sent"));
    let (pmse, theirs) = (number(run, "/pmse"), number(live, "/force/pmse"));
    // a host that was starved may not have touched anything
    assert_eq!(pmse.is_some(), theirs.is_some());
    let apart = pmse.zip(theirs).map_or(0.0, |(ours, theirs)| ours - theirs);
    assert!(apart.abs() < 1e-9, "{pmse:?} {theirs:?}");
    let packets = report["packets"].as_array().unwrap();
    let lost: f64 = packets.iter().filter_map(|row| number(row, "/lost")).sum();
    assert!(lost > 0.0, "the path loses 1 %: {report:#}");
    let delays = report["delays"].as_array().unwrap();
    assert_eq!(delays.len(), 3, "up, down, round trip");
    for way in delays {
        assert!(number(way, "/p50_ms").unwrap() > 40.0, "{way}");
    }
    for name in ["forces", "packets", "delays"] {
        let svg = std::fs::read_to_string(out.join(format!("{name}.svg"))).unwrap();
        assert!(
            svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"),
            "{name}"
        );
    }
    assert!(column(&out.join("forces.csv"), "fs_n").len() > 100);
}

/// Both foreign decoders agree with each other, and with what was exported.
fn decoded(record: &str, tables: &Path) {
    let Some(python) = python("the foreign decoders of records", "mcap_ros2, rosbags") else {
        return;
    };
    let mut command = Command::new(python);
    command.arg(root().join("tests/protocol/read_record.py"));
    command.arg(record);
    let ended = Running::start(command).unwrap().end(GENEROUS).unwrap();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.err);
    let found = ended.document(0).unwrap();
    for topic in [
        "/tf",
        "/master/hip",
        "/master/force",
        "/master/hand_force",
        "/master/model_twist",
        "/master/markers",
        "/slave/tool",
        "/slave/object",
        "/slave/force",
        "/slave/object_twist",
        "/slave/markers",
    ] {
        assert!(found["topics"][topic].as_u64() > Some(50), "{topic}");
    }
    let last = &found["last"];
    let wrench = &last["/slave/force"];
    assert_eq!(wrench["header"]["frame_id"], "world");
    assert!(wrench["wrench"]["force"]["x"].is_f64());
    let markers = last["/slave/markers"]["markers"].as_array().unwrap();
    let names: Vec<_> = markers
        .iter()
        .map(|of| of["ns"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["object", "tool", "f_s"]);
    for (topic, table) in [
        ("/master/ticks", "master-ticks.csv"),
        ("/slave/ticks", "slave-ticks.csv"),
        ("/slave/packets", "slave-packets.csv"),
        ("/slave/parameters", "slave-parameters.csv"),
        ("/master/link", "master-link.csv"),
    ] {
        for (field, value) in last[topic].as_object().unwrap() {
            let column = column(&tables.join(table), field);
            let rows = found["topics"][topic].as_u64().unwrap();
            assert_eq!(column.len() as u64, rows, "{topic}");
            let cell = column.last().unwrap();
            if let Some(value) = value.as_f64() {
                assert_eq!(cell.parse::<f64>().unwrap(), value, "{topic} {field}");
            }
        }
    }
}

#[test]
fn each_host_of_two_keeps_a_record_that_runs_again_by_itself() {
    in_real_time(|| {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        let (identity, of_slave, of_master) = (place("identity"), place("s.mcap"), place("m.mcap"));
        let own = ["--once", "--identity", &identity, "--record", &of_slave];
        let (slave, pairing) = Running::slave(&own).unwrap();
        done(&[
            "master",
            &pairing,
            "--duration",
            "3s",
            "--record",
            &of_master,
        ]);
        assert_eq!(slave.end(GENEROUS).unwrap().status.code(), Some(0));
        let (_, sessions) = replayed(&of_slave);
        assert_eq!((sessions.len(), sessions[0].0.as_str()), (1, "slave"));
        let (_, sessions) = replayed(&of_master);
        assert_eq!((sessions.len(), sessions[0].0.as_str()), (1, "master"));
        // one end alone shows nothing of what the other sent
        assert!(checked(&[&of_slave]) < checked(&[&of_slave, &of_master]));
        // where the two files are shown together they lie on one axis
        let both = done(&["replay", &of_slave, &of_master]).out.join("\n");
        assert_eq!(both.matches("the same bits").count(), 2, "{both}");
    });
}

#[test]
fn a_full_disk_costs_the_record_and_neither_the_session_nor_its_report() {
    in_real_time(|| {
        let demo = ["demo", "--duration", "8s", "--json"];
        let demo = [&demo[..], &["--record", "/dev/full"]].concat();
        let mut demo = Running::mmt(&demo).unwrap();
        let is_reported = |line: &str| line.contains("the record ends here, the session goes on");
        let message = demo.wait_for_line(GENEROUS, is_reported).unwrap();
        assert!(message.contains("No space left"), "{message}");
        // at once, and not with the report
        let reported = Instant::now();
        let ended = demo.end(GENEROUS).unwrap();
        let went_on = ended.at.duration_since(reported);
        assert!(went_on > Duration::from_secs(3), "{went_on:?}");
        let report = ended.document(0).unwrap();
        assert_eq!(report["ending"], "finished");
        assert_eq!(ended.status.code(), Some(1), "{}", ended.err);
        assert!(
            ended.err.contains("/dev/full is not whole"),
            "{}",
            ended.err
        );
        assert!(ended.err.contains("No space left"), "{}", ended.err);
    });
}

#[test]
fn a_record_that_cannot_be_written_is_refused_before_anything_runs() {
    let ended = mmt(&["demo", "--record", "/no/such/folder/a.mcap"]);
    assert_eq!(ended.status.code(), Some(2), "{}", ended.err);
    assert!(
        ended.err.contains("/no/such/folder/a.mcap"),
        "{}",
        ended.err
    );
    assert!(ended.out.is_empty());
}

#[test]
fn what_was_recorded_before_a_kill_runs_again() {
    in_real_time(|| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("killed.mcap");
        let record = path.to_str().unwrap();
        let demo = Running::mmt(&["demo", "--duration", "60s", "--record", record]).unwrap();
        let length = || std::fs::metadata(&path).map_or(0, |of| of.len());
        let end = std::time::Instant::now() + GENEROUS;
        while length() < 1_000_000 {
            assert!(std::time::Instant::now() < end, "{} bytes", length());
            std::thread::sleep(Duration::from_millis(50));
        }
        // dropped, it is killed
        drop(demo);
        let (again, sessions) = replayed(record);
        assert_eq!(again["is_whole"], false);
        assert!(checked(&[record]) > 10);
        assert_eq!(sessions.len(), 2);
        assert!(
            sessions.iter().all(|(_, ticks)| *ticks > 200.0),
            "{sessions:?}"
        );
    });
}
