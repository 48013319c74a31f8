//! Emulated networks from the command line, as processes: recorded, met again, changed, marked as degraded.

use std::io::Write;
use std::net::{SocketAddr, UdpSocket};
use std::process::Stdio;
use std::time::Duration;

use serde_json::Value;

use super::{document, finish, judged, mmt, start};
use crate::harness::judge::Records;
use crate::harness::process::did_not_run;
use crate::harness::tshark::{TsharkError, tshark};

/// p99.9 above 1 ms, as far as the numbers beside the mark show it.
fn is_marked_rightly(p99_us: &Value, max_us: &Value, degraded: &Value) -> bool {
    let above = |us: &Value| us.as_f64().unwrap() > 1000.0;
    let degraded = degraded.as_bool().unwrap();
    (!above(p99_us) || degraded) && (above(max_us) || !degraded)
}

#[test]
fn a_demo_records_what_its_packets_met_and_meets_it_again() {
    let home = tempfile::tempdir().unwrap();
    let first = [
        "demo",
        "--duration",
        "2s",
        "--netem-up",
        "delay 30ms loss every 10",
        "--netem-down",
        "delay 5ms",
        "--netem-record",
        "run.bin",
        "--json",
    ];
    let first = document(&judged(mmt(&home, &first)));
    for side in ["up", "down"] {
        let emulation = &first["emulation"][side];
        assert!(emulation["released"].as_u64().unwrap() > 0, "{side}");
        let late = &emulation["late_us"];
        let mark = &emulation["degraded"];
        assert!(
            is_marked_rightly(&late["p99"], &late["max"], mark),
            "{emulation}"
        );
    }

    let report = document(
        &mmt(&home, &["netem", "report", "run.bin", "--json"])
            .output()
            .unwrap(),
    );
    let up = &report["up"];
    assert_eq!(up["words"], "delay 30ms loss every 10");
    assert_eq!(report["down"]["words"], "delay 5ms");
    let offered = up["achieved"]["offered"]["packets"].as_u64().unwrap();
    assert!(offered >= 10, "{offered}");
    assert_eq!(up["achieved"]["dropped"]["loss"], offered / 10);
    assert!(up["achieved"]["mean_ms"].as_f64().unwrap() >= 30.0);

    let again = [
        "demo",
        "--duration",
        "2s",
        "--netem-up",
        "trace run.bin up",
        "--netem-down",
        "trace run.bin down",
        "--json",
    ];
    let again = document(&judged(mmt(&home, &again)));
    let configuration = &again["configuration"];
    assert_eq!(configuration["master"]["netem"], "trace run.bin up");
    assert_eq!(configuration["slave"]["netem"], "trace run.bin down");
    assert!(again["drops"]["master_netem_loss"].as_u64().unwrap() > 0);
    assert_eq!(again["drops"]["slave_netem_loss"], 0);
    assert!(again["link"]["rtt_ms"]["p50"].as_f64().unwrap() >= 35.0);
}

#[test]
fn a_demo_at_work_takes_new_networks_from_stdin() {
    let home = tempfile::tempdir().unwrap();
    let arguments = [
        "demo",
        "--duration",
        "3s",
        "--netem",
        "none",
        "--netem-control",
        "--json",
    ];
    let mut command = mmt(&home, &arguments);
    let records = Records::of(&mut command).unwrap();
    let mut child = command.stdin(Stdio::piped()).spawn().unwrap();
    let mut orders = child.stdin.take().unwrap();
    // it takes them as soon as it runs, whether or not the session has begun
    writeln!(orders, "sideways\nrebind\nup loss every 4").unwrap();
    let output = child.wait_with_output().unwrap();
    records.judge().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(stderr.contains("no command \"sideways\""), "{stderr}");
    assert!(stderr.contains("only the relay"), "{stderr}");
    assert!(stderr.contains("loss 25.000 %"), "{stderr}");
    let report = document(&output);
    assert!(
        report["drops"]["master_netem_loss"].as_u64().unwrap() > 10,
        "{stderr}"
    );
    assert_eq!(report["drops"]["slave_netem_loss"], 0);
    drop(orders);
}

#[test]
fn a_relay_carries_any_protocol_and_reports_whether_it_was_in_time() {
    let home = tempfile::tempdir().unwrap();
    let target = UdpSocket::bind("127.0.0.1:0").unwrap();
    target
        .set_read_timeout(Some(Duration::from_secs(30)))
        .unwrap();
    let to = target.local_addr().unwrap().to_string();
    // a free port: bound once, so that the relay can be told of it before it listens
    let listen = UdpSocket::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let at = listen.to_string();
    let arguments = [
        "netem",
        "--listen",
        &at,
        "--to",
        &to,
        "--up",
        "delay 3ms ecn loss every 1000",
        "--duration",
        "3s",
        "--json",
    ];
    let child = mmt(&home, &arguments).spawn().unwrap();
    let client = UdpSocket::bind("127.0.0.1:0").unwrap();
    client
        .set_read_timeout(Some(Duration::from_millis(50)))
        .unwrap();
    let mut buffer = [0; 100];
    target.set_nonblocking(true).unwrap();
    // until the relay listens
    while target.recv(&mut buffer).is_err() {
        client.send_to(b"no QUIC at all", listen).unwrap();
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = child.wait_with_output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let (address, rest) = printed.split_once('\n').unwrap();
    assert_eq!(address, at);
    let report: Value = serde_json::from_str(rest).unwrap();
    let late = &report["counters"]["lateness"];
    assert!(late["count"].as_u64().unwrap() > 0);
    assert!(is_marked_rightly(
        &late["p99_us"],
        &late["max_us"],
        &report["degraded"]
    ));
}

#[test]
fn a_master_keeps_the_path_that_it_met_as_a_trace() {
    let home = tempfile::tempdir().unwrap();
    let arguments = ["slave", "--listen", "127.0.0.1:0", "--once"];
    let (slave, line) = start(mmt(&home, &arguments));
    let arguments = [
        "master",
        &line,
        "--duration",
        "2s",
        "--netem",
        "delay 40ms",
        "--record-path",
        "path.csv",
        "--json",
    ];
    let master = document(&judged(mmt(&home, &arguments)));
    assert_eq!(master["ending"], "finished");
    let (_, code) = finish(slave);
    assert_eq!(code, Some(0));

    let arguments = [
        "netem",
        "--listen",
        "127.0.0.1:0",
        "--to",
        "127.0.0.1:9",
        "--up",
        "trace path.csv",
        "--duration",
        "10ms",
        "--json",
    ];
    let output = mmt(&home, &arguments).output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let (_, rest) = printed.split_once('\n').unwrap();
    let relay: Value = serde_json::from_str(rest).unwrap();
    // 40 ms one way: half a round trip is at least 20
    let effect = &relay["configuration"]["effect_up"];
    assert!(effect["mean_ms"].as_f64().unwrap() >= 20.0, "{effect}");
    assert_eq!(relay["configuration"]["up"], "trace path.csv");
}

#[test]
fn a_relay_prints_its_address_first_and_its_counters_when_interrupted() {
    let home = tempfile::tempdir().unwrap();
    let target = UdpSocket::bind("127.0.0.1:0").unwrap();
    let to = target.local_addr().unwrap().to_string();
    let arguments = [
        "netem",
        "--listen",
        "127.0.0.1:0",
        "--to",
        &to,
        "--up",
        "loss 100%",
        "--json",
    ];
    let (relay, line) = start(mmt(&home, &arguments));
    let address: SocketAddr = line.parse().unwrap();
    let source = UdpSocket::bind("127.0.0.1:0").unwrap();
    source.send_to(b"lost", address).unwrap();
    relay.interrupt().unwrap();
    let (rest, code) = finish(relay);
    assert_eq!(code, Some(0));
    let document: Value = serde_json::from_str(&rest).unwrap();
    assert_eq!(document["ending"], "interrupted");
    let up = &document["counters"]["up"];
    assert_eq!(up["link"]["offered"], up["link"]["dropped"]["loss"]);
    assert_eq!(up["sent"]["packets"], 0);
}

#[test]
fn a_record_is_compared_with_the_settings_it_was_made_with() {
    let home = tempfile::tempdir().unwrap();
    let target = UdpSocket::bind("127.0.0.1:0").unwrap();
    let to = target.local_addr().unwrap().to_string();
    let file = home.path().join("run.csv");
    let file = file.to_str().unwrap();
    let arguments = [
        "netem",
        "--listen",
        "127.0.0.1:0",
        "--to",
        &to,
        "--up",
        "delay 20ms loss list 3",
        "--record",
        file,
    ];
    let (relay, line) = start(mmt(&home, &arguments));
    let address: SocketAddr = line.parse().unwrap();
    let source = UdpSocket::bind("127.0.0.1:0").unwrap();
    let patience = Some(Duration::from_secs(30));
    target.set_read_timeout(patience).unwrap();
    for number in 0..10_u8 {
        source.send_to(&[number], address).unwrap();
        if number != 3 {
            let mut buffer = [0; 10];
            assert_eq!(target.recv(&mut buffer).unwrap(), 1);
            assert_eq!(buffer[0], number);
        }
    }
    relay.interrupt().unwrap();
    let (_, code) = finish(relay);
    assert_eq!(code, Some(0));

    let output = mmt(&home, &["netem", "report", file, "--json"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let up = &document(&output)["up"];
    assert_eq!(up["words"], "delay 20ms loss list 3");
    assert_eq!(up["achieved"]["offered"]["packets"], 10);
    assert_eq!(up["achieved"]["sent"]["packets"], 9);
    assert_eq!(up["achieved"]["dropped"]["loss"], 1);
    assert!(up["achieved"]["mean_ms"].as_f64().unwrap() >= 20.0);
    assert!((up["configured"]["mean_ms"].as_f64().unwrap() - 20.0).abs() < 1e-6);

    let mut output = mmt(&home, &["netem", "report", file, "--full"]);
    let text = String::from_utf8(output.output().unwrap().stdout).unwrap();
    assert!(
        text.contains("configured") && text.contains("lost in a row"),
        "{text}"
    );
    let output = mmt(&home, &["netem", "report", file]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    for part in [
        "up   delay 20ms loss list 3\n",
        "10.0 % were dropped (20.0 ms and 10.0 % by the settings); down nothing came.\n",
        "  dropped, %                  10.000      10.000           -           -\n",
    ] {
        assert!(text.contains(part), "{part} in:\n{text}");
    }
    assert!(
        !text.contains("reordered") && text.lines().count() < 18,
        "{text}"
    );
}

/// A column of what tshark shows of a capture, a line a packet; none without tshark, which is not allowed in CI.
pub(super) fn columns(capture: &std::path::Path, names: &[&str]) -> Option<Vec<Vec<String>>> {
    let names = names.iter().flat_map(|name| ["-e", name]);
    let options: Vec<String> = ["-T", "fields"]
        .into_iter()
        .chain(names)
        .map(str::to_owned)
        .collect();
    match tshark(capture, &options) {
        Err(TsharkError::Missing(error)) => {
            did_not_run("a capture of emulated links in tshark", &error.to_string());
            None
        }
        shown => {
            let line = |line: &str| line.split('\t').map(str::to_owned).collect();
            Some(shown.unwrap().lines().map(line).collect())
        }
    }
}

#[test]
fn a_capture_opens_in_tshark_with_fates_and_times_and_its_two_sides_make_a_trace() {
    let home = tempfile::tempdir().unwrap();
    let target = UdpSocket::bind("127.0.0.1:0").unwrap();
    target
        .set_read_timeout(Some(Duration::from_secs(30)))
        .unwrap();
    let to = target.local_addr().unwrap();
    let file = home.path().join("run.pcapng");
    let relay = ["netem", "--listen", "127.0.0.1:0", "--to", &to.to_string()].map(str::to_owned);
    let words = [
        "--up",
        "delay 20ms loss list 3",
        "--down",
        "delay 10ms duplicate 100%",
    ]
    .map(str::to_owned);
    let arguments: Vec<String> = relay.into_iter().chain(words).collect();
    let mut arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    arguments.extend(["--pcap", "run.pcapng"]);
    let (relay, line) = start(mmt(&home, &arguments));
    let address: SocketAddr = line.parse().unwrap();
    let source = UdpSocket::bind("127.0.0.1:0").unwrap();
    source
        .set_read_timeout(Some(Duration::from_secs(30)))
        .unwrap();
    let mut buffer = [0; 100];
    for number in 0..10_u8 {
        source.send_to(&[7, number], address).unwrap();
        if number != 3 {
            let (_, from) = target.recv_from(&mut buffer).unwrap();
            target.send_to(&[8, number], from).unwrap();
            assert_eq!(source.recv(&mut buffer).unwrap(), 2);
            assert_eq!(source.recv(&mut buffer).unwrap(), 2, "the copy");
        } else {
            // a packet of the trace meets what the last one before it met: the loss lasts until the next
            std::thread::sleep(Duration::from_millis(20));
        }
    }
    relay.interrupt().unwrap();
    assert_eq!(finish(relay).1, Some(0));

    let fields = [
        "frame.interface_name",
        "frame.time_epoch",
        "udp.payload",
        "udp.srcport",
        "udp.dstport",
        "frame.comment",
    ];
    let Some(packets) = columns(&file, &fields) else {
        return;
    };
    let on = |side: &'static str| packets.iter().filter(move |packet| packet[0] == side);
    let counts = ["up in", "up out", "down in", "down out"].map(|side| on(side).count());
    assert_eq!(counts, [10, 9, 9, 18]);
    let ns = |packet: &[String]| -> i64 {
        let (s, part) = packet[1].split_once('.').unwrap();
        s.parse::<i64>().unwrap() * 1_000_000_000 + part.parse::<i64>().unwrap()
    };
    assert!(packets.is_sorted_by_key(|packet| ns(packet)), "{packets:?}");
    for came in on("up in") {
        let port = |at: SocketAddr| at.port().to_string();
        assert_eq!(
            came[3..5],
            [port(source.local_addr().unwrap()), port(address)]
        );
        if came[2] == "0703" {
            assert_eq!(came[5], "up 3: lost (loss)");
            continue;
        }
        let left = on("up out").find(|left| left[2] == came[2]).unwrap();
        assert_eq!(left[4], port(to));
        let delay = (ns(left) - ns(came)) as f64 / 1e6;
        assert!(delay >= 20.0, "{delay} ms");
        assert!(
            came[5].contains(&format!("delayed {delay:.6} ms")),
            "{came:?} {delay}"
        );
        assert_eq!(came[5], left[5]);
    }
    assert_eq!(
        on("down out")
            .filter(|left| left[5].ends_with(", a copy"))
            .count(),
        9
    );

    // what a capture before the relay and one behind it would hold
    for (side, name) in [("0", "from"), ("1", "to")] {
        let kept = home.path().join(format!("{name}.pcapng"));
        let options = [
            "-Y",
            &format!("frame.interface_id == {side}"),
            "-w",
            kept.to_str().unwrap(),
        ];
        tshark(&file, &options.map(str::to_owned)).unwrap();
    }
    let trace = [
        "netem",
        "trace",
        "from.pcapng",
        "to.pcapng",
        "--out",
        "path.csv",
    ];
    let output = mmt(&home, &trace).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let report = document(
        &mmt(&home, &["netem", "report", "path.csv", "--json"])
            .output()
            .unwrap(),
    );
    let up = &report["up"]["achieved"];
    assert_eq!(up["offered"]["packets"], 10);
    assert_eq!(up["dropped"]["loss"], 1);
    assert!(up["mean_ms"].as_f64().unwrap() >= 20.0, "{up}");
    let plays = [
        "netem",
        "--listen",
        "127.0.0.1:0",
        "--to",
        "127.0.0.1:9",
        "--up",
        "trace path.csv up",
        "--duration",
        "10ms",
        "--json",
    ];
    let output = mmt(&home, &plays).output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let relay: Value = serde_json::from_str(printed.split_once('\n').unwrap().1).unwrap();
    let effect = &relay["configuration"]["effect_up"];
    assert!(
        effect["mean_ms"].as_f64().unwrap() >= 20.0 && effect["loss"].as_f64().unwrap() > 0.0,
        "{effect}"
    );
}
