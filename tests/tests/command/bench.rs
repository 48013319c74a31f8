//! `mmt bench` as a process: what it prints, what it refuses. Nothing here depends on how fast the machine is.

use std::process::Output;

use serde_json::Value;

fn bench(arguments: &[&str]) -> Output {
    let home = tempfile::tempdir().unwrap();
    let mut command = super::mmt(&home, &["bench"]);
    command.args(arguments).output().unwrap()
}

#[test]
fn the_document_has_every_key_for_every_carrier_and_flow() {
    let output = bench(&[
        "transport",
        "--rate",
        "200",
        "--size",
        "64",
        "--duration",
        "1ms",
        "--cores",
        "any",
        "--json",
    ]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(document["command"], "bench transport");
    assert_eq!(
        (&document["rate_hz"], &document["bytes"]),
        (&200.into(), &64.into())
    );
    assert_eq!(document["cores"], "any");
    let rows = document["rows"].as_array().unwrap();
    let named = |key: &str| {
        let mut names: Vec<_> = rows.iter().map(|row| row[key].as_str().unwrap()).collect();
        names.sort_unstable();
        names.dedup();
        names
    };
    assert_eq!(named("carrier"), ["control", "quic", "udp"]);
    assert_eq!(named("flow"), ["one way", "round trip"]);
    assert_eq!(rows.len(), 6);
    for row in rows {
        for key in [
            "messages", "lost", "p50_us", "p99_us", "p999_us", "max_us", "ratio", "cpu_us",
            "packets", "bytes",
        ] {
            assert!(row[key].is_number(), "{key}: {row}");
        }
        // 200 ms at 200 a second
        assert_eq!(row["messages"], 40, "{row}");
    }
    let targets = document["targets"].as_array().unwrap();
    assert_eq!(targets.len(), 3);
    for target in targets {
        for key in ["target", "most", "measured", "met"] {
            assert!(target.get(key).is_some(), "{key}: {target}");
        }
    }
    // what is promised for 1000 messages a second is not judged at 200
    assert_eq!(targets[2]["met"], "not measured");
}

#[test]
fn the_table_has_the_targets() {
    let output = bench(&["transport", "--duration", "1ms"]);
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    for part in [
        "1000 messages a second of 100 bytes",
        "control",
        "Targets",
        "quiet machine",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(String::from_utf8_lossy(&output.stderr).contains("Ctrl-C"));
}

#[test]
fn what_cannot_be_measured_is_refused_with_the_range() {
    for (option, value, range) in [
        ("--rate", "0", "from 1 to 10000"),
        ("--rate", "10001", "from 1 to 10000"),
        ("--size", "15", "from 16 to 1024"),
        ("--size", "1025", "from 16 to 1024"),
        ("--duration", "60", "such as 20s"),
        ("--cores", "two", "own, any"),
    ] {
        let output = bench(&["transport", option, value]);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(option) && text.contains(range), "{text}");
    }
}
