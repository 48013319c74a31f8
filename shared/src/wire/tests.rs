//! Promises of the whole format: what is written reads back, and nothing else reads.

mod accepted;
mod generated;
mod sizes;

use crate::fixtures::COUPLING;
use crate::model::architecture::Architecture;
use proptest::prelude::*;

use super::*;
use crate::model::contact::Coupling;
use crate::model::geometry::{BoxFootprint, Face, Pose, Twist, Vec2};
use crate::model::params::{ModelParams, ModelState, ParamsError};
use crate::model::sample::{ForceCounts, HipCounts, HipSample};
use crate::model::settings::{FrictionLaw, Mode, ModelSettings, PoseCorrection, Smoothing};
use crate::model::tool::{HandPort, Scene, TOOL_FORCE_MAX_N, Tool};
use crate::model::update::{Cause, Update};
use crate::pairing::Token;
use crate::time::Time;

const ENVELOPE: Envelope = Envelope {
    number: 1,
    sent: Time::ZERO,
    echo: None,
};

fn state() -> ModelState {
    ModelState::try_new(
        ModelParams::of_square(0.7, 3.0, 2.06, 0.36, &COUPLING).unwrap(),
        BoxFootprint::square(0.36),
        Pose::new(0.1, -0.2, 0.3),
        Twist::new(0.15, 0.0, -0.5),
        &COUPLING,
    )
    .unwrap()
}

fn update() -> Update {
    Update {
        sequence: 1,
        cause: Cause::Deadband,
        answers: Time::ZERO,
        touched_face: None,
        state: state(),
    }
}

fn scene() -> Scene {
    Scene {
        answers: Time::from_millis(12),
        object: Pose::new(0.1, -0.2, 0.3),
        tool: Vec2::new(-0.1, 0.0),
        force: Vec2::new(2.0, -0.5),
    }
}

fn hello() -> Hello {
    Hello {
        token: Token::new([7; 32]),
        role: Role::Operator,
        claim: Claim::Resume(Token::new([9; 32])),
        coupling: COUPLING,
        samples_per_command: 10,
        architecture: Architecture::Tdpa,
        scene_hz: 25,
        hip: Vec2::new(-0.3, 0.0),
        program: Label::clipped("mmt test"),
    }
}

fn welcome() -> Welcome {
    Welcome {
        settings: Mode::Recommended.model_settings(COUPLING),
        state: state(),
        tool: Vec2::new(-0.45, 0.1),
        tool_force_max_n: TOOL_FORCE_MAX_N,
        resume: Token::new([9; 32]),
        scheme: Label::clipped("hybrid"),
        program: Label::clipped("mmt test"),
    }
}

const FAREWELL: Farewell<'_> = Farewell {
    ending: Ending::Finished,
    report: br#"{"duration_s":20.0}"#,
};

type Encoded = Result<usize, EncodeError>;

fn written(encode: impl FnOnce(&mut [u8]) -> Encoded) -> Vec<u8> {
    let mut buffer = [0xee; STREAM_MESSAGE_MAX];
    let length = encode(&mut buffer).unwrap();
    assert!(buffer[length..].iter().all(|&byte| byte == 0xee));
    buffer[..length].to_vec()
}

fn datagram(envelope: Envelope, message: Message) -> Vec<u8> {
    let datagram = Datagram {
        flags: Flags::default(),
        envelope,
        message,
    };
    written(|out| datagram.encode(out))
}

fn on_stream(message: &StreamMessage<'_>) -> Vec<u8> {
    written(|out| message.encode(out))
}

fn block(samples: impl IntoIterator<Item = HipSample>) -> SampleBlock {
    let mut block = SampleBlock::default();
    samples.into_iter().for_each(|s| block.push(s).unwrap());
    block
}

/// The samples of a push: 0.2 m/s along x, 4 N ± 30 %, with a tremor of 9 Hz (m), at 30 s of the session.
fn push_samples(count: u32, tremor: f64) -> SampleBlock {
    block((0..count).map(|k| {
        let t = f64::from(k) * 1e-3;
        let shake = tremor * libm::sin(56.0 * t);
        let hip = Vec2::new(0.2 * t - 0.18 + shake, 0.02 + shake);
        let swell = 4.0 + 1.2 * libm::sin(6.0 * t);
        let force = Vec2::new(swell + 1000.0 * shake, 0.3 * swell);
        HipSample {
            stamp: Time::from_millis(30_000 + u64::from(k)),
            hip: HipCounts::nearest(hip),
            force: ForceCounts::nearest(force),
        }
    }))
}

fn command() -> Command {
    Command {
        newest_update: 250,
        samples: push_samples(10, 1e-4),
        port: None,
    }
}

fn coupled_command() -> Command {
    Command {
        samples: push_samples(1, 0.0),
        port: Some(HandPort { in_j: 0.125 }),
        ..command()
    }
}

fn tool() -> Tool {
    Tool {
        answers: Time::from_millis(12),
        force: ForceCounts { x: 20_000, y: -5 },
        in_contact: true,
        in_j: 0.25,
    }
}

fn messages() -> [Message; 6] {
    [
        Message::Command(command()),
        Message::Update((&update()).into()),
        Message::Scene(scene()),
        Message::Heartbeat,
        Message::Tool(tool()),
        Message::Command(coupled_command()),
    ]
}

fn stream_messages() -> [StreamMessage<'static>; 4] {
    [
        StreamMessage::Hello(hello()),
        StreamMessage::Welcome((&welcome()).into()),
        StreamMessage::Refused(Refusal::Busy),
        StreamMessage::Farewell(FAREWELL),
    ]
}

/// Who sends a message of this type; the slave where both do.
fn sender(kind: Kind) -> Side {
    let sides = [Side::Slave, Side::Master];
    sides
        .into_iter()
        .find(|side| kind.is_sent_by(*side))
        .unwrap()
}

/// One encoded message of each type, with who sends it: those in datagrams, then those on the stream.
fn all() -> Vec<(Side, Vec<u8>)> {
    let datagrams = messages().map(|message| (sender(message.kind()), datagram(ENVELOPE, message)));
    let stream = stream_messages().map(|message| (sender(message.kind()), on_stream(&message)));
    datagrams.into_iter().chain(stream).collect()
}

/// If the bytes read as a message, they are the bytes that would be written for it. Whether they do.
fn reads_only_what_it_writes(bytes: &[u8], from: Side) -> bool {
    let in_datagram = Datagram::decode(bytes, from);
    if let Ok(read) = &in_datagram {
        assert_eq!(written(|out| read.encode(out)), bytes);
    }
    let on_the_stream = StreamMessage::decode(bytes, from);
    if let Ok(read) = &on_the_stream {
        assert_eq!(on_stream(read), bytes);
    }
    in_datagram.is_ok() || on_the_stream.is_ok()
}

/// Why these bytes are no message on the road of their type.
fn refused(bytes: &[u8], from: Side) -> DecodeError {
    let kind = bytes.get(5).and_then(|number| Kind::from_number(*number));
    match kind.map(Kind::channel) {
        Some(Channel::Stream) => StreamMessage::decode(bytes, from).unwrap_err(),
        _ => Datagram::decode(bytes, from).unwrap_err(),
    }
}

#[test]
fn every_message_reads_back_as_it_was_written() {
    for message in messages() {
        let bytes = datagram(ENVELOPE, message);
        let read = Datagram::decode(&bytes, sender(message.kind())).unwrap();
        assert_eq!((read.envelope, read.message), (ENVELOPE, message));
    }
    for message in stream_messages() {
        let bytes = on_stream(&message);
        let read = StreamMessage::decode(&bytes, sender(message.kind()));
        assert_eq!(read, Ok(message));
    }
    let kinds = messages().map(|message| message.kind());
    assert_eq!(
        kinds[..5],
        [1, 2, 3, 4, 5].map(|n| Kind::from_number(n).unwrap())
    );
    assert_eq!(
        stream_messages().map(|message| message.kind()),
        Kind::ALL[5..]
    );
}

#[test]
fn what_is_accepted_is_what_was_sent() {
    let raw = Update::<RawState>::from(&update());
    assert_eq!(raw.accept(&COUPLING), Ok(update()));
    assert_eq!(hello().accept(), Ok(hello()));
    let raw = Welcome::<RawState>::from(&welcome());
    assert_eq!(raw.accept(&COUPLING), Ok(welcome()));
}

#[test]
fn no_message_reads_when_cut_short_or_continued() {
    for (from, bytes) in all() {
        let kind = Kind::from_number(bytes[5]).unwrap();
        for length in 0..bytes.len() {
            refused(&bytes[..length], from);
        }
        for extra in [1, 2, 8] {
            let mut longer = bytes.clone();
            longer.resize(bytes.len() + extra, 0);
            let expected = DecodeError::Trailing { kind, extra };
            assert_eq!(refused(&longer, from), expected);
        }
    }
}

#[test]
fn every_byte_changed_to_every_value_reads_as_itself_or_not_at_all() {
    let mut counts = [0, 0];
    for (from, bytes) in all() {
        for place in 0..bytes.len() {
            for value in 0..=u8::MAX {
                let mut changed = bytes.clone();
                changed[place] = value;
                counts[usize::from(reads_only_what_it_writes(&changed, from))] += 1;
            }
        }
    }
    assert!(counts[0] > 1000 && counts[1] > 1000, "{counts:?}");
}

#[test]
fn an_over_long_varint_is_refused() {
    let short = b"MMTP\x03\x04\0\0\x01\x00\x00";
    assert!(Datagram::decode(short, Side::Master).is_ok());
    let kind = Kind::Heartbeat;
    for long in [
        &b"MMTP\x03\x04\0\0\x81\x00\x00\x00"[..],
        &b"MMTP\x03\x04\0\0\x01\x80\x00\x00"[..],
        &b"MMTP\x03\x04\0\0\x81\x80\x80\x80\x00\x00\x00"[..],
    ] {
        let expected = Err(DecodeError::NotCanonical { kind });
        assert_eq!(Datagram::decode(long, Side::Master), expected);
    }
}

#[test]
fn bytes_longer_than_any_message_are_refused_unread() {
    for (message, most) in [(0, DATAGRAM_MAX), (6, STREAM_MESSAGE_MAX)] {
        let (from, mut bytes) = all()[message].clone();
        let length = most + 1;
        bytes.resize(length, 0);
        assert_eq!(refused(&bytes, from), DecodeError::TooLong { length });
    }
}

/// Each choice is written as its place in the list, in one byte.
fn pinned<const N: usize>(choices: [impl serde::Serialize + std::fmt::Debug; N]) {
    for (number, choice) in choices.iter().enumerate() {
        let mut out = [0xff; 16];
        postcard::to_slice(choice, &mut out).unwrap();
        assert_eq!(usize::from(out[0]), number, "{choice:?}");
    }
}

#[test]
fn numbers_of_choices_are_pinned() {
    pinned(Cause::ALL);
    pinned(Role::ALL);
    assert_eq!(Role::ALL, [Role::Operator, Role::Observer]);
    pinned(Architecture::ALL);
    pinned([
        Refusal::Busy,
        Refusal::WrongToken,
        Refusal::BadHello,
        Refusal::Ending,
        Refusal::WrongRole,
    ]);
    pinned([Ending::Finished, Ending::Interrupted, Ending::Failed]);
    pinned([FrictionLaw::Sign, FrictionLaw::LimitSurface]);
    pinned([
        Smoothing::PerPacket { lambda: 0.0 },
        Smoothing::InTime { tau_s: 0.0 },
    ]);
    pinned([
        PoseCorrection::Snap,
        PoseCorrection::MatchedStamps,
        PoseCorrection::Replay,
    ]);
    let named = [
        Cause::Deadband,
        Cause::Timer,
        Cause::MasterOnlyContact,
        Cause::SlaveOnlyContact,
        Cause::ContactLost,
        Cause::EverySample,
        Cause::Elsewhere,
    ];
    assert_eq!(Cause::ALL, named);
    assert_eq!(named.map(Cause::number), [0, 1, 2, 3, 4, 5, 6]);
}
