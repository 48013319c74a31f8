//! Messages of the wire: what reads is what would have been written, and what is accepted is within its bounds.

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Face;
use mmt_shared::model::params::ModelState;
use mmt_shared::model::update::Update;
use mmt_shared::report::{Brief, MasterHalf, MasterSession, RunReport, SlaveHalf, SlaveSession};
use mmt_shared::wire::{
    DATAGRAM_MAX, Datagram, DecodeError, Ending, Hello, Message, RawState, STREAM_MESSAGE_MAX,
    Side, StreamMessage,
};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::outcome::Outcome;

/// Couplings of sessions: the default one, the softest, the stiffest.
const COUPLINGS: [(f64, f64); 3] = [(1000.0, 10.0), (50.0, 0.0), (10_000.0, 40.0)];

/// m (kg), b (N s/m), c (N), I (kg m²) and e (N m) as the documents have them.
const ACCEPTED: [(f64, f64); 5] = [
    (0.05, 50.0),
    (0.0, 200.0),
    (0.0, 200.0),
    (3e-6, 34.0),
    (0.0, 200.0),
];

/// The reason that says most: that of the side which may send such a message.
fn told(master: DecodeError, slave: DecodeError) -> Outcome {
    match master {
        DecodeError::WrongDirection { .. } => Outcome::refused(&slave),
        other => Outcome::refused(&other),
    }
}

pub(super) fn datagram(input: &[u8]) -> Outcome {
    let [master, slave] = [Side::Master, Side::Slave].map(|from| {
        Datagram::decode(input, from).inspect(|read| {
            let mut out = [0; DATAGRAM_MAX];
            let length = read.encode(&mut out).unwrap();
            assert_eq!(&out[..length], input, "it is written otherwise");
            assert!(read.message.kind().is_sent_by(from));
            judge_datagram(read);
        })
    });
    match (master, slave) {
        (Ok(read), _) | (_, Ok(read)) => Outcome::taken(u64::from(read.message.kind().number())),
        (Err(master), Err(slave)) => told(master, slave),
    }
}

fn judge_datagram(read: &Datagram) {
    assert!(read.envelope.number > 0);
    match &read.message {
        Message::Command(command) => {
            let samples = command.samples.as_slice();
            assert!((1..=32).contains(&samples.len()));
            assert!(samples.is_sorted_by(|one, next| one.stamp < next.stamp));
            let in_j = command.port.map_or(0.0, |port| port.in_j);
            assert!(in_j.is_finite() && in_j >= 0.0);
        }
        Message::Update(raw) => {
            assert!(raw.sequence > 0);
            for (stiffness_n_per_m, damping_ns_per_m) in COUPLINGS {
                let coupling = Coupling {
                    stiffness_n_per_m,
                    damping_ns_per_m,
                };
                if let Ok(update) = raw.accept(&coupling) {
                    judge_state(&update.state);
                    assert_eq!(Update::<RawState>::from(&update), *raw, "it was changed");
                }
            }
        }
        Message::Scene(scene) => {
            let object = scene.object;
            let numbers = [object.position, scene.tool, scene.force];
            assert!(
                numbers
                    .iter()
                    .all(|of| of.x.is_finite() && of.y.is_finite())
            );
            assert!(object.angle.is_finite());
        }
        Message::Tool(tool) => assert!(tool.in_j.is_finite() && tool.in_j >= 0.0),
        Message::Heartbeat => {}
    }
}

/// What a model is made of is finite and within what the documents promise.
pub(super) fn judge_state(state: &ModelState) {
    let numbers = state.params().to_array();
    for (number, (least, most)) in numbers.into_iter().zip(ACCEPTED) {
        assert!(
            (least..=most).contains(&number),
            "{number} is not within {least} to {most}"
        );
    }
    let (pose, twist, footprint) = (state.pose(), state.twist(), state.footprint());
    let within =
        |number: f64, most: f64| assert!(number.abs() <= most, "{number} is beyond {most}");
    within(pose.position.x, 5.0);
    within(pose.position.y, 5.0);
    within(pose.angle, 6283.0);
    within(twist.linear.x, 10.0);
    within(twist.linear.y, 10.0);
    within(twist.angular, 100.0);
    for face in Face::ALL {
        assert!((0.01..=1.0).contains(&footprint.offset(face)));
    }
}

pub(super) fn stream(input: &[u8]) -> Outcome {
    let [master, slave] = [Side::Master, Side::Slave].map(|from| {
        StreamMessage::decode(input, from).inspect(|read| {
            let mut out = [0; STREAM_MESSAGE_MAX];
            let length = read.encode(&mut out).unwrap();
            assert_eq!(&out[..length], input, "it is written otherwise");
            assert!(read.kind().is_sent_by(from));
        })
    });
    match (master, slave) {
        (Ok(read), _) | (_, Ok(read)) => judge_stream(&read),
        (Err(master), Err(slave)) => told(master, slave),
    }
}

fn judge_stream(read: &StreamMessage<'_>) -> Outcome {
    let kind = u64::from(read.kind().number());
    match read {
        StreamMessage::Hello(hello) => match hello.accept() {
            Ok(hello) => {
                judge_hello(&hello);
                Outcome::taken(kind)
            }
            Err(why) => Outcome::refused(&why),
        },
        StreamMessage::Welcome(raw) => match raw.accept(&raw.settings.coupling) {
            Ok(welcome) => {
                judge_coupling(&welcome.settings.coupling);
                judge_state(&welcome.state);
                assert!(welcome.tool.x.abs() <= 5.0 && welcome.tool.y.abs() <= 5.0);
                fits_a_line(&format!("{} {:?}", welcome.scheme, welcome.program));
                Outcome::taken(kind)
            }
            Err(why) => Outcome::refused(&why),
        },
        StreamMessage::Refused(_) => Outcome::taken(kind),
        StreamMessage::Farewell(farewell) => {
            halves(farewell.report);
            Outcome::taken(kind)
        }
    }
}

fn judge_hello(hello: &Hello) {
    judge_coupling(&hello.coupling);
    assert!((1..=32).contains(&hello.samples_per_command) && hello.scene_hz <= 60);
    assert!(hello.hip.x.abs() <= 5.0 && hello.hip.y.abs() <= 5.0);
    fits_a_line(&format!("{} {:?}", hello.program, hello.program));
    assert!(format!("{hello:?}").contains("secret"));
}

fn judge_coupling(coupling: &Coupling) {
    assert!((50.0..=10_000.0).contains(&coupling.stiffness_n_per_m));
    assert!(coupling.damping_ns_per_m.is_finite() && coupling.damping_ns_per_m >= 0.0);
}

/// A text that is shown neither steers a terminal nor begins a line.
pub(super) fn fits_a_line(text: &str) {
    let unfit = |c: char| {
        c.is_control()
            || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}')
    };
    assert!(!text.contains(unfit), "{text:?}");
}

pub(super) fn report(input: &[u8]) -> Outcome {
    halves(input);
    Outcome::of(serde_json::from_slice::<SlaveHalf>(input))
}

/// Either half of a report as the other end reads and prints it.
fn halves(report: &[u8]) {
    if let Some(other) = read_twice::<SlaveHalf>(report) {
        prints(&RunReport::from(MasterSession {
            seed: 1,
            duration_s: 1.0,
            ending: Ending::Finished,
            own: MasterHalf::default(),
            other: Some(other),
            configuration: (),
        }));
    }
    if let Some(other) = read_twice::<MasterHalf>(report) {
        prints(&RunReport::from(SlaveSession {
            seed: 1,
            duration_s: 1.0,
            ending: Ending::Finished,
            own: SlaveHalf::default(),
            other: Some(other),
            configuration: (),
        }));
    }
}

/// What is read is what is read of it once it has been written again.
fn read_twice<T: Serialize + DeserializeOwned + PartialEq + std::fmt::Debug>(
    report: &[u8],
) -> Option<T> {
    let read: T = serde_json::from_slice(report).ok()?;
    let again: T = serde_json::from_slice(&serde_json::to_vec(&read).unwrap()).unwrap();
    assert_eq!(read, again);
    Some(read)
}

/// A report shows in full and in brief, holds no number that is none, and nothing that steers a terminal.
fn prints(report: &RunReport<()>) {
    let shown = format!("{report}\n{}", Brief(report));
    shown.lines().for_each(fits_a_line);
    let json = serde_json::to_string(report).unwrap();
    assert!(!json.contains("NaN") && !json.contains("inf"), "{json}");
}
