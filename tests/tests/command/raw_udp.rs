//! `--transport udp` as a process: a whole session with its report, the warning, and where it is refused.

use std::process::Output;

use serde_json::Value;

fn mmt(arguments: &[&str]) -> Output {
    let home = tempfile::tempdir().unwrap();
    super::judged(super::mmt(&home, arguments))
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Refused before anything happens: no data, exit code 2, and what to do.
fn refuses(arguments: &[&str], parts: &[&str]) {
    let (output, parts) = (mmt(arguments), [parts, &["--insecure"]].concat());
    let text = errors(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(output.stdout.is_empty());
    for part in parts {
        assert!(text.contains(part), "{part} is missing in: {text}");
    }
}

fn pairing(host: &str) -> String {
    let (pin, token) = ("0f".repeat(32), "a5".repeat(32));
    format!("mmt://{host}:4433?pin={pin}&token={token}")
}

#[test]
fn a_demo_over_raw_udp_is_a_whole_session_and_states_that_it_is_insecure() {
    let output = mmt(&[
        "demo",
        "--transport",
        "udp",
        "--duration",
        "2s",
        "--netem",
        "none",
        "--json",
    ]);
    let text = errors(&output);
    assert!(output.status.success(), "{text}");
    assert!(text.contains("warning: --transport udp"), "{text}");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["ending"], "finished", "{text}");
    for side in ["master", "slave"] {
        assert_eq!(report["configuration"][side]["transport"], "udp");
    }
    // one packet a message, and QUIC's own for handshake, hello, welcome, farewells, close
    for way in ["up", "down"] {
        let count = |section: &str, key: &str| report[section][way][key].as_u64().unwrap();
        let kinds = ["commands", "updates", "heartbeats", "scenes"];
        let messages: u64 = kinds
            .iter()
            .filter_map(|kind| report["messages"][way][kind].as_u64())
            .sum();
        let datagrams = count("wire", "datagrams");
        assert!(messages > 0 && datagrams >= messages, "{way}: {report}");
        // what a slow host answers late is repeated
        assert!(datagrams <= messages + 60, "{way}: {report}");
    }
}

#[test]
fn a_slave_refuses_to_be_reached_from_elsewhere() {
    for listen in ["0.0.0.0:0", "[::]:0", "192.0.2.1:4433"] {
        refuses(
            &["slave", "--listen", listen, "--transport", "udp"],
            &["not a loopback address", "use QUIC"],
        );
    }
}

#[test]
fn a_master_refuses_to_reach_elsewhere() {
    let pairing = pairing("192.0.2.1");
    refuses(
        &["master", &pairing, "--transport", "udp"],
        &["192.0.2.1:4433", "not a loopback address"],
    );
}

#[test]
fn insecure_goes_with_raw_udp_only() {
    refuses(&["demo", "--insecure"], &["--transport udp only"]);
    let pairing = pairing("127.0.0.1");
    refuses(
        &["master", &pairing, "--insecure"],
        &["--transport udp only"],
    );
    refuses(
        &["slave", "--listen", "127.0.0.1:0", "--insecure"],
        &["--transport udp only"],
    );
}

#[test]
fn who_insists_is_warned_that_commands_are_readable() {
    // a wildcard that is not loopback; it ends at once, because nobody may take a port twice
    let taken = std::net::UdpSocket::bind("0.0.0.0:0").unwrap();
    let listen = taken.local_addr().unwrap().to_string();
    let output = mmt(&[
        "slave",
        "--listen",
        &listen,
        "--transport",
        "udp",
        "--insecure",
    ]);
    let text = errors(&output);
    assert_eq!(output.status.code(), Some(5), "{text}");
    assert!(
        text.contains("commands and updates cross the network in the clear"),
        "{text}"
    );
}
