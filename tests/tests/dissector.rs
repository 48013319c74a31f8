//! The dissector for Wireshark (`docs/protocol/mmt.lua`) against the golden vectors, in tshark itself.
//!
//! Needs `tshark`: without, it says so, and with `CI` set it fails.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
#![allow(clippy::disallowed_methods, reason = "reads the golden vectors")]

use std::collections::BTreeMap;

use mmt_shared::wire::{Datagram, Kind, Side, StreamMessage};

use crate::harness::process::did_not_run;
use crate::harness::root;
use crate::harness::tshark::{
    DATAGRAM_PORT, Field, Fields, Packet, SLAVE_PORT, STREAM_PORT, TsharkError, decode_as, dissect,
    tshark, write_capture,
};
use serde_json::Value;

/// Fields that a vector does not name: of the header, the frame, and what its numbers are made of.
const BESIDE: [&str; 6] = [
    "length",
    "magic",
    "version",
    "type",
    "flags",
    "samples.ticks",
];

/// A golden vector.
struct Vector {
    name: String,
    bytes: Vec<u8>,
    from_master: bool,
    on_stream: bool,
    /// What it holds; null if it must be refused.
    fields: Value,
}

impl Vector {
    fn of(vector: &Value, kind: &str, channel: &Value) -> Self {
        let text = |key: &str| vector.get(key).and_then(Value::as_str).unwrap();
        Self {
            name: format!("{kind}/{}", text("name")),
            bytes: bytes(text("hex")),
            from_master: text("from") == "master",
            on_stream: channel == "stream",
            fields: vector.get("fields").cloned().unwrap_or_default(),
        }
    }

    fn packet(&self) -> Packet<'_> {
        let master = if self.on_stream {
            STREAM_PORT
        } else {
            DATAGRAM_PORT
        };
        let (from, to) = if self.from_master {
            (master, SLAVE_PORT)
        } else {
            (SLAVE_PORT, master)
        };
        let payload = &self.bytes;
        Packet { from, to, payload }
    }
}

fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<_> = hex.chars().map(|c| c.to_digit(16).unwrap()).collect();
    let pair = |pair: &[u32]| match pair {
        [high, low] => u8::try_from(high << 4 | low).unwrap(),
        _ => panic!("{hex}"),
    };
    digits.chunks(2).map(pair).collect()
}

fn read(file: &str) -> Value {
    let path = root().join("tests/golden").join(file);
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The vectors of all types.
fn messages() -> Vec<Vector> {
    let of_kind = |kind: Kind| {
        let book = read(&format!("{}.json", kind.name()));
        let vectors = book.get("vectors").and_then(Value::as_array).unwrap();
        let channel = book.get("channel").unwrap();
        let vectors = vectors.iter();
        vectors
            .map(|vector| Vector::of(vector, kind.name(), channel))
            .collect::<Vec<_>>()
    };
    Kind::ALL.into_iter().flat_map(of_kind).collect()
}

fn refusals() -> Vec<Vector> {
    let all = read("must_refuse.json");
    let vector = |vector| Vector::of(vector, "must_refuse", vector.get("channel").unwrap());
    all.as_array().unwrap().iter().map(vector).collect()
}

/// What tshark says of these vectors, in their order; none if there is no tshark here.
fn dissected(test: &str, vectors: &[Vector], options: &[String]) -> Option<Vec<Fields>> {
    let place = tempfile::tempdir().unwrap();
    let capture = place.path().join("vectors.pcap");
    let packets: Vec<_> = vectors.iter().map(Vector::packet).collect();
    write_capture(&capture, &packets).unwrap();
    let found = ran(test, dissect(&capture, options))?;
    assert_eq!(found.len(), vectors.len(), "a packet was lost");
    Some(found)
}

/// Whether each of these is a message to tshark.
fn taken(test: &str, vectors: &[Vector]) -> Option<Vec<bool>> {
    let place = tempfile::tempdir().unwrap();
    let capture = place.path().join("altered.pcap");
    let packets: Vec<_> = vectors.iter().map(Vector::packet).collect();
    write_capture(&capture, &packets).unwrap();
    let mut options = decode_as();
    let columns = "-T fields -e mmt -e mmt.malformed.expert";
    options.extend(columns.split(' ').map(str::to_owned));
    let text = ran(test, tshark(&capture, &options))?;
    let verdict = |line: &str| match line.split_once('\t') {
        Some((shown, said)) if !shown.is_empty() => said.is_empty(),
        _ => panic!("not shown at all: {line}"),
    };
    let verdicts: Vec<_> = text.lines().map(verdict).collect();
    assert_eq!(verdicts.len(), vectors.len(), "a packet was lost");
    Some(verdicts)
}

fn ran<T>(test: &str, result: Result<T, TsharkError>) -> Option<T> {
    match result {
        Ok(found) => Some(found),
        Err(TsharkError::Missing(error)) => {
            did_not_run(test, &format!("tshark does not start: {error}"));
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// The leaves of a vector's fields by the dissector's names; absent ones are not there.
fn leaves<'a>(prefix: &str, value: &'a Value, found: &mut BTreeMap<String, Vec<&'a Value>>) {
    match value {
        Value::Object(keys) => {
            for (key, value) in keys {
                let dot = if prefix.is_empty() { "" } else { "." };
                leaves(&format!("{prefix}{dot}{key}"), value, found);
            }
        }
        Value::Array(values) => values.iter().for_each(|value| leaves(prefix, value, found)),
        Value::Null => {}
        leaf => found.entry(prefix.to_owned()).or_default().push(leaf),
    }
}

/// Whether tshark shows a value: floats to the bit, by their bytes; bytes by their digits.
fn shows(field: &Field, value: &Value) -> bool {
    match value {
        Value::Number(number) if number.is_f64() => {
            let bits = number.as_f64().unwrap().to_le_bytes();
            let digits: String = bits.iter().map(|byte| format!("{byte:02x}")).collect();
            let near = |shown: f64| (shown - number.as_f64().unwrap()).abs() <= 1e-14 * shown.abs();
            field.bytes == digits && field.show.parse().is_ok_and(near)
        }
        Value::Number(number) => field.show == number.to_string(),
        Value::Bool(truth) => field.show == if *truth { "1" } else { "0" },
        Value::String(text) => field.show == *text || field.bytes == *text,
        _ => false,
    }
}

/// What tshark shows that a vector does not hold, or the other way round; empty if nothing.
fn differences(vector: &Vector, found: &Fields) -> Vec<String> {
    let mut expected = BTreeMap::new();
    leaves("", &vector.fields, &mut expected);
    // there is nothing to show of no bytes
    expected.retain(|name, values| name != "report" || values != &[""]);
    let mut all = Vec::new();
    for (name, values) in &expected {
        let fields = found.get(name).map_or(&[][..], Vec::as_slice);
        let same = fields.len() == values.len()
            && fields
                .iter()
                .zip(values)
                .all(|(field, value)| shows(field, value));
        if !same {
            all.push(format!("{name}: {fields:?} instead of {values:?}"));
        }
    }
    let more = found.keys().filter(|name| !BESIDE.contains(&name.as_str()));
    let more = more.filter(|name| !expected.contains_key(*name));
    all.extend(more.map(|name| format!("{name} is not in the vector")));
    let kind = vector.name.split('/').next().unwrap();
    if found
        .get("type")
        .and_then(|all| all.first())
        .is_none_or(|field| field.show != kind)
    {
        all.push(format!("type: {:?}", found.get("type")));
    }
    all
}

#[test]
fn every_field_of_every_vector_is_shown_and_nothing_else() {
    let vectors = messages();
    assert!(vectors.len() >= 35, "{}", vectors.len());
    let test = "the dissector on the golden vectors";
    let Some(found) = dissected(test, &vectors, &decode_as()) else {
        return;
    };
    for (vector, found) in vectors.iter().zip(&found) {
        let none: [String; 0] = [];
        assert_eq!(differences(vector, found), none, "{}", vector.name);
    }
}

#[test]
fn every_vector_that_must_be_refused_is_shown_as_no_message() {
    let vectors = refusals();
    assert!(vectors.len() >= 60, "{}", vectors.len());
    let test = "the dissector on what must be refused";
    let Some(found) = dissected(test, &vectors, &decode_as()) else {
        return;
    };
    for (vector, found) in vectors.iter().zip(&found) {
        // Wireshark asks nobody about a datagram without bytes
        let expected = usize::from(!vector.bytes.is_empty());
        for name in ["malformed", "malformed.expert"] {
            let said = found.get(name).map_or(0, Vec::len);
            assert_eq!(said, expected, "{}: {name}: {found:?}", vector.name);
        }
    }
}

/// Whether mmt itself takes these bytes for a message.
fn is_message(vector: &Vector) -> bool {
    let from = if vector.from_master {
        Side::Master
    } else {
        Side::Slave
    };
    if !vector.on_stream {
        return Datagram::decode(&vector.bytes, from).is_ok();
    }
    let Some((prefix, message)) = vector.bytes.split_first_chunk() else {
        return false;
    };
    let announced = u32::from_le_bytes(*prefix);
    usize::try_from(announced) == Ok(message.len()) && StreamMessage::decode(message, from).is_ok()
}

/// A vector cut short at every byte, and with every byte altered in four ways.
fn altered(vector: &Vector) -> Vec<Vector> {
    let with = |bytes| Vector {
        name: vector.name.clone(),
        bytes,
        fields: Value::Null,
        ..*vector
    };
    let cuts = (1..vector.bytes.len()).filter_map(|end| vector.bytes.get(..end));
    let mut all: Vec<_> = cuts.map(|cut| with(cut.to_vec())).collect();
    for (at, byte) in vector.bytes.iter().enumerate() {
        for other in [0, 0xff, byte ^ 0x01, byte ^ 0x80] {
            let mut bytes = vector.bytes.clone();
            *bytes.get_mut(at).unwrap() = other;
            all.push(with(bytes));
        }
    }
    all
}

#[test]
fn altered_vectors_are_messages_to_tshark_exactly_if_they_are_to_us() {
    let vectors: Vec<_> = messages().iter().flat_map(altered).collect();
    let test = "the dissector on altered vectors";
    let Some(found) = taken(test, &vectors) else {
        return;
    };
    let ours: Vec<_> = vectors.iter().map(is_message).collect();
    for ((vector, ours), theirs) in vectors.iter().zip(&ours).zip(&found) {
        assert_eq!(theirs, ours, "{}: {:02x?}", vector.name, vector.bytes);
    }
    let good = ours.iter().filter(|good| **good).count();
    assert!(
        good > 1000 && vectors.len() - good > 1000,
        "{good} of {}",
        vectors.len()
    );
}

#[test]
fn a_bare_datagram_is_known_by_its_magic() {
    let mut vectors = messages();
    vectors.retain(|vector| !vector.on_stream);
    let test = "the dissector without being told the port";
    let Some(found) = dissected(test, &vectors, &[]) else {
        return;
    };
    for (vector, found) in vectors.iter().zip(&found) {
        assert!(found.contains_key("type"), "{}", vector.name);
    }
}

#[test]
fn a_vector_with_another_value_is_distinguished_from_what_is_shown() {
    let mut vectors = messages();
    vectors.retain(|vector| vector.name == "update/deadband");
    let test = "the dissector on an altered vector";
    let Some(found) = dissected(test, &vectors, &decode_as()) else {
        return;
    };
    let (vector, found) = (vectors.first_mut().unwrap(), found.first().unwrap());
    for (path, value) in [
        ("/state/omega", Value::from(-0.5000000000000001)),
        ("/sequence", Value::from(2)),
        ("/cause", Value::from("timer")),
        ("/touched_face", Value::from("nothing")),
        ("/echo", Value::Null),
    ] {
        let place = vector.fields.pointer_mut(path).unwrap();
        let before = std::mem::replace(place, value);
        assert_ne!(differences(vector, found).len(), 0, "{path}");
        *vector.fields.pointer_mut(path).unwrap() = before;
    }
    assert_eq!(differences(vector, found).len(), 0);
}
