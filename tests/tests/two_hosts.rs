//! Slave and master as two processes on two hosts, the relay between them on a third.
//!
//! The hosts are network namespaces with addresses of their own, each on one cable to the relay's; there
//! is no other way between them. Needs root and `ip`: without, it says so, and with `CI` set it fails.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

use crate::harness::hosts::{Hosts, HostsError, Session};
use crate::harness::process::{did_not_run, number};
use crate::harness::{in_real_time, is_by_chance};
use serde_json::Value;

/// How long the master operates, s.
const SECONDS: u64 = 8;
/// What the relay does to each direction.
const LINK: &str = "delay 20ms 2ms loss 1%";
const LOSS: f64 = 0.01;
/// Packets on a cable that no report counts: ARP, and what QUIC sends last when all is counted.
const BESIDE: f64 = 8.0;
/// Bytes of them: small ones, and the farewell that carries the counts, which is up to three packets with their headers.
const BESIDE_BYTES: f64 = (BESIDE - 3.0) * 100.0 + 3.0 * 1500.0;
/// An Ethernet header, bytes.
const ETHERNET: f64 = 14.0;
/// Magic, version, type and flags of a message, bytes.
const MESSAGE_HEADER: f64 = 8.0;
/// Ethernet, IPv4 and UDP headers, bytes.
const HEADERS: f64 = ETHERNET + 20.0 + 8.0;

fn get(report: &Value, path: &str) -> f64 {
    let found = number(report, path);
    found.unwrap_or_else(|| panic!("{path} is {:?}", report.pointer(path)))
}

#[test]
fn two_hosts_report_the_same_session_and_agree_with_their_cables() {
    in_real_time(|| {
        let test = "two_hosts";
        let hosts = match Hosts::try_new() {
            Err(HostsError::Unavailable(why)) => return did_not_run(test, &why),
            hosts => hosts.unwrap_or_else(|error| panic!("{error}")),
        };
        let session = hosts.session(LINK, SECONDS, 1);
        let session = session.unwrap_or_else(|error| panic!("{error}"));
        the_job_was_done(&session);
        what_one_side_counted_the_other_reports(&session);
        what_was_sent_was_received_or_lost(&session);
        the_cables_counted_the_same(&session);
        the_kernels_counted_the_same(&session);
        the_three_rates_belong_together(&session);
    });
}

/// A host that stands still for a while makes it longer.
fn the_job_was_done(session: &Session) {
    for report in [&session.slave, &session.master] {
        let ending = report.pointer("/ending").and_then(Value::as_str);
        assert_eq!(ending, Some("finished"));
        let duration = get(report, "/duration_s");
        assert!(duration > SECONDS as f64 - 1.0, "{duration} s");
        assert!(get(report, "/updates/sent") > 0.0);
        // 20 ms ± 2 ms each way, more on a busy host; the histogram's classes are a percent wide
        let round_trip = get(report, "/link/rtt_ms/p50");
        assert!(round_trip > 39.5, "{round_trip} ms");
    }
    let (ticks, skipped) = (
        get(&session.master, "/haptic_loop/ticks"),
        get(&session.master, "/haptic_loop/skipped"),
    );
    let periods = (ticks + skipped) / get(&session.master, "/duration_s");
    assert!((periods / 1e3 - 1.0).abs() < 0.1, "{periods} periods/s");
}

fn what_one_side_counted_the_other_reports(session: &Session) {
    let both = |path: &str| (get(&session.slave, path), get(&session.master, path));
    for path in [
        "/updates/sent",
        "/updates/repeated",
        "/updates/by_cause/deadband",
        "/updates/by_cause/timer",
        "/force/pmse",
        "/force/pmse_x",
        "/force/pmse_y",
        "/force/pmse_magnitude",
        "/force/relative_error",
        "/force/jnd7_share",
        "/model/mass_kg/estimate",
        "/model/mass_kg/truth",
    ] {
        let (slave, master) = both(path);
        assert_eq!(slave, master, "{path}");
    }
    let (sent, _) = both("/updates/sent");
    let applied = get(&session.master, "/updates/applied");
    assert!(0.0 < applied && applied <= sent, "{applied} of {sent}");
}

fn what_was_sent_was_received_or_lost(session: &Session) {
    let sides = [
        ("up", &session.master, &session.slave),
        ("down", &session.slave, &session.master),
    ];
    for (way, from, to) in sides {
        let sent = get(from, &format!("/wire/{way}/datagrams"));
        let received = get(to, &format!("/wire/{way}/datagrams"));
        assert!(sent > 20.0 * SECONDS as f64, "{way}: {sent} datagrams");
        // the farewell, which carries the counts, leaves after them
        assert!(
            sent + BESIDE >= received,
            "{way}: {sent} sent, {received} received"
        );
        assert!(
            is_by_chance(sent - received, sent, LOSS),
            "{way}: {received} of {sent}"
        );
        // by the numbers of the application's own datagrams
        for report in [from, to] {
            let share = get(report, &format!("/link/loss_{way}"));
            assert!(
                is_by_chance(share * sent, sent, LOSS),
                "{way}: loss {share}"
            );
        }
    }
    let kinds = [
        ("/messages/up/commands", &session.master, &session.slave),
        ("/messages/down/updates", &session.slave, &session.master),
        ("/messages/down/heartbeats", &session.slave, &session.master),
    ];
    for (path, from, to) in kinds {
        let (sent, received) = (get(from, path), get(to, path));
        assert!(sent >= received, "{path}: {sent} sent, {received} received");
    }
}

fn the_cables_counted_the_same(session: &Session) {
    let of = |report, way: &str| {
        let datagrams = get(report, &format!("/wire/{way}/datagrams"));
        let bytes = get(report, &format!("/wire/{way}/bytes"));
        (datagrams, bytes + HEADERS * datagrams)
    };
    let (slave, master) = (session.slave_cable, session.master_cable);
    let pairs = [
        (
            "slave, down",
            of(&session.slave, "down"),
            (slave.sent, slave.sent_bytes),
        ),
        (
            "slave, up",
            of(&session.slave, "up"),
            (slave.received, slave.received_bytes),
        ),
        (
            "master, up",
            of(&session.master, "up"),
            (master.sent, master.sent_bytes),
        ),
        (
            "master, down",
            of(&session.master, "down"),
            (master.received, master.received_bytes),
        ),
    ];
    for (end, (datagrams, bytes), (packets, octets)) in pairs {
        // beside the session there is ARP, and the farewell's last words after the count
        assert!(
            datagrams <= packets && packets <= datagrams + BESIDE,
            "{end}: the socket counted {datagrams} datagrams, the cable {packets}"
        );
        assert!(
            bytes <= octets && octets <= bytes + BESIDE_BYTES,
            "{end}: the socket counted {bytes} bytes with headers, the cable {octets}"
        );
    }
}

/// No datagram of ours is left out or counted twice: the kernels know of no other.
fn the_kernels_counted_the_same(session: &Session) {
    let of = |report, way: &str| get(report, &format!("/wire/{way}/datagrams"));
    let (slave, master) = (session.slave_udp, session.master_udp);
    for (end, counted, kernel) in [
        ("slave, down", of(&session.slave, "down"), slave.sent),
        ("slave, up", of(&session.slave, "up"), slave.received),
        ("master, up", of(&session.master, "up"), master.sent),
        ("master, down", of(&session.master, "down"), master.received),
    ] {
        // beside the session there are only the farewell's last words after the count
        assert!(
            counted <= kernel && kernel <= counted + BESIDE,
            "{end}: the socket counted {counted} datagrams, the kernel {kernel}"
        );
    }
    assert_eq!((slave.refused, master.refused), (0.0, 0.0));
}

/// Messages by kind and cause, UDP datagrams, and bits per second with IP and UDP headers.
fn the_three_rates_belong_together(session: &Session) {
    let sum = |report, paths: &[&str]| paths.iter().map(|path| get(report, path)).sum::<f64>();
    let (slave, master) = (&session.slave, &session.master);
    let (updates, repeats) = (
        get(slave, "/messages/down/updates"),
        get(slave, "/messages/down/repeats"),
    );
    assert!(
        repeats > 0.0,
        "a round trip of 40 ms leaves time for repeats"
    );
    assert_eq!(updates, sum(slave, &["/updates/sent", "/updates/repeated"]));
    let causes = slave.pointer("/updates/repeated_by_cause");
    let causes = causes.and_then(Value::as_object).unwrap().values();
    assert_eq!(repeats, causes.filter_map(Value::as_f64).sum::<f64>());
    // the master had most updates at the first saying
    let seen_again = get(master, "/messages/down/repeats");
    assert!(
        seen_again > 0.0 && seen_again <= repeats,
        "{seen_again} of {repeats}"
    );

    let up = ["/messages/up/commands", "/messages/up/heartbeats"];
    let down = [
        "/messages/down/updates",
        "/messages/down/scenes",
        "/messages/down/heartbeats",
    ];
    for (way, report, kinds, cable) in [
        ("up", master, &up[..], session.master_cable),
        ("down", slave, &down[..], session.slave_cable),
    ] {
        let rate = |of: &str| get(report, &format!("/{of}/{way}/rate_hz"));
        let (messages, datagrams) = (
            sum(report, kinds),
            get(report, &format!("/wire/{way}/datagrams")),
        );
        // on a busy host messages share a datagram; each has at least its header
        let bytes = get(report, &format!("/wire/{way}/bytes"));
        assert!(
            messages * MESSAGE_HEADER < bytes,
            "{way}: {messages} messages, {bytes} bytes"
        );
        let seconds = messages / rate("messages");
        assert!((datagrams / rate("wire") / seconds - 1.0).abs() < 1e-9);
        // the cable's bits without Ethernet
        let bits = 8.0 * (cable.sent_bytes - ETHERNET * cable.sent);
        let reported = get(report, &format!("/wire/{way}/bits_per_s")) * seconds;
        assert!(
            reported <= bits && bits <= reported + 8.0 * BESIDE_BYTES,
            "{way}: {reported} bits reported, {bits} on the cable"
        );
    }
}
