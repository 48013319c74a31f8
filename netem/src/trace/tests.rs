//! Traces of every format known, and what is said of those that are none.

use std::time::Duration;

use super::mahimahi::Opportunities;
use super::path::PathTrace;
use super::*;
use crate::direction::Direction;

const UP: Option<Direction> = Some(Direction::Up);
const DOWN: Option<Direction> = Some(Direction::Down);

fn path(text: &str, direction: Option<Direction>) -> PathTrace {
    PathTrace::parse(text, direction).unwrap()
}

fn refused(text: &str) -> TraceError {
    PathTrace::parse(text, UP).unwrap_err()
}

/// Times and delays in microseconds.
fn micros(path: &PathTrace) -> Vec<(u128, Option<u128>)> {
    let of = |sample: &Sample| {
        let delay = sample.delay.map(|delay| delay.as_micros());
        (sample.at.as_micros(), delay)
    };
    path.samples().iter().map(of).collect()
}

const PING: &str = "\
PING 192.0.2.1 (192.0.2.1) 56(84) bytes of data.
[1700182800.100000] 64 bytes from 192.0.2.1: icmp_seq=1 ttl=63 time=60.0 ms
[1700182801.100000] 64 bytes from 192.0.2.1: icmp_seq=2 ttl=63 time=60.0 ms
[1700182804.140000] 64 bytes from 192.0.2.1: icmp_seq=5 ttl=63 time=100 ms

--- 192.0.2.1 ping statistics ---
";

#[test]
fn ping_gives_half_of_each_round_trip_and_its_gaps_are_losses() {
    let path = path(PING, None);
    let expected = [
        (0, Some(30_000)),
        (1_000_000, Some(30_000)),
        (2_000_000, None),
        (3_000_000, None),
        (4_000_000, Some(50_000)),
    ];
    let found = micros(&path);
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.0.abs_diff(expected.0) <= 2, "{found:?}");
        assert_eq!(found.1, expected.1);
    }
    assert!((path.loss() - 0.4).abs() < 1e-9);
    assert_eq!(path.at(Duration::from_millis(2500)), None);
    assert_eq!(
        path.at(Duration::from_millis(4500)),
        Some(Duration::from_millis(50))
    );
    // after the end it begins again
    assert_eq!(
        path.at(Duration::from_millis(5500)),
        Some(Duration::from_millis(30))
    );
    // as files of LENS begin
    let warned = format!(
        "ping: Warning: source address might be selected on device other than: ens33.\n{PING}"
    );
    assert_eq!(micros(&self::path(&warned, None)), micros(&path));
}

#[test]
fn a_short_text_of_pings_does_not_become_a_long_path() {
    let answers = |numbers: &[u64]| {
        let line = |number| format!("[1700{number}.1] icmp_seq={number} time=60.0 ms\n");
        let lines: String = numbers.iter().map(line).collect();
        format!("PING\n{lines}")
    };
    let day = answers(&[100_000, 190_000]);
    assert_eq!(path(&day, None).samples().len(), 90_001);
    let days = refused(&answers(&[100_000, 190_000, 280_000]));
    assert!(days.reason.contains("missing"), "{days}");
}

#[test]
fn lens_csv_is_read_in_both_of_its_forms() {
    let irtt = "timestamp,rtt,uplink,downlink\n\
                1705744800616897349,0,0,-1\n\
                1705744800626565141,120.126123,72.439368,47.68675\n\
                1705744800636737402,109.976237,62.295097,47.681199\n";
    let up = micros(&path(irtt, UP));
    // the first was lost on its way down: it arrived
    let arrived = Some(72_439);
    assert_eq!(up, [(0, arrived), (9_667, arrived), (19_840, Some(62_295))]);
    assert_eq!(micros(&path(irtt, DOWN))[0].1, None);
    assert_eq!(micros(&path(irtt, DOWN))[1].1, Some(47_686));
    assert_eq!(micros(&path(irtt, None))[0].1, None);
    assert_eq!(micros(&path(irtt, None))[1].1, Some(60_063));
    let ping = "timestamp,rtt\n1705744800.533641,91.8\n1705744800.55492,96.5\n";
    assert_eq!(micros(&path(ping, None))[1].1, Some(48_250));
}

/// Two round trips of the example in the data set's own description, and a loss.
const IRTT: &str = r#"{
    "version": { "irtt": "0.9.1", "json_format": 1 },
    "round_trips": [
        {
            "seqno": 0,
            "lost": "false",
            "timestamps": { "client": { "send": { "wall": 1707277440772833721, "monotonic": 22211105 } } },
            "delay": { "receive": -10470921269, "rtt": 17291970, "send": 10488213200 }
        },
        {
            "seqno": 1,
            "lost": "true_down",
            "timestamps": { "client": { "send": { "wall": 1707277441773479264, "monotonic": 1022856655 } } }
        },
        {
            "seqno": 2,
            "lost": "false",
            "timestamps": { "client": { "send": { "wall": 1707277442772652035, "monotonic": 2022029432 } } },
            "delay": { "receive": -10470373417, "rtt": 16064572, "send": 10486437967 }
        }
    ]
}"#;

#[test]
fn irtt_json_gives_each_way_up_to_the_offset_of_the_clocks() {
    // the shortest way up is the last one: half of the shortest round trip, 8032 us
    let up = micros(&path(IRTT, UP));
    assert_eq!(
        up,
        [
            (0, Some(9_807)),
            (1_000_645, Some(9_807)),
            (1_999_818, Some(8_032))
        ]
    );
    let down = micros(&path(IRTT, DOWN));
    assert_eq!(
        (down[0].1, down[1].1, down[2].1),
        (Some(8_032), None, Some(8_580))
    );
    let half = micros(&path(IRTT, None));
    assert_eq!((half[0].1, half[2].1), (Some(8_645), Some(8_032)));
}

#[test]
fn each_loss_of_a_trace_with_directions_is_one_loss() {
    let lens = "timestamp,rtt,uplink,downlink\n1,5,2,3\n2,0,0,-1\n3,0,-1,0\n4,0,0,-1\n5,5,2,3\n";
    let trip = |lost: &str| IRTT.replacen("true_down", lost, 1);
    let twice = |lost: &str| trip(lost).replacen("\"false\"", &format!("\"{lost}\""), 1);
    for (text, lost_up, lost_down) in [
        (lens.to_owned(), 1, 2),
        (trip("true_down"), 0, 1),
        (trip("true_up"), 1, 0),
        // nobody knows where: once for each way in turn
        (trip("true"), 1, 0),
        (twice("true"), 1, 1),
    ] {
        let lost = |direction| {
            let path = path(&text, direction);
            path.samples()
                .iter()
                .filter(|sample| sample.delay.is_none())
                .count()
        };
        assert_eq!((lost(UP), lost(DOWN)), (lost_up, lost_down), "{text}");
        assert_eq!(lost(None), lost_up + lost_down, "{text}");
    }
}

#[test]
fn a_path_written_down_reads_back() {
    let original = path(PING, None);
    let text = mmt::path_text(original.samples());
    assert_eq!(path(&text, None), original);
}

#[test]
fn mahimahi_traces_tell_their_rate() {
    let trace = Opportunities::parse("t", "1\n2\n3\n4\n5\n").unwrap();
    // 1500 bytes each millisecond
    assert!((trace.mean_bit_s() - 12e6).abs() < 1.0);
    for (text, line) in [
        ("1\nx\n", 2),
        ("3\n2\n", 2),
        ("0\n0\n", 2),
        ("", 1),
        ("-1", 1),
    ] {
        assert_eq!(
            Opportunities::parse("t", text).unwrap_err().line,
            line,
            "{text}"
        );
    }
}

#[test]
fn what_is_no_trace_is_reported_with_its_line_and_reason() {
    let no_stamp = PING.replacen("[1700182801.100000] ", "", 1);
    let seqno = IRTT.replacen("\"true_down\"", "\"perhaps\"", 1);
    let no_rtt = IRTT
        .replace("\"rtt\": 16064572, ", "")
        .replace("\"send\": 10486437967", "\"x\": 1");
    for (text, line, reason) in [
        ("hello", 1, "no trace known"),
        ("", 1, "no trace known"),
        (no_stamp.as_str(), 3, "ping -D"),
        (&PING.replace("60.0 ms", "soon"), 2, "a round trip in ms"),
        (
            &PING.replace("icmp_seq=5", "icmp_seq=five"),
            4,
            "a number after",
        ),
        ("PING 192.0.2.1\n", 1, "no probe of this path arrived"),
        ("timestamp,rtt\n1.0,5\n2.0,x\n", 3, "expected numbers"),
        ("timestamp,rtt\nnow,5\n", 2, "a stamp"),
        ("timestamp,rtt\n1.0,-5\n", 2, "between 0 and 1 h"),
        (
            &IRTT.replacen("\"lost\"", "\"list\"", 1),
            9,
            "no irtt result",
        ),
        (&seqno, 11, "true_down"),
        (&no_rtt, 16, "without its rtt"),
        ("{", 1, "no irtt result"),
        ("# mmt netem path 1\n5,5\n5\n", 3, "at_ns,delay_ns"),
        ("# mmt netem record 1\nup,1\n", 2, "nine fields"),
    ] {
        let error = refused(text);
        assert!(error.reason.contains(reason), "{text}: {error}");
        assert_eq!(error.line, line, "{text}: {error}");
    }
}

#[test]
fn no_text_whatever_panics() {
    let texts = [
        PING,
        IRTT,
        "timestamp,rtt\n1.0,5\n",
        "# mmt netem path 1\n1,2\n",
    ];
    for text in texts {
        for cut in (0..text.len()).filter(|cut| text.is_char_boundary(*cut)) {
            let _ = PathTrace::parse(&text[..cut], DOWN);
            let _ = PathTrace::parse(&text.replace(&text[cut..cut + 1], "9"), None);
        }
    }
}
