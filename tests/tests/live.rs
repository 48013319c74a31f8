//! The live system on one host: the demonstration, and how sessions are refused and taken over.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
#![allow(clippy::disallowed_methods, reason = "lets sessions go on for a while")]

use std::time::Duration;

use crate::harness::process::{Ended, PROGRAM, ProcessError, Running, number};
use crate::harness::{in_real_time, is_by_chance};
use rustix::process::Signal;
use serde_json::Value;

/// For what needs no more than a start or an end, on a host that stands still for a while.
const SOON: Duration = Duration::from_secs(60);

fn ok<T>(result: Result<T, ProcessError>) -> T {
    result.unwrap_or_else(|error| panic!("{error}"))
}

/// A slave on a port of the system's choice, and its pairing string.
fn slave(options: &[&str]) -> (Running, String) {
    ok(Running::slave(options))
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
fn the_demonstration_ends_with_a_report_whose_numbers_belong_together() {
    in_real_time(|| {
        let arguments = ["demo", "--duration", "15s", "--seed", "1", "--json"];
        let ended = ok(ok(Running::mmt(&arguments)).end(Duration::from_secs(90)));
        ended_with(0, &ended);
        let report = ok(ended.document(0));
        nothing_is_nan(&report, "");
        assert_eq!(ending(&report), "finished");
        let get = |path: &str| {
            let found = number(&report, path);
            found.unwrap_or_else(|| panic!("{path} is {:?}", report.pointer(path)))
        };
        assert_eq!((get("/seed"), get("/model/mass_kg/truth")), (1.0, 0.7));
        counts_belong_together(&report, get);
        forces_obey_their_limits_and_definitions(get);
        // 45 to 55 ms each way, more on a busy host; the histogram's classes are a percent wide
        let round_trip = get("/link/rtt_ms/p50");
        assert!(round_trip > 89.0, "{round_trip} ms");
        // packing and twice 5 ms of jitter at least
        assert!(get("/link/playout_delay_ms/p50") >= 20.0);
        for (way, kinds) in [
            ("up", &["commands", "heartbeats"][..]),
            ("down", &["updates", "scenes", "heartbeats"][..]),
        ] {
            let kinds = kinds.iter().map(|kind| format!("/messages/{way}/{kind}"));
            let sent: f64 = kinds.map(|path| get(&path)).sum();
            let lost = get(&format!("/link/loss_{way}")) * sent;
            assert!(is_by_chance(lost, sent, 0.01), "{way}: {lost} of {sent}");
        }
        for path in [
            "/haptic_loop/cpu_us",
            "/haptic_loop/lateness_us",
            "/slave_loop/cpu_us",
        ] {
            let [p50, p99, p999] =
                ["p50", "p99", "p999"].map(|name| get(&format!("{path}/{name}")));
            assert!(p50 <= p99 && p99 <= p999, "{path}: {p50} {p99} {p999}");
        }
    });
}

/// What is counted in two places, or twice in one, is the same.
fn counts_belong_together(report: &Value, get: impl Fn(&str) -> f64) {
    let duration = get("/duration_s");
    assert!(duration > 5.5, "{duration} s");
    for side in ["haptic_loop", "slave_loop"] {
        let periods = get(&format!("/{side}/ticks")) + get(&format!("/{side}/skipped"));
        assert!(periods >= 5500.0, "{side}: {periods} periods");
    }
    let causes = report.pointer("/updates/by_cause").unwrap();
    let causes = causes.as_object().unwrap().values();
    let sent = get("/updates/sent");
    assert_eq!(causes.filter_map(Value::as_f64).sum::<f64>(), sent);
    let repeated = get("/updates/repeated");
    assert_eq!(get("/messages/down/updates"), sent + repeated);
    let applied = get("/updates/applied");
    assert!(0.0 < applied && applied <= sent, "{applied} of {sent}");
    // contact is a part of the run
    assert!(get("/updates/contact_rate_hz") > get("/updates/rate_hz"));
    let (contact, pairs) = (get("/force/contact_samples"), get("/force/samples"));
    assert!(0.0 < contact && contact <= pairs, "{contact} of {pairs}");
    for way in ["up", "down"] {
        let wire = |key| get(&format!("/wire/{way}/{key}"));
        let bits = 8.0 * (wire("bytes") + wire("header_bytes") * wire("datagrams"));
        let seconds = bits / wire("bits_per_s");
        assert!(seconds > 0.95 * duration, "{way}: {seconds} s");
        assert!((wire("datagrams") / wire("rate_hz") / seconds - 1.0).abs() < 1e-9);
    }
}

/// The metrics keep their definitions, and the hand its device's limits.
fn forces_obey_their_limits_and_definitions(get: impl Fn(&str) -> f64) {
    let pmse = get("/force/pmse_x") + get("/force/pmse_y");
    assert!((get("/force/pmse") / pmse - 1.0).abs() < 1e-9, "(15)");
    // the model starts wrong, so the first touch is felt wrong; virtual time shows how soon that ends
    let (jnd7, jnd10) = (get("/force/jnd7_share"), get("/force/jnd10_share"));
    assert!(0.0 < jnd10 && jnd10 <= jnd7, "{jnd10} {jnd7}");
    let (error, error_n) = (get("/force/relative_error"), get("/force/error_rms_n"));
    assert!(0.02 < error, "{error}");
    assert!(0.0 < error_n && error_n < get("/force/largest_n"));
    let (force, step) = (get("/force/largest_n"), get("/force/largest_step_n"));
    assert!(
        force <= 8.0 + 1e-9 && step <= 2.0 + 1e-9,
        "{force} N, {step} N"
    );
    // as measured, with the sensor's noise
    assert!((1.0..15.2).contains(&get("/tool/force_peak_n")));
    let (rms, max) = (get("/pose/position_rms_m"), get("/pose/position_max_m"));
    assert!(0.0 < rms && rms <= max, "{rms} {max}");
    assert!(get("/passivity/energy_injected_j") < 1e-9);
    let least = get("/passivity/observer_min_j");
    assert!((-1e-3..=0.0).contains(&least), "{least} J");
}

#[test]
fn with_tdpa_the_hand_feels_the_tool_from_the_first_sample() {
    in_real_time(|| {
        let tdpa = ["demo", "--architecture", "tdpa", "--duration", "12s"];
        let arguments = [&tdpa[..], &["--netem", "delay 2ms", "--json"]].concat();
        let ended = ok(ok(Running::mmt(&arguments)).end(Duration::from_secs(90)));
        ended_with(0, &ended);
        let report = ok(ended.document(0));
        nothing_is_nan(&report, "");
        let name = report.pointer("/architecture/name").and_then(Value::as_str);
        assert_eq!(name, Some("tdpa"));
        let get = |path: &str| {
            let value = number(&report, path);
            value.unwrap_or_else(|| panic!("{path} is {:?}", report.pointer(path)))
        };
        let (haptic, slave) = (get("/haptic_loop/ticks"), get("/slave_loop/ticks"));
        for (path, least, most) in [
            // both ways and the play-out
            ("/architecture/round_trip_ms", 4.0, f64::INFINITY),
            // each tick at most, fewer on a busy host
            ("/messages/up/commands", 1.0, haptic),
            ("/messages/down/tools", 1.0, slave),
            // what TDPA keeps back is 2 mJ
            ("/passivity/observer_min_j", -2e-3, 0.0),
            ("/passivity/energy_injected_j", 0.0, 1e-9),
            ("/pushes/completed", 0.0, 2.0),
        ] {
            let value = get(path);
            assert!(
                (least..=most).contains(&value),
                "{path} is {value}, not {least} to {most}"
            );
        }
    });
}

#[test]
fn an_emergency_stop_of_either_side_is_shown_on_both_until_it_is_cleared_there() {
    in_real_time(|| {
        let (mut slave, pairing) = slave(&["--once"]);
        let mut master = master(&pairing, "600s");
        ok(master.wait_for_line(SOON, |line| line.contains("the session begins")));
        for side in ["slave", "master"] {
            let stopped = format!("EMERGENCY STOP ({side})");
            let stops = if side == "slave" { &slave } else { &master };
            ok(stops.signal(Signal::USR1));
            for shows in [&mut slave, &mut master] {
                ok(shows.wait_for_next_line(SOON, |line| line.contains(&stopped)));
            }
            // the other side cannot clear it
            let other = if side == "slave" { &master } else { &slave };
            ok(other.signal(Signal::USR2));
            ok(master.wait_for_next_line(SOON, |line| line.contains(&stopped)));
            let stops = if side == "slave" { &slave } else { &master };
            ok(stops.signal(Signal::USR2));
            for shows in [&mut slave, &mut master] {
                let goes_on = |line: &str| line.contains("rtt") && !line.contains("EMERGENCY");
                ok(shows.wait_for_next_line(SOON, goes_on));
            }
        }
        ok(master.interrupt());
        for ended in [ok(master.end(SOON)), ok(slave.end(SOON))] {
            ended_with(0, &ended);
        }
    });
}

#[test]
fn a_second_master_is_refused_by_name_and_disturbs_nobody() {
    in_real_time(|| {
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
    });
}

#[test]
fn a_wrong_pairing_string_is_reported_with_what_is_right_and_exit_code_2() {
    in_real_time(|| {
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
    });
}

#[test]
fn a_token_of_another_slave_is_refused_by_name() {
    in_real_time(|| {
        let (slave, pairing) = slave(&["--once"]);
        let (_, token) = pairing.rsplit_once("token=").unwrap();
        // a token is read in either case
        let first = if token.starts_with(['A', 'a']) {
            "B"
        } else {
            "A"
        };
        let other = format!("{first}{}", token.get(1..).unwrap());
        let ended = ok(master(&pairing.replace(token, &other), "5s").end(SOON));
        assert_ne!(ended.status.code(), Some(0));
        assert!(ended.err.contains("token"), "{}", ended.err);
        ok(slave.interrupt());
        let slave = ok(slave.end(SOON));
        assert!(!slave.err.contains("panicked"), "{}", slave.err);
    });
}

/// A command of an operator who keeps state in a place of their own.
fn of_operator(state: &std::path::Path, arguments: &[&str]) -> Running {
    let mut command = std::process::Command::new(PROGRAM);
    command.args(arguments).env("XDG_STATE_HOME", state);
    ok(Running::start(command))
}

#[test]
fn a_master_that_was_killed_is_back_at_once_and_another_operator_has_to_ask() {
    in_real_time(|| {
        let (here, elsewhere) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let arguments = ["slave", "--listen", "127.0.0.1:0", "--json", "--once"];
        let mut slave = of_operator(here.path(), &arguments);
        let pairing = ok(slave.pairing());
        let master = |state, options: &[&str]| {
            let arguments = [&["master", &pairing, "--json", "--duration"], options].concat();
            of_operator(state, &arguments)
        };
        let begun = |line: &str| line.contains("the session begins");

        let mut killed = master(here.path(), &["60s"]);
        ok(killed.wait_for_line(SOON, begun));
        // neither a second one here, while the first lives, nor one elsewhere
        for state in [here.path(), elsewhere.path()] {
            let refused = ok(master(state, &["1s"]).end(SOON));
            ended_with(3, &refused);
            assert!(refused.err.contains("--take-over"), "{}", refused.err);
        }
        drop(killed);
        let mut resumed = master(here.path(), &["60s"]);
        ok(resumed.wait_for_line(SOON, begun));

        let other = master(elsewhere.path(), &["1s", "--take-over"]);
        let lost = ok(resumed.end(SOON));
        ended_with(1, &lost);
        assert!(
            lost.err
                .contains("another operator has taken the slave over"),
            "{}",
            lost.err
        );
        let finished = ok(other.end(SOON));
        ended_with(0, &finished);
        assert_eq!(ending(&ok(finished.document(0))), "finished");
        let served = ok(slave.end(SOON));
        ended_with(0, &served);
        assert_eq!(ending(&ok(served.document(1))), "finished");
    });
}
