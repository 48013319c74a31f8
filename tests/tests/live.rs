//! The live system on one host: the demonstration, and how sessions end and are refused.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
#![allow(clippy::disallowed_methods, reason = "lets sessions go on for a while")]

use std::time::Duration;

use crate::harness::alone;
use crate::harness::process::{Ended, ProcessError, Running, number};
use serde_json::Value;

/// For what needs no more than a start or an end.
const SOON: Duration = Duration::from_secs(10);

fn ok<T>(result: Result<T, ProcessError>) -> T {
    result.unwrap_or_else(|error| panic!("{error}"))
}

/// A slave on a port of the system's choice, and its pairing string.
fn slave(options: &[&str]) -> (Running, String) {
    let arguments = [&["slave", "--listen", "127.0.0.1:0", "--json"], options].concat();
    let mut slave = ok(Running::mmt(&arguments));
    let pairing = ok(slave.wait_for_line(SOON, |line| line.starts_with("mmt://")));
    (slave, pairing)
}

fn master(pairing: &str, duration: &str) -> Running {
    let arguments = ["master", pairing, "--duration", duration, "--json"];
    ok(Running::mmt(&arguments))
}

fn ending(report: &Value) -> &str {
    report
        .pointer("/ending")
        .and_then(Value::as_str)
        .unwrap_or("none")
}

/// What must be true of whatever ended, and how: an exit code, no panic.
fn ended_with(code: i32, ended: &Ended) {
    assert_eq!(ended.status.code(), Some(code), "{}", ended.err);
    assert!(!ended.err.contains("panicked"), "{}", ended.err);
}

/// No number of a document is anything but a number, whatever its key.
fn nothing_is_nan(value: &Value, path: &str) {
    match value {
        Value::Object(keys) => keys
            .iter()
            .for_each(|(key, value)| nothing_is_nan(value, &format!("{path}/{key}"))),
        Value::Array(values) => values.iter().for_each(|value| nothing_is_nan(value, path)),
        Value::Number(number) => {
            let number = number.as_f64().unwrap_or(f64::NAN);
            assert!(number.is_finite(), "{path} is {number}");
        }
        Value::String(text) => {
            let text = text.to_lowercase();
            assert!(
                !["nan", "inf", "-inf"].contains(&&text[..]),
                "{path}: {text}"
            );
        }
        Value::Null | Value::Bool(_) => {}
    }
}

#[test]
fn the_demonstration_runs_end_to_end_and_its_report_is_sane() {
    let _turn = alone();
    let arguments = ["demo", "--duration", "6s", "--seed", "1", "--json"];
    let ended = ok(ok(Running::mmt(&arguments)).end(Duration::from_secs(20)));
    ended_with(0, &ended);
    let report = ok(ended.document(0));
    nothing_is_nan(&report, "");
    assert_eq!(ending(&report), "finished");
    assert_eq!(number(&report, "/seed"), Some(1.0));
    for (path, least, most) in [
        ("/duration_s", 5.5, 7.5),
        ("/pushes/completed", 1.0, 2.0),
        ("/updates/sent", 5.0, 600.0),
        ("/updates/applied", 5.0, 600.0),
        ("/updates/rate_hz", 0.5, 100.0),
        ("/wire/up/datagrams", 400.0, 3000.0),
        ("/wire/down/datagrams", 100.0, 3000.0),
        ("/wire/up/bits_per_s", 1e4, 1e6),
        ("/wire/down/bits_per_s", 1e3, 1e6),
        ("/force/contact_samples", 500.0, 6000.0),
        ("/force/pmse", 0.0, 2.0),
        ("/force/relative_error", 0.0, 1.0),
        ("/force/jnd7_share", 0.0, 1.0),
        ("/model/mass_kg/estimate", 0.5, 0.9),
        ("/model/mass_kg/truth", 0.7, 0.7),
        ("/model/damping_ns_per_m/estimate", 0.0, 10.0),
        ("/model/friction_n/estimate", 1.0, 3.0),
        // 50 ms ± 5 ms each way
        ("/link/rtt_ms/p50", 95.0, 160.0),
        ("/link/loss_up", 0.0, 0.05),
        ("/link/loss_down", 0.0, 0.08),
        // packing and twice 5 ms of jitter at least
        ("/link/playout_delay_ms/p50", 20.0, 101.0),
        ("/passivity/energy_injected_j", 0.0, 1e-9),
        ("/passivity/observer_min_j", -1e-3, 0.0),
        ("/pushes/contact_breaks_per_push", 0.0, 2.0),
        ("/force/largest_n", 1.0, 8.0),
        ("/pose/position_rms_m", 1e-5, 0.03),
        ("/pose/angle_max_rad", 0.0, 0.5),
        ("/haptic_loop/ticks", 3000.0, 6500.0),
        ("/haptic_loop/skipped", 0.0, 3000.0),
        ("/haptic_loop/cpu_us/p50", 0.0, 1000.0),
    ] {
        let value = number(&report, path);
        let value = value.unwrap_or_else(|| panic!("{path} is {:?}", report.pointer(path)));
        assert!(
            (least..=most).contains(&value),
            "{path} is {value}, not {least} to {most}"
        );
    }
    for path in [
        "/haptic_loop/cpu_us",
        "/haptic_loop/lateness_us",
        "/slave_loop/cpu_us",
    ] {
        let quantile = |name| number(&report, &format!("{path}/{name}")).unwrap();
        let (p50, p99, p999) = (quantile("p50"), quantile("p99"), quantile("p999"));
        assert!(p50 <= p99 && p99 <= p999, "{path}: {p50} {p99} {p999}");
    }
}

/// A path that is 0.2 ms long for eight seconds and 60 ms from then on. The hand feels the tool, then the model.
#[test]
fn auto_feels_the_tool_while_the_path_is_short_and_the_model_when_it_has_become_long() {
    let _turn = alone();
    let path = std::env::temp_dir().join(format!("mmt-live-{}.csv", std::process::id()));
    let probes =
        "# mmt netem path 1\nat_ns,delay_ns\n0,200000\n8000000000,60000000\n60000000000,60000000\n";
    std::fs::write(&path, probes).unwrap();
    let netem = format!("trace {}", path.display());
    let auto = ["demo", "--architecture", "auto", "--duration", "16s"];
    let arguments = [&auto[..], &["--netem", &netem, "--json"]].concat();
    let ended = ok(ok(Running::mmt(&arguments)).end(Duration::from_secs(40)));
    std::fs::remove_file(&path).unwrap();
    ended_with(0, &ended);
    let report = ok(ended.document(0));
    nothing_is_nan(&report, "");
    let name = report.pointer("/architecture/name").and_then(Value::as_str);
    assert_eq!(name, Some("auto"));
    for (path, least, most) in [
        ("/architecture/switches", 2.0, 4.0),
        ("/architecture/tool_share", 0.1, 0.7),
        // what the limiter lets through: on a busy host TDPA's own corrections on the longer path, while it fades out, have
        // been that large. Virtual time holds it to 0.7 N, a first touch in a fade
        ("/architecture/fade_step_max_n", 0.0, 2.0),
        // both ways and the play-out
        ("/architecture/round_trip_ms", 120.0, 300.0),
        ("/architecture/model_error", 0.0, 1.0),
        // every tick of the tool, and 20 a second
        ("/messages/down/tools", 1000.0, 14_000.0),
        ("/passivity/observer_min_j", -1e-3, 0.0),
        ("/passivity/energy_injected_j", 0.0, 1e-9),
        // how often contact breaks is the busy host's too: virtual time holds that
        ("/pushes/completed", 1.0, 4.0),
    ] {
        let value = number(&report, path);
        let value = value.unwrap_or_else(|| panic!("{path} is {:?}", report.pointer(path)));
        assert!(
            (least..=most).contains(&value),
            "{path} is {value}, not {least} to {most}"
        );
    }
}

#[test]
fn the_master_that_is_interrupted_ends_both_sides_with_their_reports() {
    let _turn = alone();
    let (slave, pairing) = slave(&["--once"]);
    let master = master(&pairing, "60s");
    std::thread::sleep(Duration::from_secs(3));
    ok(master.interrupt());
    let (master, slave) = (ok(master.end(SOON)), ok(slave.end(SOON)));
    for (ended, skip) in [(&master, 0), (&slave, 1)] {
        ended_with(0, ended);
        let report = ok(ended.document(skip));
        assert_eq!(ending(&report), "interrupted", "{}", ended.err);
        let error = number(&report, "/force/relative_error");
        assert!(error > Some(0.0), "{error:?}: {}", ended.err);
    }
}

#[test]
fn the_slave_that_is_interrupted_ends_both_sides_with_their_reports() {
    let _turn = alone();
    let (slave, pairing) = slave(&[]);
    let master = master(&pairing, "60s");
    std::thread::sleep(Duration::from_secs(3));
    ok(slave.interrupt());
    let (master, slave) = (ok(master.end(SOON)), ok(slave.end(SOON)));
    for (ended, skip) in [(&master, 0), (&slave, 1)] {
        ended_with(0, ended);
        let report = ok(ended.document(skip));
        assert_eq!(ending(&report), "interrupted", "{}", ended.err);
        let datagrams = number(&report, "/wire/up/datagrams");
        assert!(datagrams > Some(100.0), "{datagrams:?}: {}", ended.err);
    }
}

#[test]
fn a_second_master_is_refused_by_name_and_disturbs_nobody() {
    let _turn = alone();
    let (slave, pairing) = slave(&["--once"]);
    let first = master(&pairing, "5s");
    std::thread::sleep(Duration::from_secs(2));
    let second = ok(master(&pairing, "5s").end(SOON));
    assert_ne!(second.status.code(), Some(0), "{}", second.err);
    assert!(second.err.to_lowercase().contains("busy"), "{}", second.err);
    assert!(!second.err.contains("panicked"), "{}", second.err);
    assert_eq!(second.out, Vec::<String>::new(), "no session, no report");
    let (first, slave) = (ok(first.end(SOON)), ok(slave.end(SOON)));
    for (ended, skip) in [(&first, 0), (&slave, 1)] {
        ended_with(0, ended);
        assert_eq!(ending(&ok(ended.document(skip))), "finished");
    }
}

#[test]
fn a_wrong_pairing_string_is_told_with_what_is_right_and_exit_code_2() {
    let _turn = alone();
    let good = "mmt://127.0.0.1:4433?pin=00&token=00";
    for wrong in [
        "",
        "nonsense",
        "http://127.0.0.1:4433",
        "mmt://127.0.0.1",
        good,
    ] {
        let ended = ok(ok(Running::mmt(&["master", wrong, "--json"])).end(SOON));
        ended_with(2, &ended);
        assert!(ended.out.is_empty(), "{:?}", ended.out);
        assert!(ended.err.contains("mmt"), "{wrong:?}: {}", ended.err);
        assert!(ended.err.contains("slave"), "{wrong:?}: {}", ended.err);
        assert!(!ended.err.contains("RUST_BACKTRACE"), "{}", ended.err);
    }
}

#[test]
fn a_token_of_another_slave_is_refused_by_name() {
    let _turn = alone();
    let (slave, pairing) = slave(&["--once"]);
    let (_, token) = pairing.rsplit_once("token=").unwrap();
    let first = if token.starts_with('A') { "B" } else { "A" };
    let other = format!("{first}{}", token.get(1..).unwrap());
    let ended = ok(master(&pairing.replace(token, &other), "5s").end(SOON));
    assert_ne!(ended.status.code(), Some(0));
    assert!(ended.err.contains("token"), "{}", ended.err);
    ok(slave.interrupt());
    let slave = ok(slave.end(SOON));
    assert!(!slave.err.contains("panicked"), "{}", slave.err);
}
