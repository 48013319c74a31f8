//! Messages of any content, and bytes that are none, as proptest makes them.

use super::*;
use crate::model::architecture::Architecture;

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
        prop_assert_eq!(Datagram::decode(&bytes, Side::Master), Ok(Datagram { flags: Flags::default(), envelope, message }));
    }

    #[test]
    fn any_update_reads_back(
        envelope in any_envelope(),
        sequence in 1_u32..,
        (cause, face) in (0..Cause::ALL.len(), prop::option::of(0..Face::ALL.len())),
        (answers, state) in (any::<u64>(), any_state()),
    ) {
        let (cause, answers) = (Cause::ALL[cause], Time::from_nanos(answers));
        let update = Update { sequence, cause, answers, touched_face: face.map(|face| Face::ALL[face]), state };
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
                    prop_assert_eq!(read, Ok(Datagram { flags: Flags::default(), envelope, message }));
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
            claim: [Claim::IfFree, Claim::TakeOver, Claim::Resume(Token::new(token))]
                [usize::from(samples) % 3],
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
        stopped: bool,
        tool in 0..3_usize,
        energy_holds: bool,
        body in prop::collection::vec(any::<u8>(), 0..300),
        small in prop::collection::vec(0..3_u8, 0..40),
    ) {
        let flags = Flags { stopped, tool: ToolState::ALL[tool], energy_holds };
        for body in [body, small] {
            let message = [&header::header(Kind::ALL[kind], flags)[..], &body[..]].concat();
            for from in [Side::Master, Side::Slave] {
                reads_only_what_it_writes(&message, from);
                reads_only_what_it_writes(&body, from);
            }
        }
    }
}
