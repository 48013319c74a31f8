//! What reads and is not accepted, or would not be and is not written.

use super::*;

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
        refused(
            Datagram {
                flags: Flags::default(),
                envelope,
                message,
            }
            .encode(&mut out),
        );
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
        let encoded = Datagram {
            flags: Flags::default(),
            envelope,
            message,
        }
        .encode(&mut out);
        assert_eq!(encoded.is_ok(), envelope.number == 1);
    }
    let mut bad = hello();
    bad.hip.x = f64::NAN;
    refused(StreamMessage::Hello(bad).encode(&mut out));
    let mut bad = welcome();
    bad.tool.y = f64::INFINITY;
    refused(StreamMessage::Welcome((&bad).into()).encode(&mut out));
    let mut bad = welcome();
    bad.settings.smoothing = Smoothing::InTime { tau_s: f64::NAN };
    refused(StreamMessage::Welcome((&bad).into()).encode(&mut out));
    let mut bad = welcome();
    bad.tool_force_max_n = f64::INFINITY;
    refused(StreamMessage::Welcome((&bad).into()).encode(&mut out));
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
    let mut far = welcome();
    far.tool.x = -5.1;
    assert!(Welcome::<RawState>::from(&far).accept(&COUPLING).is_err());
    for newtons in [0.0, -15.0, 1000.1] {
        let mut bad = welcome();
        bad.tool_force_max_n = newtons;
        let refused = Welcome::<RawState>::from(&bad).accept(&COUPLING);
        assert!(matches!(refused, Err(WelcomeError::Number(_))));
    }
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
