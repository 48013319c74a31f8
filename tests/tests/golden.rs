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
use mmt_shared::model::geometry::Face;
use mmt_shared::model::params::ModelState;
use mmt_shared::model::settings::{FrictionLaw, PoseCorrection, Smoothing};
use mmt_shared::model::update::Update;
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
    kind: Kind,
    fields: Value,
    again: Vec<u8>,
}

fn written(encode: impl FnOnce(&mut [u8]) -> Result<usize, EncodeError>) -> Vec<u8> {
    let mut out = [0; STREAM_MESSAGE_MAX];
    let length = encode(&mut out).unwrap();
    out[..length].to_vec()
}

/// The message in these bytes, or the reason of its refusal by the document's name (protocol.md, section 7).
fn decode(bytes: &[u8], channel: &Value, from: Side) -> Result<Decoded, String> {
    if channel == "datagram" {
        let read = Datagram::decode(bytes, from).map_err(|error| reason(&error))?;
        return Ok(of_datagram(&read));
    }
    let (prefix, message) = bytes.split_first_chunk().unwrap();
    let announced = u32::from_le_bytes(*prefix) as usize;
    if announced > STREAM_MESSAGE_MAX {
        return Err("too_long".to_owned());
    }
    let message = message.get(..announced).unwrap();
    let read = StreamMessage::decode(message, from).map_err(|error| reason(&error))?;
    assert_eq!(announced, bytes.len() - 4, "another length than announced");
    let mut decoded = of_stream_message(&read);
    decoded.again.splice(0..0, prefix.iter().copied());
    Ok(decoded)
}

fn reason(error: &DecodeError) -> String {
    let name = match error {
        DecodeError::TooShort { .. } => "too_short",
        DecodeError::TooLong { .. } => "too_long",
        DecodeError::NotOurs => "magic",
        DecodeError::OtherVersion { .. } => "version",
        DecodeError::UnknownType { .. } => "type",
        DecodeError::Flags { .. } => "flags",
        DecodeError::WrongChannel { .. } => "road",
        DecodeError::WrongDirection { .. } => "side",
        DecodeError::Malformed { .. } => "malformed",
        DecodeError::Trailing { .. } => "trailing",
        DecodeError::NotCanonical { .. } => "not_canonical",
        DecodeError::Field { why, .. } => return format!("rule {}", why.field),
    };
    name.to_owned()
}

fn face(face: Face) -> &'static str {
    match face {
        Face::East => "east",
        Face::North => "north",
        Face::West => "west",
        Face::South => "south",
    }
}

fn state(state: &ModelState) -> Value {
    let [m, b, c, inertia, e] = state.params().to_array();
    let (f, p, t) = (state.footprint(), state.pose(), state.twist());
    json!({
        "m": m, "b": b, "c": c, "inertia": inertia, "e": e,
        "east": f.east, "north": f.north, "west": f.west, "south": f.south,
        "x": p.position.x, "y": p.position.y, "angle": p.angle,
        "v_x": t.linear.x, "v_y": t.linear.y, "omega": t.angular,
    })
}

fn of_datagram(read: &Datagram) -> Decoded {
    let of_message = match &read.message {
        Message::Command(command) => {
            let samples = command.samples.as_slice().iter().map(|s| {
                json!({
                    "stamp": s.stamp, "x": s.hip.x, "y": s.hip.y,
                    "force_x": s.force.x, "force_y": s.force.y,
                })
            });
            json!({
                "newest_update": command.newest_update, "samples": samples.collect::<Vec<_>>(),
                "port": command.port.map(|port| json!({ "in_j": port.in_j })),
            })
        }
        Message::Update(raw) => {
            let update = raw.accept(&Coupling::for_stiffness(1000.0)).unwrap();
            assert_eq!(Update::<RawState>::from(&update), *raw);
            json!({
                "sequence": update.sequence, "cause": update.cause.name(),
                "answers": update.answers, "touched_face": update.touched_face.map_or("nothing", face),
                "state": state(&update.state),
            })
        }
        Message::Scene(scene) => {
            let (p, tool, force) = (&scene.object, scene.tool, scene.force);
            json!({
                "answers": scene.answers, "object": [p.position.x, p.position.y, p.angle],
                "tool": [tool.x, tool.y], "force": [force.x, force.y],
            })
        }
        Message::Tool(tool) => json!({
            "answers": tool.answers, "force": { "x": tool.force.x, "y": tool.force.y },
            "in_contact": tool.in_contact, "in_j": tool.in_j,
        }),
        Message::Heartbeat => json!({}),
    };
    let mut fields = serde_json::to_value(read.envelope).unwrap();
    let both = fields.as_object_mut().unwrap();
    both.extend(of_message.as_object().unwrap().clone());
    if read.flags.stopped {
        both.insert("stopped".into(), true.into());
    }
    if read.flags.tool != ToolState::Nominal {
        both.insert("tool_state".into(), read.flags.tool.name().into());
    }
    if read.flags.energy_holds {
        both.insert("energy_holds".into(), true.into());
    }
    Decoded {
        kind: read.message.kind(),
        fields,
        again: written(|out| read.encode(out)),
    }
}

fn of_stream_message(message: &StreamMessage<'_>) -> Decoded {
    let fields = match message {
        StreamMessage::Hello(hello) => {
            assert_eq!(hello.accept(), Ok(*hello));
            let mut fields = json!({
                "token": hello.token.reveal().to_string(), "role": hello.role.name(),
                "stiffness_n_per_m": hello.coupling.stiffness_n_per_m,
                "damping_ns_per_m": hello.coupling.damping_ns_per_m,
                "samples_per_command": hello.samples_per_command,
                "architecture": hello.architecture.name(), "scene_hz": hello.scene_hz,
                "hip": [hello.hip.x, hello.hip.y], "program": hello.program,
                "claim": match hello.claim {
                    Claim::IfFree => "if_free",
                    Claim::Resume(_) => "resume",
                    Claim::TakeOver => "take_over",
                },
            });
            if let Claim::Resume(secret) = hello.claim {
                fields["resume"] = secret.reveal().to_string().into();
            }
            fields
        }
        StreamMessage::Welcome(raw) => of_welcome(raw),
        StreamMessage::Refused(refusal) => {
            let name = match refusal {
                Refusal::Busy => "busy",
                Refusal::WrongToken => "wrong_token",
                Refusal::BadHello => "bad_hello",
                Refusal::Ending => "ending",
                Refusal::WrongRole => "wrong_role",
            };
            json!({ "refusal": name })
        }
        StreamMessage::Farewell(farewell) => {
            let hex: String = farewell.report.iter().map(|b| format!("{b:02x}")).collect();
            json!({ "ending": ending(farewell.ending), "report": hex })
        }
    };
    Decoded {
        kind: message.kind(),
        fields,
        again: written(|out| message.encode(out)),
    }
}

fn of_welcome(raw: &Welcome<RawState>) -> Value {
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
        "tool": [welcome.tool.x, welcome.tool.y],
        "tool_force_max_n": welcome.tool_force_max_n, "resume": welcome.resume.reveal().to_string(),
        "scheme": welcome.scheme, "program": welcome.program,
    });
    let (name, number) = match settings.smoothing {
        Smoothing::PerPacket { lambda } => ("per_packet", ("lambda", lambda)),
        Smoothing::InTime { tau_s } => ("in_time", ("tau_s", tau_s)),
    };
    let map = fields.as_object_mut().unwrap();
    map.insert("smoothing".into(), name.into());
    map.insert(number.0.into(), number.1.into());
    fields
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
            assert_eq!(decoded.kind, kind, "{name}");
            assert_eq!(decoded.fields, vector["fields"], "{} {name}", kind.name());
            assert_eq!(decoded.again, golden, "{} {name}", kind.name());
        }
    }
}

#[test]
fn every_message_that_must_be_refused_is_refused_for_its_reason() {
    let all = golden("must_refuse.json");
    let all = all.as_array().unwrap();
    assert!(all.len() >= 60);
    for vector in all {
        let bytes = bytes(vector["hex"].as_str().unwrap());
        let read = decode(&bytes, &vector["channel"], side(&vector["from"]));
        let reason = read.map(|message| message.fields).unwrap_err();
        let (name, why) = (&vector["name"], &vector["why"]);
        assert_eq!(reason, vector["reason"], "{name}: {why}");
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
