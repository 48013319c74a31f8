//! That the tables of `docs/plugs.md` say where each number of a packet is: they are read, and with them the packets. And that
//! the examples of `contrib` refuse an address that is none.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "a test may panic"
)]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "reads the document, starts the examples"
)]

use std::net::SocketAddr;
use std::process::Command;
use std::time::Duration;

use mmt_client::device::link::{DeviceLink, DeviceLinkConfig, HandOutput};
use mmt_server::plant::{PlantAnswer, PlantCommand};
use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::plug::{DEVICE_BYTES, PlugHead, PlugKind, PlugToken, encode};
use mmt_shared::time::Time;

use crate::harness::process::Running;
use crate::harness::python::python;
use crate::harness::root;

const TOKEN: PlugToken = PlugToken::new([0xc3; 16]);
const HEAD: PlugHead = PlugHead {
    flags: 0,
    sequence: 0x0102_0304,
    answers: 5,
    stamp_ns: 6_000_000_007,
};

/// A field as the document has it: its first byte, one past its last, and its type.
struct Field {
    begin: usize,
    end: usize,
    of: String,
}

/// The text below a heading that begins so, up to the next heading.
fn section(heading: &str) -> String {
    let text = std::fs::read_to_string(root().join("docs/plugs.md")).unwrap();
    let found = text
        .split("\n#")
        .find(|part| part.contains(heading) && part.find(heading) < part.find('\n'));
    found
        .unwrap_or_else(|| panic!("no section {heading}"))
        .to_owned()
}

/// Its fields, whatever stands in the other columns.
fn fields(section: &str) -> Vec<Field> {
    let rows = section.lines().filter(|line| line.starts_with("| "));
    let fields = rows.filter_map(|row| {
        let mut cells = row.split('|').map(str::trim).skip(1);
        let (bytes, of) = (cells.next()?, cells.next()?.to_owned());
        let (first, last) = bytes.split_once('–').unwrap_or((bytes, bytes));
        let (begin, last): (usize, usize) = (first.parse().ok()?, last.parse().ok()?);
        Some(Field {
            begin,
            end: last + 1,
            of,
        })
    });
    fields.collect()
}

/// The numbers of a packet from byte 40 on, as the document has them: without a gap, to the end.
fn numbers(fields: &[Field], packet: &[u8]) -> Vec<f64> {
    let mut at = 40;
    let mut numbers = Vec::new();
    for field in fields.iter().filter(|field| field.begin >= 40) {
        assert_eq!(field.begin, at, "a gap or an overlap");
        let (of, count) = field.of.split_once(" × ").unwrap_or((&field.of, "1"));
        let size = if of == "f32" { 4 } else { 8 };
        assert_eq!(
            field.end - field.begin,
            size * count.parse::<usize>().unwrap()
        );
        for bytes in packet[field.begin..field.end].chunks(size) {
            numbers.push(match of {
                "f32" => f32::from_le_bytes(bytes.try_into().unwrap()).into(),
                "f64" => f64::from_le_bytes(bytes.try_into().unwrap()),
                other => panic!("{other}"),
            });
        }
        at = field.end;
    }
    assert_eq!(at, packet.len(), "every byte is described");
    numbers
}

/// Holds a packet against its heading and the head's table; returns its flags and numbers.
fn held(heading: &str, head: &PlugHead, packet: &[u8]) -> (u16, Vec<f64>) {
    let section = section(heading);
    let title = section.lines().next().unwrap();
    let (_, about) = title.split_once("kind ").unwrap();
    let expected = format!("{}, {} bytes", packet[5], packet.len());
    assert_eq!(about, expected, "{title}");
    let common = fields(&self::section(" Packets"));
    let field = |begin: usize| {
        let field = common.iter().find(|field| field.begin == begin);
        &packet[begin..field.unwrap().end]
    };
    assert_eq!(field(0), b"MMTL");
    assert_eq!(field(4), [1]);
    assert_eq!(field(8), head.sequence.to_le_bytes());
    assert_eq!(field(12), head.answers.to_le_bytes());
    assert_eq!(field(16), head.stamp_ns.to_le_bytes());
    assert_eq!(field(24), [0xc3; 16]);
    let flags = u16::from_le_bytes(field(6).try_into().unwrap());
    (flags, numbers(&fields(&section), packet))
}

#[test]
fn the_document_states_where_each_number_of_a_reading_and_of_a_force_is() {
    let own = [0.5_f32, 1.5, 2.5, 3.5, 4.5, 5.5];
    let head = PlugHead { flags: 1, ..HEAD };
    let bytes = own.map(f32::to_le_bytes);
    let reading: [u8; DEVICE_BYTES] = encode(PlugKind::Reading, &TOKEN, &head, bytes);
    let (flags, numbers) = held(" Reading", &head, &reading);
    assert_eq!((flags, numbers), (1, own.map(f64::from).to_vec()));
    let config = DeviceLinkConfig {
        workspace_m: 10.0,
        ..DeviceLinkConfig::default()
    };
    let mut link = DeviceLink::try_new(config, TOKEN).unwrap();
    let device = SocketAddr::from(([127, 0, 0, 1], 1));
    // the button is up, then down
    for n in 0..2 {
        let head = PlugHead {
            flags: n as u16,
            sequence: HEAD.sequence - 1 + n,
            stamp_ns: u64::from(n),
            ..HEAD
        };
        let up: [u8; DEVICE_BYTES] = encode(PlugKind::Reading, &TOKEN, &head, bytes);
        assert!(link.handle(Time::ZERO, device, &up, |_| ()));
    }
    let output = HandOutput {
        tick: 1,
        force: Vec2::new(1.25, -2.5),
        hip: Vec2::new(0.75, 0.125),
        engaged: true,
        in_contact: true,
        stopped: false,
        link_late: true,
    };
    let force = link.answer(Time::from_nanos(8), &output);
    let head = PlugHead {
        flags: 0,
        sequence: 1,
        answers: HEAD.sequence,
        stamp_ns: 8,
    };
    let (flags, numbers) = held(" Force", &head, &force);
    assert_eq!(flags, 1 + 2 + 4 + 16);
    assert_eq!(numbers, [1.25, -2.5, 0.0, 0.75, 0.125, 0.0]);
}

#[test]
fn the_document_states_where_each_number_of_a_command_and_of_an_answer_is() {
    let command = PlantCommand {
        tool: Vec2::new(0.1, 0.2),
        velocity: Vec2::new(0.3, 0.4),
        stiffness_n_per_m: 500.0,
        damping_ns_per_m: 7.0,
        force_max_n: 15.0,
        begins: false,
        held: true,
    };
    let (flags, numbers) = held(" Tool", &HEAD, &command.packet(&TOKEN, &HEAD));
    assert_eq!(flags, 1 + 4);
    assert_eq!(
        numbers,
        [0.1, 0.2, 0.3, 0.4, 500.0, 7.0, 15.0, 0.0, 0.0, 0.0]
    );
    let answer = PlantAnswer {
        tool: Vec2::new(1.0, 2.0),
        velocity: Vec2::new(3.0, 4.0),
        force: Vec2::new(5.0, 6.0),
        object: Some(Pose::new(0.7, 0.8, 0.9)),
        image_age_s: 0.25,
        anew: false,
    };
    let (flags, numbers) = held(" Answer", &HEAD, &answer.packet(&TOKEN, &HEAD));
    assert_eq!(flags, 1);
    assert_eq!(numbers, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.7, 0.8, 0.9, 0.25]);
}

#[test]
fn an_address_that_is_none_of_a_plug_is_refused_in_a_sentence() {
    let Some(python) = python("a wrong address at a plug's example", "socket") else {
        return;
    };
    let token = "c3".repeat(16);
    let wrong = [
        String::new(),
        "garbage".to_owned(),
        "udp://127.0.0.1:9?token=no hexadecimal".to_owned(),
        format!("udp://127.0.0.1:9?token={}", &token[2..]),
        format!("udp://127.0.0.1:99999?token={token}"),
        format!("udp://127.0.0.1?token={token}"),
    ];
    for program in ["hand.py", "plant.py"] {
        for address in &wrong {
            let mut command = Command::new(&python);
            command.arg(root().join("contrib").join(program));
            let running = Running::start_reading(command, &format!("{address}\n")).unwrap();
            let ended = running.end(Duration::from_secs(60)).unwrap();
            assert_eq!(ended.status.code(), Some(2), "{address}: {}", ended.err);
            assert_eq!(ended.err.trim().lines().count(), 1, "{}", ended.err);
            assert!(
                ended.err.contains("udp://HOST:PORT?token="),
                "{}",
                ended.err
            );
            assert!(
                ended.out.is_empty() && !ended.err.contains(&token),
                "{}",
                ended.err
            );
        }
    }
}
