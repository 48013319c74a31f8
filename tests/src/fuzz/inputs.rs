//! Inputs to begin with: valid ones of every kind, and the words that they are made of.
//!
//! Messages of the wire are the golden vectors, valid ones and those that must be refused. What is binary is made by the code that
//! writes it; texts stand here.

use std::time::Duration;

use mmt_client::device::two_diy::ANSWER_BYTES;
use mmt_netem::capture::{Event, Sides, Writer};
use mmt_server::plant::PlantAnswer;
use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::plug::{DEVICE_BYTES, PlugHead, PlugKind, encode};
use serde_json::Value;

use super::plug::TOKEN;

mod packets;
mod recorded;
mod texts;
mod words;

pub(super) use packets::packet_records;
use packets::{entries, heading};
pub(super) use recorded::{TOPICS, messages, messages_of, recorded_sessions, records};
pub(super) use texts::*;
pub(super) use words::*;

/// The golden vectors by the road that they travel, those that must be refused among them.
const GOLDEN: [&str; 10] = [
    include_str!("../../golden/command.json"),
    include_str!("../../golden/farewell.json"),
    include_str!("../../golden/heartbeat.json"),
    include_str!("../../golden/hello.json"),
    include_str!("../../golden/must_refuse.json"),
    include_str!("../../golden/refused.json"),
    include_str!("../../golden/scene.json"),
    include_str!("../../golden/tool.json"),
    include_str!("../../golden/update.json"),
    include_str!("../../golden/welcome.json"),
];

fn golden(channel: &str) -> Vec<Vec<u8>> {
    let mut found = Vec::new();
    for text in GOLDEN {
        let file: Value = serde_json::from_str(text).unwrap();
        let vectors = file.get("vectors").unwrap_or(&file).as_array().unwrap();
        for vector in vectors {
            let road = vector.get("channel").or(file.get("channel")).unwrap();
            if road == channel {
                found.push(bytes(vector["hex"].as_str().unwrap()));
            }
        }
    }
    found
}

fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> = hex
        .chars()
        .filter_map(|c| c.to_digit(16))
        .map(|digit| digit as u8)
        .collect();
    digits
        .chunks(2)
        .map(|pair| pair[0] << 4 | pair[1])
        .collect()
}

pub(super) fn datagrams() -> Vec<Vec<u8>> {
    golden("datagram")
}

/// Without the length in front.
pub(super) fn stream_messages() -> Vec<Vec<u8>> {
    let framed = golden("stream").into_iter();
    framed
        .map(|bytes| bytes.get(4..).unwrap_or_default().to_vec())
        .collect()
}

pub(super) fn reports() -> Vec<Vec<u8>> {
    use mmt_shared::report::{MasterHalf, SlaveHalf, named};
    // a name of ours, and one that a peer makes up
    let counts = || Some(named([("timer", 3), ("x\u{1b}[2J\n  sent  9\u{202e}", 1)]));
    let mut master = MasterHalf::default();
    master.updates.dropped = counts();
    master.session.architecture.name = Some("tdpa\u{1b}[1m".to_owned());
    master.session.architecture.round_trip_ms = 15.0.into();
    master
        .session
        .drops
        .insert("datagrams_malformed".to_owned(), 3);
    master.session.outgoing.expected = 1000;
    let mut slave = SlaveHalf::default();
    slave.updates.by_cause = counts();
    slave.updates.repeated_by_cause = counts();
    vec![
        serde_json::to_vec(&master).unwrap(),
        serde_json::to_vec(&slave).unwrap(),
        serde_json::to_vec(&SlaveHalf::default()).unwrap(),
        b"{}".to_vec(),
    ]
}

fn device_packet(sequence: u32, flags: u16, place: [f32; 3]) -> Vec<u8> {
    let head = PlugHead {
        flags,
        sequence,
        answers: 0,
        stamp_ns: u64::from(sequence) * 1_000_000,
    };
    let numbers = place.into_iter().chain([0.0; 3]).map(f32::to_le_bytes);
    let packet: [u8; DEVICE_BYTES] = encode(PlugKind::Reading, &TOKEN, &head, numbers);
    packet.to_vec()
}

/// Hands that press, move, let go and go away.
pub(super) fn device_packets() -> Vec<Vec<u8>> {
    let run = |packets: &[(u8, u8, u16, f32)]| {
        let mut bytes = Vec::new();
        for (sequence, (wait, from, flags, x)) in (1..).zip(packets) {
            bytes.extend([*wait, *from]);
            bytes.extend(device_packet(sequence, *flags, [*x, 0.01, 0.0]));
        }
        bytes
    };
    vec![
        run(&[
            (1, 0, 0, 0.0),
            (1, 0, 1, 0.0),
            (1, 0, 1, 0.001),
            (1, 0, 1, 0.002),
            (1, 0, 0, 0.002),
        ]),
        run(&[
            (1, 0, 0, 0.0),
            (1, 0, 1, 0.0),
            (1, 1, 1, 0.001),
            (60, 1, 0, 0.002),
            (1, 1, 1, 0.002),
        ]),
        run(&[(1, 0, 0, 0.0), (1, 0, 1, 0.4), (1, 0, 1, 0.9)]),
        run(&[(1, 0, 0, 0.0)]),
    ]
}

pub(super) fn plant_packets() -> Vec<Vec<u8>> {
    let answer = PlantAnswer {
        tool: Vec2::new(0.1, -0.2),
        velocity: Vec2::new(0.3, 0.0),
        force: Vec2::new(5.0, 1.0),
        object: Some(Pose::new(0.4, 0.0, 0.1)),
        image_age_s: 0.03,
        anew: false,
    };
    let head = PlugHead {
        sequence: 7,
        stamp_ns: 9_000_000,
        ..PlugHead::default()
    };
    let blind = PlantAnswer {
        object: None,
        image_age_s: 0.0,
        ..answer
    };
    [answer, blind]
        .map(|answer| answer.packet(&TOKEN, &head).to_vec())
        .to_vec()
}

/// A hand that rests at the middle for a second, and goes on; several answers at once.
pub(super) fn two_diy() -> Vec<Vec<u8>> {
    let answer = |degrees: [f32; 2]| {
        let numbers = degrees.map(f32::to_le_bytes);
        let mut bytes = vec![5];
        bytes.extend(numbers.as_flattened());
        assert_eq!(bytes.len(), ANSWER_BYTES);
        bytes
    };
    let run = |answers: &[(u8, &[[f32; 2]])]| {
        let mut bytes = Vec::new();
        for (wait, at_once) in answers {
            let answers: Vec<u8> = at_once
                .iter()
                .flat_map(|degrees| answer(*degrees))
                .collect();
            bytes.extend([*wait, answers.len() as u8]);
            bytes.extend(answers);
        }
        bytes
    };
    let mid = [20.0, 150.0];
    let rest: Vec<(u8, &[[f32; 2]])> = (0..60).map(|_| (3, std::slice::from_ref(&mid))).collect();
    let moves: &[[f32; 2]] = &[[20.1, 150.0], [20.2, 150.1]];
    let mut held = rest.clone();
    held.extend([(1, moves), (1, &moves[..1]), (200, &moves[..1])]);
    vec![
        run(&held),
        run(&rest[..3]),
        run(&[(1, &[[83.18, 96.82]]), (1, &[[1e9, 0.0]])]),
    ]
}

/// A pcapng of our own writer, a pcap of two packets, and two of either behind each other.
pub(super) fn captures() -> Vec<Vec<u8>> {
    let address = |host: u8| ([10, 0, 0, host], 4433).into();
    let writer = Writer::new(Duration::from_secs(1_700_000_000));
    let mut ours = Writer::heading(&heading());
    for entry in entries().into_iter().take(5) {
        let event = Event {
            entry,
            corrupted_bit: None,
            marked: false,
            sides: Some(Sides {
                came: [address(1), address(2)],
                leaves: [address(2), address(3)],
                class: 2,
            }),
            contents: entry.number.to_le_bytes().to_vec(),
        };
        writer
            .blocks(event)
            .iter()
            .for_each(|block| ours.extend(block.bytes()));
    }
    // IPv4 and UDP by hand: 8 bytes of payload
    let frame = |number: u8, from: u8, to: u8| {
        let mut frame = vec![
            0x45, 0, 0, 36, 0, 0, 0x40, 0, 64, 17, 0, 0, 10, 0, 0, from, 10, 0, 0, to,
        ];
        frame.extend([0x11, 0x51, 0x11, 0x51, 0, 16, 0, 0]);
        frame.extend([number, 1, 2, 3, 4, 5, 6, 7]);
        frame
    };
    let pcap = |later_us: u32| {
        let mut file = 0xa1b2_c3d4_u32.to_le_bytes().to_vec();
        file.extend([
            2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0, 0, 101, 0, 0, 0,
        ]);
        for (number, (from, to)) in (0_u8..).zip([(1, 2), (1, 2), (2, 1), (1, 2), (2, 1)]) {
            let late = if from == 1 { later_us } else { 0 };
            let at = 1000 * u32::from(number) + late;
            for word in [1_700_000_000, at, 36, 36] {
                file.extend(word.to_le_bytes());
            }
            file.extend(frame(number, from, to));
        }
        file
    };
    let both = |first: &[u8], second: &[u8]| {
        let length = (first.len() as u16).to_le_bytes();
        [first, second, &length].concat()
    };
    vec![
        both(&ours, &[]),
        both(&pcap(0), &pcap(5000)),
        both(&pcap(0), &[]),
        both(&ours, &ours),
    ]
}
