//! Promises of the whole format: what is written reads back, and nothing else reads.

use crate::model::sample::{ForceCounts, HipCounts, HipSample};
use crate::model::tool::{HandPort, Scene, Tool};
use crate::model::update::{Cause, Update};
use proptest::prelude::*;

use super::*;
use crate::model::contact::Coupling;
use crate::model::geometry::{BoxFootprint, Pose, Twist, Vec2};
use crate::model::params::{ModelParams, ModelState, ParamsError};
use crate::model::settings::{FrictionLaw, Mode, ModelSettings, PoseCorrection, Smoothing};
use crate::pairing::Token;
use crate::time::Time;

const COUPLING: Coupling = Coupling {
    stiffness_n_per_m: 1000.0,
    damping_ns_per_m: 10.0,
};

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
    )
    .unwrap()
}

fn update() -> Update {
    Update {
        sequence: 1,
        cause: Cause::Deadband,
        answers: Time::ZERO,
        newest_command: 0,
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

fn slave_farewell() -> Farewell<SlaveTotals> {
    let mut totals = SlaveTotals::default();
    totals.force.pmse = Some(0.25);
    totals.updates_by_cause = [1, 2, 3, 4, 5, 600];
    totals.traffic.udp_bytes_sent = u64::MAX;
    Farewell {
        ending: Ending::Finished,
        totals,
    }
}

fn master_farewell() -> Farewell<MasterTotals> {
    let mut totals = MasterTotals::default();
    totals.haptic_loop.cpu_us = Some(Quantiles {
        p50: 1.0,
        p99: 2.0,
        p999: 3.0,
    });
    Farewell {
        ending: Ending::Interrupted,
        totals,
    }
}

type Encoded = Result<usize, EncodeError>;

fn written(encode: impl FnOnce(&mut [u8]) -> Encoded) -> Vec<u8> {
    let mut buffer = [0xee; STREAM_MESSAGE_MAX];
    let length = encode(&mut buffer).unwrap();
    assert!(buffer[length..].iter().all(|&byte| byte == 0xee));
    buffer[..length].to_vec()
}

fn block(samples: impl IntoIterator<Item = HipSample>) -> SampleBlock {
    let mut block = SampleBlock::new();
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
        port: Some(HandPort {
            in_j: 0.125,
            wants_force: true,
            passive_tool: false,
        }),
        ..command()
    }
}

fn tool() -> Tool {
    Tool {
        answers: Time::from_millis(12),
        force: Some(ForceCounts { x: 20_000, y: -5 }),
        in_contact: true,
        in_j: 0.25,
        model_error: 0.125,
    }
}

/// One encoded datagram of each type, with who sends it.
fn datagrams() -> Vec<(Side, Vec<u8>)> {
    vec![
        (
            Side::Master,
            written(|out| encode_command(&ENVELOPE, &command(), out)),
        ),
        (
            Side::Slave,
            written(|out| encode_update(&ENVELOPE, &update(), out)),
        ),
        (
            Side::Slave,
            written(|out| encode_scene(&ENVELOPE, &scene(), out)),
        ),
        (Side::Slave, written(|out| encode_heartbeat(&ENVELOPE, out))),
        (
            Side::Slave,
            written(|out| encode_tool(&ENVELOPE, &tool(), out)),
        ),
        (
            Side::Master,
            written(|out| encode_command(&ENVELOPE, &coupled_command(), out)),
        ),
    ]
}

/// One encoded stream message of each type, with who sends it.
fn stream_messages() -> Vec<(Side, Vec<u8>)> {
    vec![
        (Side::Master, written(|out| encode_hello(&hello(), out))),
        (Side::Slave, written(|out| encode_welcome(&welcome(), out))),
        (
            Side::Slave,
            written(|out| encode_refused(Refusal::Busy, out)),
        ),
        (
            Side::Master,
            written(|out| encode_master_farewell(&master_farewell(), out)),
        ),
        (
            Side::Slave,
            written(|out| encode_slave_farewell(&slave_farewell(), out)),
        ),
    ]
}

/// If the bytes read as a datagram, they are the bytes that would be written for it.
fn reads_only_what_it_writes(bytes: &[u8], from: Side) -> Option<Datagram> {
    let read = decode_datagram(bytes, from).ok()?;
    assert_eq!(written(|out| datagram::encode_read(&read, out)), bytes);
    Some(read)
}

fn stream_reads_only_what_it_writes(bytes: &[u8], from: Side) -> Option<StreamMessage> {
    let read = decode_stream_message(bytes, from).ok()?;
    assert_eq!(written(|out| stream::encode_read(&read, out)), bytes);
    Some(read)
}

#[test]
fn every_datagram_reads_back_as_it_was_written() {
    let matters = datagrams().into_iter().map(|(from, bytes)| {
        let read = decode_datagram(&bytes, from).unwrap();
        assert_eq!(read.envelope, ENVELOPE);
        read.matter
    });
    let matters: Vec<_> = matters.collect();
    assert_eq!(matters[0], Matter::Command(command()));
    let Matter::Update(raw) = matters[1] else {
        panic!("no update");
    };
    assert_eq!(raw.accept(&COUPLING), Ok(update()));
    assert_eq!(matters[2], Matter::Scene(scene()));
    assert_eq!(matters[3], Matter::Heartbeat);
    assert_eq!(matters[4], Matter::Tool(tool()));
    assert_eq!(matters[5], Matter::Command(coupled_command()));
}

#[test]
fn every_stream_message_reads_back_as_it_was_written() {
    let read = |(from, bytes): (Side, Vec<u8>)| decode_stream_message(&bytes, from).unwrap();
    let messages: Vec<_> = stream_messages().into_iter().map(read).collect();
    let StreamMessage::Hello(raw) = messages[0] else {
        panic!("no hello");
    };
    assert_eq!(raw.token(), &hello().token);
    assert_eq!(raw.accept(), Ok(hello()));
    let StreamMessage::Welcome(raw) = messages[1] else {
        panic!("no welcome");
    };
    assert_eq!(raw.accept(&COUPLING), Ok(welcome()));
    assert_eq!(messages[2], StreamMessage::Refused(Refusal::Busy));
    assert_eq!(
        messages[3],
        StreamMessage::MasterFarewell(master_farewell())
    );
    assert_eq!(messages[4], StreamMessage::SlaveFarewell(slave_farewell()));
    let kinds: Vec<_> = messages.iter().map(StreamMessage::kind).collect();
    assert_eq!(kinds, Kind::ALL[6..]);
}

#[test]
fn no_message_reads_when_cut_short_or_continued() {
    let error = |on_stream: bool, bytes: &[u8], from| {
        if on_stream {
            decode_stream_message(bytes, from).unwrap_err()
        } else {
            decode_datagram(bytes, from).unwrap_err()
        }
    };
    let all = [datagrams(), stream_messages()].concat();
    for (from, bytes) in all {
        let kind = Kind::from_number(bytes[5]).unwrap();
        let on_stream = kind.channel() == Channel::Stream;
        for length in 0..bytes.len() {
            error(on_stream, &bytes[..length], from);
        }
        for extra in [1, 2, 8] {
            let mut longer = bytes.clone();
            longer.resize(bytes.len() + extra, 0);
            let expected = DecodeError::Trailing { kind, extra };
            assert_eq!(error(on_stream, &longer, from), expected);
        }
    }
}

#[test]
fn every_byte_changed_to_every_value_reads_as_itself_or_not_at_all() {
    let (mut read, mut refused) = (0, 0);
    let mut count = |is_read| if is_read { read += 1 } else { refused += 1 };
    for (from, bytes) in datagrams() {
        for place in 0..bytes.len() {
            for value in 0..=u8::MAX {
                let mut changed = bytes.clone();
                changed[place] = value;
                count(reads_only_what_it_writes(&changed, from).is_some());
            }
        }
    }
    for (from, bytes) in stream_messages() {
        for place in 0..bytes.len() {
            for value in 0..=u8::MAX {
                let mut changed = bytes.clone();
                changed[place] = value;
                count(stream_reads_only_what_it_writes(&changed, from).is_some());
            }
        }
    }
    assert!(read > 0 && refused > 0, "{read} {refused}");
}

#[test]
fn an_over_long_varint_is_refused() {
    let short = b"MMTP\x02\x04\0\0\x01\x00\x00";
    assert!(decode_datagram(short, Side::Master).is_ok());
    let kind = Kind::Heartbeat;
    for long in [
        &b"MMTP\x02\x04\0\0\x81\x00\x00\x00"[..],
        &b"MMTP\x02\x04\0\0\x01\x80\x00\x00"[..],
        &b"MMTP\x02\x04\0\0\x81\x80\x80\x80\x00\x00\x00"[..],
    ] {
        let expected = Err(DecodeError::NotCanonical { kind });
        assert_eq!(decode_datagram(long, Side::Master), expected);
    }
}

#[test]
fn bytes_longer_than_any_message_are_refused_unread() {
    let mut bytes = datagrams()[0].1.clone();
    bytes.resize(DATAGRAM_MAX + 1, 0);
    let length = bytes.len();
    let expected = Err(DecodeError::TooLong { length });
    assert_eq!(decode_datagram(&bytes, Side::Master), expected);
    bytes = stream_messages()[0].1.clone();
    bytes.resize(STREAM_MESSAGE_MAX + 1, 0);
    let length = bytes.len();
    let expected = Err(DecodeError::TooLong { length });
    assert_eq!(decode_stream_message(&bytes, Side::Master), expected);
}

/// Every float on the wire made NaN, infinite or huge: not finite never reads, huge is never accepted.
#[test]
fn no_number_that_is_not_finite_reads_and_none_out_of_range_is_accepted() {
    let (_, bytes) = &datagrams()[1];
    let floats = 15;
    for index in 0..floats {
        let place = bytes.len() - 8 * (floats - index);
        let with = |value: f64| {
            let mut changed = bytes.clone();
            changed[place..place + 8].copy_from_slice(&value.to_le_bytes());
            decode_datagram(&changed, Side::Slave)
        };
        for value in [f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let error = with(value).unwrap_err();
            assert!(matches!(error, DecodeError::Field { .. }), "{error}");
        }
        for value in [f64::MAX, f64::MIN] {
            let Matter::Update(raw) = with(value).unwrap().matter else {
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
    let (from, bytes) = &datagrams()[1];
    let Matter::Update(raw) = decode_datagram(bytes, *from).unwrap().matter else {
        panic!("no update");
    };
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
    let unnumbered = Envelope {
        number: 0,
        ..ENVELOPE
    };
    refused(encode_heartbeat(&unnumbered, &mut out));
    let mut empty = command();
    empty.samples.clear();
    refused(encode_command(&ENVELOPE, &empty, &mut out));
    let mut bad = update();
    bad.sequence = 0;
    refused(encode_update(&ENVELOPE, &bad, &mut out));
    bad = update();
    bad.state.pose.angle = f64::NAN;
    refused(encode_update(&ENVELOPE, &bad, &mut out));
    let mut bad = scene();
    bad.force.y = f64::INFINITY;
    refused(encode_scene(&ENVELOPE, &bad, &mut out));
    for in_j in [-1e-9, f64::NAN, f64::INFINITY] {
        refused(encode_tool(&ENVELOPE, &Tool { in_j, ..tool() }, &mut out));
        let port = coupled_command().port.map(|port| HandPort { in_j, ..port });
        let bad = Command { port, ..command() };
        refused(encode_command(&ENVELOPE, &bad, &mut out));
    }
    for model_error in [-0.1, 1.1, f64::NAN] {
        let bad = Tool {
            model_error,
            ..tool()
        };
        refused(encode_tool(&ENVELOPE, &bad, &mut out));
    }
    let mut bad = slave_farewell();
    bad.totals.force.pmse = Some(f64::NAN);
    refused(encode_slave_farewell(&bad, &mut out));
    let mut bad = master_farewell();
    bad.totals.haptic_loop.lateness_us = Some(Quantiles {
        p50: f64::NAN,
        ..Quantiles::default()
    });
    refused(encode_master_farewell(&bad, &mut out));
    let mut bad = hello();
    bad.hip.x = f64::NAN;
    refused(encode_hello(&bad, &mut out));
    let mut bad = welcome();
    bad.settings.smoothing = Smoothing::InTime { tau_s: f64::NAN };
    refused(encode_welcome(&bad, &mut out));
}

#[test]
fn no_buffer_is_too_short_without_an_error() {
    let (_, bytes) = &datagrams()[0];
    for length in 0..bytes.len() {
        let encoded = encode_command(&ENVELOPE, &command(), &mut vec![0; length]);
        assert!(matches!(encoded, Err(EncodeError::BufferTooSmall { .. })));
    }
    let (_, bytes) = &stream_messages()[0];
    for length in 0..bytes.len() {
        let encoded = encode_hello(&hello(), &mut vec![0; length]);
        assert!(matches!(encoded, Err(EncodeError::BufferTooSmall { .. })));
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
    let bytes = written(|out| encode_command(&envelope, &command, out));
    // 8 header, 46 envelope, 5 newest update, 1 length, 30 the first sample, 25 each other
    assert_eq!(bytes.len(), 8 + 46 + 5 + 1 + 30 + 31 * 25);
    let coupled = Command {
        port: Some(HandPort::default()),
        ..command
    };
    let longest = written(|out| encode_command(&envelope, &coupled, out));
    // 8 E_in, 1 for each wish
    assert_eq!(longest.len(), bytes.len() + 10);
    assert!(longest.len() <= DATAGRAM_MAX);
    assert!(reads_only_what_it_writes(&bytes, Side::Master).is_some());
}

#[test]
fn ten_samples_of_a_push_take_115_bytes_in_all_and_125_with_a_strong_tremor() {
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
        written(|out| encode_command(&envelope, &command, out)).len()
    };
    // a hand without and with a strong tremor
    let (smooth, shaking) = (length(0.0), length(5e-4));
    assert!(smooth <= 115, "{smooth} bytes");
    assert!(smooth < shaking && shaking <= 125, "{shaking} bytes");
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
    let raw_hello = |hello: &Hello| raw::RawHello::of(hello).accept();
    for k_p in [49.9, 10_001.0, -1000.0] {
        let mut bad = hello();
        bad.coupling.stiffness_n_per_m = k_p;
        assert!(matches!(raw_hello(&bad), Err(HelloError::Number(_))));
        let mut bad = welcome();
        bad.settings.coupling.stiffness_n_per_m = k_p;
        let refused = raw::RawWelcome::of(&bad).accept(&bad.settings.coupling);
        assert!(matches!(refused, Err(WelcomeError::Number(_))));
    }
    for hz in [61, 255] {
        let mut bad = hello();
        bad.scene_hz = hz;
        assert_eq!(raw_hello(&bad), Err(HelloError::SceneRate { hz }));
    }
    for samples in [0, 33, 255] {
        let mut bad = hello();
        bad.samples_per_command = samples;
        let refused = Err(HelloError::SamplesPerCommand { samples });
        assert_eq!(raw_hello(&bad), refused);
    }
    let mut far = hello();
    far.hip.y = 5.1;
    assert!(raw_hello(&far).is_err());
    let mut bad = welcome();
    bad.state.pose.position.x = 6.0;
    assert!(raw::RawWelcome::of(&bad).accept(&COUPLING).is_err());
}

#[test]
fn a_slave_cannot_make_the_hand_feel_another_stiffness_than_its_device_s() {
    let mut stiffer = welcome();
    stiffer.settings.coupling.stiffness_n_per_m = 2000.0;
    let refused = raw::RawWelcome::of(&stiffer).accept(&COUPLING);
    assert!(matches!(refused, Err(WelcomeError::OtherCoupling { .. })));
}

#[test]
fn a_text_too_long_or_with_control_characters_is_refused() {
    let (from, good) = &stream_messages()[0];
    let text = b"mmt test";
    let at = good.windows(text.len()).position(|w| w == text).unwrap();
    let with = |text: &[u8]| {
        let mut bytes = good[..at - 1].to_vec();
        bytes.push(text.len() as u8);
        bytes.extend_from_slice(text);
        decode_stream_message(&bytes, *from)
    };
    assert!(with(&[b'a'; 64]).is_ok());
    for bad in [&[b'a'; 65][..], b"a\x1b[2J", b"a\n", b"\xff\xfe"] {
        assert!(matches!(with(bad), Err(DecodeError::Malformed { .. })));
    }
}

#[test]
fn a_printed_hello_does_not_show_the_token() {
    let (from, bytes) = &stream_messages()[0];
    let read = decode_stream_message(bytes, *from).unwrap();
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
    let params = (0.2..50.0, 0.0..50.0, 0.0..200.0, 1e-5..34.0, 0.0..200.0);
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
        )
        .unwrap()
    })
}

fn any_port() -> impl Strategy<Value = HandPort> {
    (0.0..1e9, any::<bool>(), any::<bool>()).prop_map(|(in_j, wants_force, passive_tool)| {
        HandPort {
            in_j,
            wants_force,
            passive_tool,
        }
    })
}

proptest! {
    #[test]
    fn any_command_reads_back(
        envelope in any_envelope(),
        command in any_command(),
        port in prop::option::of(any_port()),
    ) {
        let command = Command { port, ..command };
        let bytes = written(|out| encode_command(&envelope, &command, out));
        let matter = Matter::Command(command);
        prop_assert!(bytes.len() <= DATAGRAM_MAX);
        prop_assert_eq!(decode_datagram(&bytes, Side::Master), Ok(Datagram { envelope, matter }));
    }

    #[test]
    fn any_update_reads_back(
        envelope in any_envelope(),
        (sequence, newest_command) in (1_u32.., any::<u32>()),
        (cause, slave_in_contact) in (0..6_usize, any::<bool>()),
        (answers, state) in (any::<u64>(), any_state()),
    ) {
        let (cause, answers) = (Cause::ALL[cause], Time::from_nanos(answers));
        let update = Update { sequence, cause, answers, newest_command, slave_in_contact, state };
        let bytes = written(|out| encode_update(&envelope, &update, out));
        let read = decode_datagram(&bytes, Side::Slave).unwrap();
        prop_assert_eq!(read.envelope, envelope);
        let Matter::Update(raw) = read.matter else { panic!("no update") };
        prop_assert_eq!(raw.sequence(), sequence);
        prop_assert_eq!(raw.accept(&COUPLING), Ok(update));
    }

    #[test]
    fn any_scene_and_heartbeat_read_back(
        envelope in any_envelope(),
        answers in any::<u64>(),
        n in prop::array::uniform7(any_finite()),
    ) {
        let scene = Scene {
            answers: Time::from_nanos(answers),
            object: Pose::new(n[0], n[1], n[2]),
            tool: Vec2::new(n[3], n[4]),
            force: Vec2::new(n[5], n[6]),
        };
        let bytes = written(|out| encode_scene(&envelope, &scene, out));
        let matter = Matter::Scene(scene);
        prop_assert_eq!(decode_datagram(&bytes, Side::Slave), Ok(Datagram { envelope, matter }));
        let bytes = written(|out| encode_heartbeat(&envelope, out));
        let matter = Matter::Heartbeat;
        for from in [Side::Master, Side::Slave] {
            prop_assert_eq!(decode_datagram(&bytes, from), Ok(Datagram { envelope, matter }));
        }
    }

    #[test]
    fn any_tool_reads_back(
        envelope in any_envelope(),
        (answers, in_j, model_error) in (any::<u64>(), 0.0..1e9, 0.0..=1.0),
        (force, in_contact) in (prop::option::of(any::<[i32; 2]>()), any::<bool>()),
    ) {
        let answers = Time::from_nanos(answers);
        let force = force.map(|[x, y]| ForceCounts { x, y });
        let tool = Tool { answers, force, in_contact, in_j, model_error };
        let bytes = written(|out| encode_tool(&envelope, &tool, out));
        let matter = Matter::Tool(tool);
        prop_assert_eq!(decode_datagram(&bytes, Side::Slave), Ok(Datagram { envelope, matter }));
        prop_assert!(decode_datagram(&bytes, Side::Master).is_err());
    }

    #[test]
    fn any_hello_and_welcome_read_back(
        token: [u8; 32],
        (k_p, k_d, tau) in (50.0..10_000.0, 0.0..100.0, 0.001..10.0),
        (samples, x) in (1..=32_u8, -5.0..5.0),
        (name, state) in (".{0,40}", any_state()),
    ) {
        let coupling = Coupling { stiffness_n_per_m: k_p, damping_ns_per_m: k_d };
        let hello = Hello {
            token: Token::new(token),
            coupling,
            samples_per_command: samples,
            architecture: Architecture::ALL[usize::from(samples) % 3],
            hip: Vec2::new(x, -x),
            program: Label::clipped(&name),
            ..hello()
        };
        let bytes = written(|out| encode_hello(&hello, out));
        let Ok(StreamMessage::Hello(raw)) = decode_stream_message(&bytes, Side::Master) else {
            panic!("no hello")
        };
        prop_assert_eq!(raw.accept(), Ok(hello));
        let smoothing = Smoothing::InTime { tau_s: tau };
        let settings = ModelSettings { smoothing, ..welcome().settings };
        let scheme = Label::clipped(&name);
        let welcome = Welcome { settings, scheme, state, ..welcome() };
        let bytes = written(|out| encode_welcome(&welcome, out));
        let Ok(StreamMessage::Welcome(raw)) = decode_stream_message(&bytes, Side::Slave) else {
            panic!("no welcome")
        };
        prop_assert_eq!(raw.accept(&COUPLING), Ok(welcome));
    }

    #[test]
    fn mutated_bytes_read_as_themselves_or_not_at_all(
        which in 0..9_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        (cut, tail) in (any::<prop::sample::Index>(), prop::collection::vec(any::<u8>(), 0..6)),
        reach in any::<bool>(),
    ) {
        let all = [datagrams(), stream_messages()].concat();
        let (from, mut bytes) = all[which].clone();
        for (place, value) in changes {
            // past the header, half of the time
            let first = if reach { 8 } else { 0 };
            let place = first + place.index(bytes.len() - first);
            bytes[place] = value;
        }
        reads_only_what_it_writes(&bytes, from);
        stream_reads_only_what_it_writes(&bytes, from);
        bytes.truncate(1 + cut.index(bytes.len()));
        bytes.extend_from_slice(&tail);
        reads_only_what_it_writes(&bytes, from);
        stream_reads_only_what_it_writes(&bytes, from);
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
                stream_reads_only_what_it_writes(&message, from);
                stream_reads_only_what_it_writes(&body, from);
            }
        }
    }
}
