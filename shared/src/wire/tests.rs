//! Promises of the whole format: what is written reads back, and nothing else reads.

use crate::fixtures::COUPLING;
use proptest::prelude::*;

use super::*;
use crate::model::contact::Coupling;
use crate::model::geometry::{BoxFootprint, Pose, Twist, Vec2};
use crate::model::params::{ModelParams, ModelState, ParamsError};
use crate::model::sample::{ForceCounts, HipCounts, HipSample};
use crate::model::settings::{FrictionLaw, Mode, ModelSettings, PoseCorrection, Smoothing};
use crate::model::tool::{HandPort, Scene, Tool};
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
        slave_in_contact: false,
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
    let datagram = Datagram { envelope, message };
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

/// Every float on the wire made NaN, infinite or huge: not finite never reads, huge is never accepted.
#[test]
fn no_number_that_is_not_finite_reads_and_none_out_of_range_is_accepted() {
    let bytes = datagram(ENVELOPE, messages()[1]);
    let floats = 15;
    for index in 0..floats {
        let place = bytes.len() - 8 * (floats - index);
        let with = |value: f64| {
            let mut changed = bytes.clone();
            changed[place..place + 8].copy_from_slice(&value.to_le_bytes());
            Datagram::decode(&changed, Side::Slave)
        };
        for value in [f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let error = with(value).unwrap_err();
            assert!(matches!(error, DecodeError::Field { .. }), "{error}");
        }
        for value in [f64::MAX, f64::MIN] {
            let Message::Update(raw) = with(value).unwrap().message else {
                panic!("no update");
            };
            let refused = raw.accept(&COUPLING).unwrap_err();
            assert!(
                matches!(refused, ParamsError::OutOfRange { .. }),
                "{refused}"
            );
        }
    }
}

#[test]
fn an_update_below_the_stability_bound_is_not_accepted() {
    let raw = Update::<RawState>::from(&update());
    let stiff = Coupling::for_stiffness(10_000.0);
    let stiff = Coupling {
        damping_ns_per_m: 100.0 * stiff.damping_ns_per_m,
        ..stiff
    };
    assert!(raw.accept(&COUPLING).is_ok());
    assert!(matches!(
        raw.accept(&stiff),
        Err(ParamsError::Unstable { .. })
    ));
}

#[test]
fn what_the_other_side_would_refuse_is_not_written() {
    let mut out = [0; STREAM_MESSAGE_MAX];
    let refused = |encoded: Encoded| assert!(matches!(encoded, Err(EncodeError::Field { .. })));
    let mut not_sent = |message: Message| {
        let envelope = ENVELOPE;
        refused(Datagram { envelope, message }.encode(&mut out));
    };
    let mut empty = command();
    empty.samples.clear();
    not_sent(Message::Command(empty));
    let mut bad = update();
    bad.sequence = 0;
    not_sent(Message::Update((&bad).into()));
    let mut bad = scene();
    bad.force.y = f64::INFINITY;
    not_sent(Message::Scene(bad));
    for in_j in [-1e-9, f64::NAN, f64::INFINITY] {
        not_sent(Message::Tool(Tool { in_j, ..tool() }));
        let port = Some(HandPort { in_j });
        not_sent(Message::Command(Command { port, ..command() }));
    }
    for envelope in [0, 1].map(|number| Envelope {
        number,
        echo: Some(Echo {
            number,
            sent: Time::ZERO,
            held_ns: 0,
            received: 0,
        })
        .filter(|_| number == 0),
        ..ENVELOPE
    }) {
        let message = Message::Heartbeat;
        let encoded = Datagram { envelope, message }.encode(&mut out);
        assert_eq!(encoded.is_ok(), envelope.number == 1);
    }
    let mut bad = hello();
    bad.hip.x = f64::NAN;
    refused(StreamMessage::Hello(bad).encode(&mut out));
    let mut bad = welcome();
    bad.settings.smoothing = Smoothing::InTime { tau_s: f64::NAN };
    refused(StreamMessage::Welcome((&bad).into()).encode(&mut out));
}

#[test]
fn no_buffer_is_too_short_without_an_error() {
    let (envelope, message) = (ENVELOPE, messages()[0]);
    for length in 0..datagram(envelope, message).len() {
        let encoded = Datagram { envelope, message }.encode(&mut vec![0; length]);
        assert!(matches!(encoded, Err(EncodeError::BufferTooSmall { .. })));
    }
    for message in stream_messages() {
        for length in 0..on_stream(&message).len() {
            let encoded = message.encode(&mut vec![0; length]);
            assert!(matches!(encoded, Err(EncodeError::BufferTooSmall { .. })));
        }
    }
}

#[test]
fn the_longest_messages_fit() {
    let wide = i32::MAX;
    let samples = block((0..SAMPLES_MAX as u64).map(|k| {
        let stamp =
            Time::from_nanos(u64::MAX - (SAMPLES_MAX as u64 - k) * u64::from(u32::MAX) * 1_000_000);
        let count = if k % 2 == 0 { wide } else { -wide };
        HipSample {
            stamp,
            hip: HipCounts { x: count, y: count },
            force: ForceCounts { x: count, y: count },
        }
    }));
    let echo = Some(Echo {
        number: u32::MAX,
        sent: Time::MAX,
        held_ns: u64::MAX,
        received: u32::MAX,
    });
    let envelope = Envelope {
        number: u32::MAX,
        sent: Time::MAX,
        echo,
    };
    let command = Command {
        newest_update: u32::MAX,
        samples,
        port: None,
    };
    let bytes = datagram(envelope, Message::Command(command));
    // 8 header, 46 envelope, 5 newest update, 1 length, 30 the first sample, 25 each other, 1 no port
    assert_eq!(bytes.len(), 8 + 46 + 5 + 1 + 30 + 31 * 25 + 1);
    let port = Some(HandPort::default());
    let longest = datagram(envelope, Message::Command(Command { port, ..command }));
    // E_in
    assert_eq!(longest.len(), bytes.len() + 8);
    assert!(longest.len() <= DATAGRAM_MAX);
    assert!(reads_only_what_it_writes(&longest, Side::Master));
    let report = [b' '; STREAM_MESSAGE_MAX - 8 - 1 - 2];
    let report = &report[..];
    let farewell = StreamMessage::Farewell(Farewell { report, ..FAREWELL });
    assert_eq!(on_stream(&farewell).len(), STREAM_MESSAGE_MAX);
}

#[test]
fn ten_samples_of_a_push_take_116_bytes_in_all_and_126_with_a_strong_tremor() {
    let echo = Some(Echo {
        number: 300,
        sent: Time::from_millis(29_900),
        held_ns: 31_000_000,
        received: 297,
    });
    let envelope = Envelope {
        number: 3000,
        sent: Time::from_millis(30_009),
        echo,
    };
    let length = |tremor| {
        let command = Command {
            newest_update: 250,
            samples: push_samples(10, tremor),
            port: None,
        };
        datagram(envelope, Message::Command(command)).len()
    };
    // a hand without and with a strong tremor
    let (smooth, shaking) = (length(0.0), length(5e-4));
    assert!(smooth <= 116, "{smooth} bytes");
    assert!(smooth < shaking && shaking <= 126, "{shaking} bytes");
    println!("{smooth} bytes smooth, {shaking} bytes shaking");
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
    pinned([Role::Operator]);
    pinned(Architecture::ALL);
    pinned([
        Refusal::Busy,
        Refusal::WrongToken,
        Refusal::BadHello,
        Refusal::Ending,
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
    ];
    assert_eq!(Cause::ALL, named);
    assert_eq!(named.map(Cause::number), [0, 1, 2, 3, 4, 5]);
}

#[test]
fn a_hello_or_welcome_with_a_number_out_of_range_is_not_accepted() {
    for k_p in [49.9, 10_001.0, -1000.0] {
        let mut bad = hello();
        bad.coupling.stiffness_n_per_m = k_p;
        assert!(matches!(bad.accept(), Err(HelloError::Number(_))));
        let mut bad = welcome();
        bad.settings.coupling.stiffness_n_per_m = k_p;
        let refused = Welcome::<RawState>::from(&bad).accept(&bad.settings.coupling);
        assert!(matches!(refused, Err(WelcomeError::Number(_))));
    }
    for hz in [61, 255] {
        let mut bad = hello();
        bad.scene_hz = hz;
        assert_eq!(bad.accept(), Err(HelloError::SceneRate { hz }));
    }
    for samples in [0, 33, 255] {
        let mut bad = hello();
        bad.samples_per_command = samples;
        let refused = Err(HelloError::SamplesPerCommand { samples });
        assert_eq!(bad.accept(), refused);
    }
    let mut far = hello();
    far.hip.y = 5.1;
    assert!(far.accept().is_err());
    let bytes = on_stream(&stream_messages()[1]);
    let at = |value: f64| bytes.windows(8).position(|w| w == value.to_le_bytes());
    let place = at(0.1).unwrap();
    let mut bytes = bytes.clone();
    bytes[place..place + 8].copy_from_slice(&6.0_f64.to_le_bytes());
    let Ok(StreamMessage::Welcome(bad)) = StreamMessage::decode(&bytes, Side::Slave) else {
        panic!("no welcome");
    };
    let refused = bad.accept(&COUPLING).unwrap_err();
    assert!(refused.to_string().contains("position x"), "{refused}");
}

#[test]
fn a_slave_cannot_make_the_hand_feel_another_stiffness_than_its_device_s() {
    let mut stiffer = welcome();
    stiffer.settings.coupling.stiffness_n_per_m = 2000.0;
    let refused = Welcome::<RawState>::from(&stiffer).accept(&COUPLING);
    assert!(matches!(refused, Err(WelcomeError::OtherCoupling { .. })));
}

#[test]
fn a_text_too_long_or_with_control_characters_is_refused() {
    let (from, good) = &all()[6];
    let text = b"mmt test";
    let at = good.windows(text.len()).position(|w| w == text).unwrap();
    let with = |text: &[u8]| {
        let mut bytes = good[..at - 1].to_vec();
        bytes.push(text.len() as u8);
        bytes.extend_from_slice(text);
        StreamMessage::decode(&bytes, *from).map(|message| message.kind())
    };
    assert!(with(&[b'a'; 64]).is_ok());
    for bad in [&[b'a'; 65][..], b"a\x1b[2J", b"a\n", b"\xff\xfe"] {
        assert!(matches!(with(bad), Err(DecodeError::Malformed { .. })));
    }
}

#[test]
fn a_printed_hello_does_not_show_the_token() {
    let (from, bytes) = &all()[6];
    let read = StreamMessage::decode(bytes, *from).unwrap();
    for shown in [format!("{read:?}"), format!("{:?}", hello())] {
        assert!(
            shown.contains("secret") && !shown.contains("7, 7"),
            "{shown}"
        );
    }
}

fn any_envelope() -> impl Strategy<Value = Envelope> {
    let echo = (1_u32.., any::<u64>(), any::<u64>(), any::<u32>());
    let echo = echo.prop_map(|(number, sent, held_ns, received)| Echo {
        number,
        sent: Time::from_nanos(sent),
        held_ns,
        received,
    });
    let parts = (1_u32.., any::<u64>(), prop::option::of(echo));
    parts.prop_map(|(number, sent, echo)| Envelope {
        number,
        sent: Time::from_nanos(sent),
        echo,
    })
}

fn any_command() -> impl Strategy<Value = Command> {
    let step = (1_u32.., any::<[i32; 4]>());
    let steps = prop::collection::vec(step, 1..=SAMPLES_MAX);
    (any::<u32>(), any::<u32>(), steps).prop_map(|(newest_update, start, steps)| {
        let mut stamp = u64::from(start);
        let samples = block(steps.into_iter().map(|(ticks, [x, y, fx, fy])| {
            stamp += u64::from(ticks) * 1_000_000;
            HipSample {
                stamp: Time::from_nanos(stamp),
                hip: HipCounts { x, y },
                force: ForceCounts { x: fx, y: fy },
            }
        }));
        Command {
            newest_update,
            samples,
            port: None,
        }
    })
}

fn any_finite() -> impl Strategy<Value = f64> {
    use prop::num::f64::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO
}

fn any_state() -> impl Strategy<Value = ModelState> {
    let params = (0.2..50.0, 0.0..50.0, 0.0..200.0, 0.03..34.0, 0.0..200.0);
    let offsets = prop::array::uniform4(0.01..1.0);
    let motion = prop::array::uniform6(-4.9..4.9);
    (params, offsets, motion).prop_map(|((m, b, c, i, e), [east, north, west, south], p)| {
        let footprint = BoxFootprint {
            east,
            north,
            west,
            south,
        };
        ModelState::try_new(
            ModelParams::try_new(m, b, c, i, e, &COUPLING).unwrap(),
            footprint,
            Pose::new(p[0], p[1], p[2]),
            Twist::new(p[3], p[4], p[5]),
            &COUPLING,
        )
        .unwrap()
    })
}

proptest! {
    #[test]
    fn any_command_reads_back(
        envelope in any_envelope(),
        command in any_command(),
        in_j in prop::option::of(0.0..1e9),
    ) {
        let port = in_j.map(|in_j| HandPort { in_j });
        let message = Message::Command(Command { port, ..command });
        let bytes = datagram(envelope, message);
        prop_assert!(bytes.len() <= DATAGRAM_MAX);
        prop_assert_eq!(Datagram::decode(&bytes, Side::Master), Ok(Datagram { envelope, message }));
    }

    #[test]
    fn any_update_reads_back(
        envelope in any_envelope(),
        sequence in 1_u32..,
        (cause, slave_in_contact) in (0..6_usize, any::<bool>()),
        (answers, state) in (any::<u64>(), any_state()),
    ) {
        let (cause, answers) = (Cause::ALL[cause], Time::from_nanos(answers));
        let update = Update { sequence, cause, answers, slave_in_contact, state };
        let bytes = datagram(envelope, Message::Update((&update).into()));
        let read = Datagram::decode(&bytes, Side::Slave).unwrap();
        prop_assert_eq!(read.envelope, envelope);
        let Message::Update(raw) = read.message else { panic!("no update") };
        prop_assert_eq!(raw.sequence, sequence);
        prop_assert_eq!(raw.accept(&COUPLING), Ok(update));
    }

    #[test]
    fn any_scene_tool_and_heartbeat_read_back(
        envelope in any_envelope(),
        answers in any::<u64>(),
        n in prop::array::uniform7(any_finite()),
        ((x, y), in_contact, in_j) in (any::<(i32, i32)>(), any::<bool>(), 0.0..1e9),
    ) {
        let answers = Time::from_nanos(answers);
        let scene = Scene {
            answers,
            object: Pose::new(n[0], n[1], n[2]),
            tool: Vec2::new(n[3], n[4]),
            force: Vec2::new(n[5], n[6]),
        };
        let tool = Tool { answers, force: ForceCounts { x, y }, in_contact, in_j };
        for message in [Message::Scene(scene), Message::Tool(tool), Message::Heartbeat] {
            let bytes = datagram(envelope, message);
            for from in [Side::Master, Side::Slave] {
                let read = Datagram::decode(&bytes, from);
                if message.kind().is_sent_by(from) {
                    prop_assert_eq!(read, Ok(Datagram { envelope, message }));
                } else {
                    prop_assert!(read.is_err());
                }
            }
        }
    }

    #[test]
    fn any_hello_welcome_and_farewell_read_back(
        token: [u8; 32],
        (k_p, k_d, tau) in (50.0..10_000.0, 0.0..100.0, 0.001..10.0),
        (samples, x) in (1..=32_u8, -5.0..5.0),
        (name, state) in (".{0,40}", any_state()),
        report in prop::collection::vec(any::<u8>(), 0..4000),
    ) {
        let coupling = Coupling { stiffness_n_per_m: k_p, damping_ns_per_m: k_d };
        let hello = Hello {
            token: Token::new(token),
            coupling,
            samples_per_command: samples,
            architecture: Architecture::ALL[usize::from(samples) % 2],
            hip: Vec2::new(x, -x),
            program: Label::clipped(&name),
            ..hello()
        };
        prop_assert_eq!(hello.accept(), Ok(hello));
        let smoothing = Smoothing::InTime { tau_s: tau };
        let settings = ModelSettings { smoothing, ..welcome().settings };
        let scheme = Label::clipped(&name);
        let welcome = Welcome { settings, scheme, state, ..welcome() };
        let raw = Welcome::<RawState>::from(&welcome);
        prop_assert_eq!(raw.accept(&COUPLING), Ok(welcome));
        let farewell = Farewell { report: &report, ..FAREWELL };
        for message in [
            StreamMessage::Hello(hello),
            StreamMessage::Welcome(raw),
            StreamMessage::Farewell(farewell),
        ] {
            let bytes = on_stream(&message);
            let read = StreamMessage::decode(&bytes, sender(message.kind()));
            prop_assert_eq!(read, Ok(message));
        }
    }

    #[test]
    fn mutated_bytes_read_as_themselves_or_not_at_all(
        which in 0..10_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        (cut, tail) in (any::<prop::sample::Index>(), prop::collection::vec(any::<u8>(), 0..6)),
        reach in any::<bool>(),
    ) {
        let (from, mut bytes) = all()[which].clone();
        for (place, value) in changes {
            // past the header, half of the time
            let first = if reach { 8 } else { 0 };
            let place = first + place.index(bytes.len() - first);
            bytes[place] = value;
        }
        reads_only_what_it_writes(&bytes, from);
        bytes.truncate(1 + cut.index(bytes.len()));
        bytes.extend_from_slice(&tail);
        reads_only_what_it_writes(&bytes, from);
    }

    #[test]
    fn random_bodies_read_as_themselves_or_not_at_all(
        kind in 0..9_usize,
        body in prop::collection::vec(any::<u8>(), 0..300),
        small in prop::collection::vec(0..3_u8, 0..40),
    ) {
        for body in [body, small] {
            let message = [&header::header(Kind::ALL[kind])[..], &body[..]].concat();
            for from in [Side::Master, Side::Slave] {
                reads_only_what_it_writes(&message, from);
                reads_only_what_it_writes(&body, from);
            }
        }
    }
}
