//! The golden vectors: bytes and fields agree, for our reader and writer, for the bytes derived by hand
//! in `docs/protocol.md`, and for a decoder in another language.
#![allow(
    clippy::disallowed_methods,
    clippy::indexing_slicing,
    clippy::unwrap_used,
    reason = "a test of files: it opens them and starts python, and all that is missing must fail it"
)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command as Process;

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::params::ModelState;
use mmt_shared::model::settings::{FrictionLaw, PoseCorrection, Smoothing};
use mmt_shared::wire::*;
use serde_json::{Value, json};

fn root() -> PathBuf {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    tests.parent().unwrap().to_owned()
}

fn golden(name: &str) -> Value {
    let path = root().join("tests/golden").join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn bytes(hex: &str) -> Vec<u8> {
    assert!(hex.len().is_multiple_of(2), "{hex}");
    let digits = hex.as_bytes().chunks(2);
    let byte = |pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.map(byte).collect()
}

fn side(name: &Value) -> Side {
    let sides = [Side::Master, Side::Slave];
    let found = sides.into_iter().find(|side| side.name() == name);
    found.unwrap()
}

/// A decoded message: its type, its fields by the document's names, and its bytes written again.
struct Decoded {
    kind: &'static str,
    fields: Value,
    again: Vec<u8>,
}

fn written(encode: impl FnOnce(&mut [u8]) -> Result<usize, EncodeError>) -> Vec<u8> {
    let mut out = [0; STREAM_MESSAGE_MAX];
    let length = encode(&mut out).unwrap();
    out[..length].to_vec()
}

fn decode(bytes: &[u8], channel: &Value, from: Side) -> Result<Decoded, String> {
    if channel == "datagram" {
        let read = decode_datagram(bytes, from).map_err(|e| e.to_string())?;
        return Ok(of_datagram(&read));
    }
    let (prefix, message) = bytes.split_first_chunk().unwrap();
    let announced = u32::from_le_bytes(*prefix) as usize;
    if announced != message.len() {
        return Err("another length than announced".to_owned());
    }
    let read = decode_stream_message(message, from).map_err(|e| e.to_string())?;
    let mut decoded = of_stream_message(&read);
    decoded.again.splice(0..0, prefix.iter().copied());
    Ok(decoded)
}

fn state(state: &ModelState) -> Value {
    let [m, b, c, inertia, e] = state.params.to_array();
    let (f, p, t) = (&state.footprint, &state.pose, &state.twist);
    json!({
        "m": m, "b": b, "c": c, "inertia": inertia, "e": e,
        "east": f.east, "north": f.north, "west": f.west, "south": f.south,
        "x": p.position.x, "y": p.position.y, "angle": p.angle,
        "v_x": t.linear.x, "v_y": t.linear.y, "omega": t.angular,
    })
}

fn of_datagram(read: &Datagram) -> Decoded {
    let envelope = &read.envelope;
    let (kind, matter, again) = match &read.matter {
        Matter::Command(command) => {
            let samples = command.samples.as_slice().iter().map(|s| {
                json!({
                    "stamp": s.stamp, "x": s.hip.x, "y": s.hip.y,
                    "force_x": s.force.x, "force_y": s.force.y,
                })
            });
            let samples: Vec<_> = samples.collect();
            let mut fields = json!({ "newest_update": command.newest_update, "samples": samples });
            if let Some(port) = command.port {
                fields["in_j"] = port.in_j.into();
                fields["wants_force"] = port.wants_force.into();
                fields["passive_tool"] = port.passive_tool.into();
            }
            (
                command.port.map_or(Kind::Command, |_| Kind::CoupledCommand),
                fields,
                written(|out| encode_command(envelope, command, out)),
            )
        }
        Matter::Update(raw) => {
            let update = raw.accept(&Coupling::for_stiffness(1000.0)).unwrap();
            assert_eq!(update.sequence, raw.sequence());
            (
                Kind::Update,
                json!({
                    "sequence": update.sequence, "cause": update.cause.name(),
                    "answers": update.answers, "newest_command": update.newest_command,
                    "slave_in_contact": update.slave_in_contact, "state": state(&update.state),
                }),
                written(|out| encode_update(envelope, &update, out)),
            )
        }
        Matter::Scene(scene) => {
            let (p, tool, force) = (&scene.object, scene.tool, scene.force);
            (
                Kind::Scene,
                json!({
                    "answers": scene.answers,
                    "object": [p.position.x, p.position.y, p.angle],
                    "tool": [tool.x, tool.y], "force": [force.x, force.y],
                }),
                written(|out| encode_scene(envelope, scene, out)),
            )
        }
        Matter::Tool(tool) => (
            Kind::Tool,
            json!({
                "answers": tool.answers,
                "force": tool.force.map(|force| json!({ "x": force.x, "y": force.y })),
                "in_contact": tool.in_contact, "in_j": tool.in_j, "model_error": tool.model_error,
            }),
            written(|out| encode_tool(envelope, tool, out)),
        ),
        Matter::Heartbeat => (
            Kind::Heartbeat,
            json!({}),
            written(|out| encode_heartbeat(envelope, out)),
        ),
    };
    let mut fields = serde_json::to_value(envelope).unwrap();
    let both = fields.as_object_mut().unwrap();
    both.extend(matter.as_object().unwrap().clone());
    let kind = kind.name();
    Decoded {
        kind,
        fields,
        again,
    }
}

fn of_stream_message(message: &StreamMessage) -> Decoded {
    let (fields, again) = match message {
        StreamMessage::Hello(raw) => {
            let hello = raw.accept().unwrap();
            let Role::Operator = hello.role;
            let fields = json!({
                "token": hello.token.reveal().to_string(), "role": "operator",
                "stiffness_n_per_m": hello.coupling.stiffness_n_per_m,
                "damping_ns_per_m": hello.coupling.damping_ns_per_m,
                "samples_per_command": hello.samples_per_command,
                "architecture": hello.architecture.name(), "scene_hz": hello.scene_hz,
                "hip": [hello.hip.x, hello.hip.y], "program": hello.program,
            });
            (fields, written(|out| encode_hello(&hello, out)))
        }
        StreamMessage::Welcome(raw) => of_welcome(raw),
        StreamMessage::Refused(refusal) => {
            let name = match refusal {
                Refusal::Busy => "busy",
                Refusal::WrongToken => "wrong_token",
                Refusal::BadHello => "bad_hello",
                Refusal::Ending => "ending",
            };
            let again = written(|out| encode_refused(*refusal, out));
            (json!({ "refusal": name }), again)
        }
        StreamMessage::MasterFarewell(farewell) => (
            json!({ "ending": ending(farewell.ending), "totals": farewell.totals }),
            written(|out| encode_master_farewell(farewell, out)),
        ),
        StreamMessage::SlaveFarewell(farewell) => (
            json!({ "ending": ending(farewell.ending), "totals": farewell.totals }),
            written(|out| encode_slave_farewell(farewell, out)),
        ),
    };
    let kind = message.kind().name();
    Decoded {
        kind,
        fields,
        again,
    }
}

fn of_welcome(raw: &RawWelcome) -> (Value, Vec<u8>) {
    // the vectors' two hellos asked for one of these
    let asked = [1000.0, 3000.0].map(Coupling::for_stiffness);
    let accepted = asked.iter().find_map(|asked| raw.accept(asked).ok());
    let welcome = accepted.unwrap();
    let settings = &welcome.settings;
    let mut fields = json!({
        "stiffness_n_per_m": settings.coupling.stiffness_n_per_m,
        "damping_ns_per_m": settings.coupling.damping_ns_per_m,
        "friction": match settings.friction {
            FrictionLaw::Sign => "sign",
            FrictionLaw::LimitSurface => "limit_surface",
        },
        "correction": match settings.correction {
            PoseCorrection::Snap => "snap",
            PoseCorrection::MatchedStamps => "matched_stamps",
            PoseCorrection::Replay => "replay",
        },
        "state": state(&welcome.state),
        "scheme": welcome.scheme, "program": welcome.program,
    });
    let (name, number) = match settings.smoothing {
        Smoothing::PerPacket { lambda } => ("per_packet", ("lambda", lambda)),
        Smoothing::InTime { tau_s } => ("in_time", ("tau_s", tau_s)),
    };
    let map = fields.as_object_mut().unwrap();
    map.insert("smoothing".into(), name.into());
    map.insert(number.0.into(), number.1.into());
    (fields, written(|out| encode_welcome(&welcome, out)))
}

fn ending(ending: Ending) -> &'static str {
    match ending {
        Ending::Finished => "finished",
        Ending::Interrupted => "interrupted",
        Ending::Failed => "failed",
    }
}

/// Every vector's name, `type/name`, and its bytes.
fn vectors() -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for kind in Kind::ALL {
        let book = golden(&format!("{}.json", kind.name()));
        for vector in book["vectors"].as_array().unwrap() {
            let name = format!("{}/{}", kind.name(), vector["name"].as_str().unwrap());
            all.insert(name, bytes(vector["hex"].as_str().unwrap()));
        }
    }
    all
}

#[test]
fn every_vector_decodes_to_its_fields_and_encodes_to_its_bytes() {
    for kind in Kind::ALL {
        let book = golden(&format!("{}.json", kind.name()));
        assert_eq!(book["type"], kind.name());
        let vectors = book["vectors"].as_array().unwrap();
        assert!(!vectors.is_empty());
        for vector in vectors {
            let (name, from) = (&vector["name"], side(&vector["from"]));
            let golden = bytes(vector["hex"].as_str().unwrap());
            let decoded = decode(&golden, &book["channel"], from).unwrap();
            assert_eq!(decoded.kind, kind.name(), "{name}");
            assert_eq!(decoded.fields, vector["fields"], "{} {name}", kind.name());
            assert_eq!(decoded.again, golden, "{} {name}", kind.name());
        }
    }
}

#[test]
fn every_message_that_must_be_refused_is() {
    let all = golden("must_refuse.json");
    let all = all.as_array().unwrap();
    assert!(all.len() >= 60);
    for vector in all {
        let bytes = bytes(vector["hex"].as_str().unwrap());
        let read = decode(&bytes, &vector["channel"], side(&vector["from"]));
        assert!(read.is_err(), "{}: {}", vector["name"], vector["why"]);
    }
}

/// The document's blocks ```` ```bytes TYPE/NAME ````: hexadecimal bytes, a bar, what they mean.
#[test]
fn the_bytes_derived_by_hand_in_the_document_are_the_vectors() {
    let text = std::fs::read_to_string(root().join("docs/protocol.md")).unwrap();
    let vectors = vectors();
    let mut derived = BTreeMap::new();
    for block in text.split("```bytes ").skip(1) {
        let (name, rest) = block.split_once('\n').unwrap();
        let (body, _) = rest.split_once("```").unwrap();
        let columns = body.lines().map(|line| line.split('|').next().unwrap());
        let hex: String = columns.collect::<String>().split_whitespace().collect();
        assert_eq!(Some(&bytes(&hex)), vectors.get(name), "{name}");
        derived.insert(name.split('/').next().unwrap(), name);
    }
    for kind in Kind::ALL {
        assert!(derived.contains_key(kind.name()), "no {}", kind.name());
    }
}

#[test]
fn a_decoder_in_another_language_reads_the_same() {
    let script = root().join("tests/golden/decode.py");
    match Process::new("python3").arg(&script).output() {
        Ok(output) => {
            let text = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{text}");
            let text = String::from_utf8_lossy(&output.stdout);
            let decoded = format!("{} messages decoded", vectors().len());
            assert!(text.starts_with(&decoded), "{text}");
        }
        Err(error) => {
            let ci = std::env::var_os("CI").is_some();
            assert!(!ci, "python3 does not start ({error}): CI must have it");
            eprintln!(
                "NOT RUN: python3 does not start ({error}); the vectors were not decoded by it"
            );
        }
    }
}
