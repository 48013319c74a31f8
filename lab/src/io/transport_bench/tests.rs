//! A short run of everything: counts that do not depend on the machine's speed.

use std::cell::Cell;

use serde_json::Value;

use super::*;

fn short(bytes: usize) -> Value {
    let config = BenchConfig {
        rate_hz: 500,
        duration: Duration::from_millis(1),
        bytes,
        cores: Cores::Own,
    };
    let asked = Cell::new(0);
    let stop = || {
        asked.set(asked.get() + 1);
        true
    };
    let report = run(&config, stop).unwrap();
    assert!(asked.get() <= 1, "one round is enough");
    serde_json::to_value(report).unwrap()
}

#[test]
fn every_carrier_sends_what_it_was_given_in_as_many_packets_and_bytes_as_it_must() {
    // a thread of a busy machine can sleep through the 240 ms of a slice
    let rows = (0..5)
        .map(|_| short(100)["rows"].as_array().unwrap().clone())
        .find(|rows| rows.iter().all(|row| row["lost"] != row["messages"]))
        .expect("something comes by each carrier");
    assert_eq!(rows.len(), Carrier::ALL.len() * Flow::ALL.len());
    for row in &rows {
        let number = |key: &str| row[key].as_f64().unwrap();
        // 200 ms at 500 a second
        assert_eq!(row["messages"], 100, "{row}");
        assert!(number("p50_us") > 0.0 && number("cpu_us") > 0.0, "{row}");
        let (packets, bytes) = (number("packets"), number("bytes"));
        match row["carrier"].as_str().unwrap() {
            "control" => assert_eq!((packets, bytes), (1.0, 128.0), "{row}"),
            // and the QUIC connection beside it keeps itself alive every 5 s
            "udp" => assert!(
                (1.0..1.1).contains(&packets) && (133.0..145.0).contains(&bytes),
                "{row}"
            ),
            // header, connection id, packet number, frame, tag
            _ => assert!(packets >= 1.0 && bytes > 150.0, "{row}"),
        }
    }
}

#[test]
fn what_cannot_be_measured_is_refused_with_the_range() {
    let config = BenchConfig {
        rate_hz: 0,
        duration: Duration::from_millis(1),
        bytes: 100,
        cores: Cores::Own,
    };
    let text = run(&config, || true).unwrap_err().to_string();
    assert!(text.contains("10000"), "{text}");
    for bytes in [BYTES_MIN - 1, BYTES_MAX + 1] {
        let config = BenchConfig {
            rate_hz: 1,
            bytes,
            ..config
        };
        let text = run(&config, || true).unwrap_err().to_string();
        assert!(text.contains("16 to 1024"), "{text}");
    }
}
