//! A short session as its record has it, with the digests that it gives.

#![allow(
    clippy::disallowed_types,
    reason = "the writer of a record hands its bytes to nobody but a file"
)]

use std::io::{self, Write};
use std::sync::{Arc, Mutex};

use mmt_client::again::MasterSetting;
use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceProfile;
use mmt_server::end::SlaveEnd;
use mmt_server::slave::SlaveConfig;
use mmt_shared::io::record::RecordWriter;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::pairing::Token;
use mmt_shared::record::cdr::CdrWriter;
use mmt_shared::record::digest::RunDigest;
use mmt_shared::record::messages::{
    Arrival, Link, Loop, MasterTick, Message, Packet, Parameters, Reading, Session, SlaveTick,
    Stamp,
};
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{Claim, DATAGRAM_MAX, Hello, Label, Role};

/// Ticks of each end.
const TICKS: u64 = 6;

/// Collects messages with their topics, and writes them into a record.
struct Kept {
    messages: Vec<(&'static str, Vec<u8>)>,
    out: RecordWriter,
}

impl Kept {
    fn put<M: Message>(&mut self, topic: &'static str, message: &M) {
        let mut bytes = CdrWriter::default();
        message.write(bytes.begin());
        self.messages.push((topic, bytes.message().to_vec()));
        self.out
            .put(topic, Stamp(1_700_000_000_000_000_000), message);
    }
}

/// Where a record goes.
#[derive(Clone, Default)]
struct Memory(Arc<Mutex<Vec<u8>>>);

impl Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn hello(device: &DeviceProfile) -> Hello {
    Hello {
        token: Token::new([0; 32]),
        role: Role::Operator,
        claim: Claim::IfFree,
        coupling: device.coupling(),
        samples_per_command: 1,
        architecture: Architecture::Mmt,
        scene_hz: 0,
        hip: Vec2::new(-0.25, 0.0),
        program: Label::clipped("fuzz"),
    }
}

/// A session of some ticks: its messages, and the file.
fn recorded() -> (Vec<(&'static str, Vec<u8>)>, Vec<u8>) {
    let memory = Memory::default();
    let mut kept = Kept {
        messages: Vec::new(),
        out: RecordWriter::create(memory.clone()),
    };
    let device = DeviceProfile::default();
    let (hello, config) = (hello(&device), SlaveConfig::default());
    let (mut now, mut slave_now) = (Time::from_millis(100), Time::from_millis(9000));
    let mut slave = SlaveEnd::of_session(slave_now, &config, &hello, None).unwrap();
    let welcome = slave.slave().welcome(Token::new([0; 32]), "any", "fuzz");
    let setting = MasterSetting {
        began: now,
        welcome,
        architecture: Architecture::Mmt,
        limits: device.limits(),
        commands: CommandConfig {
            samples_per_command: 1,
            ..CommandConfig::default()
        },
    };
    let mut master = setting.end().unwrap();
    let numbered = |session: Session| Session {
        session: 1,
        stamp: Stamp(1),
        ..session
    };
    kept.put("/master/session", &numbered(setting.session(&())));
    kept.put(
        "/slave/session",
        &numbered(mmt_server::again::session(
            slave_now,
            &config,
            &hello,
            None,
            &(),
        )),
    );
    let (mut of_master, mut of_slave) = (RunDigest::default(), RunDigest::default());
    let (mut up, mut down) = (Vec::<Vec<u8>>::new(), Vec::<Vec<u8>>::new());
    let mut index = [0; 2];
    let mut out = [0; DATAGRAM_MAX];
    for tick in 0..TICKS {
        now += TICK;
        slave_now += TICK;
        for datagram in std::mem::take(&mut down) {
            master.handle_datagram(now, &datagram);
            kept.put("/master/arrivals", &arrival(&mut index[0], now, datagram));
        }
        let reading = welcome.tool + Vec2::new(1e-4 * tick as f64, 0.0);
        master.stop(false);
        master.hold(true);
        let done = master.tick(now, reading);
        of_master.tick(&done);
        let hip = done.sample.hip.metres();
        kept.put(
            "/master/ticks",
            &MasterTick {
                stamp: Stamp(tick),
                session: 1,
                index: index[0],
                deadline_ns: now.as_nanos(),
                lateness_ns: 5,
                skipped: 0,
                reading_x_m: reading.x,
                reading_y_m: reading.y,
                engaged: true,
                releases: false,
                stops: false,
                sent_ns: now.as_nanos(),
                hip_x_m: hip.x,
                hip_y_m: hip.y,
                f_m_x_n: done.felt.x,
                f_m_y_n: done.felt.y,
                hand_x_n: done.hand_force.x,
                hand_y_n: done.hand_force.y,
                in_contact: false,
                link: done.link.name().to_owned(),
                digest: of_master.value(),
            },
        );
        index[0] += 1;
        while let Some(length) = master.poll_transmit(now, &mut out).unwrap() {
            of_master.datagram(&out[..length]);
            up.push(out[..length].to_vec());
        }
        for datagram in std::mem::take(&mut up) {
            slave.handle_datagram(slave_now, &datagram);
            kept.put(
                "/slave/arrivals",
                &arrival(&mut index[1], slave_now, datagram),
            );
        }
        slave.stop(false);
        let done = slave.tick(slave_now);
        of_slave.tick(&done);
        kept.put(
            "/slave/ticks",
            &slave_tick(
                index[1],
                slave_now,
                done.map(|done| done.tool),
                of_slave.value(),
            ),
        );
        index[1] += 1;
        while let Some(length) = slave.poll_transmit(slave_now, &mut out).unwrap() {
            of_slave.datagram(&out[..length]);
            down.push(out[..length].to_vec());
        }
    }
    standing(&mut kept);
    assert_eq!(kept.out.finish(), None);
    let bytes = memory.0.lock().unwrap().clone();
    (kept.messages, bytes)
}

fn arrival(index: &mut u64, now: Time, datagram: Vec<u8>) -> Arrival {
    let arrival = Arrival {
        stamp: Stamp(2),
        session: 1,
        index: *index,
        at_ns: now.as_nanos(),
        datagram,
    };
    *index += 1;
    arrival
}

fn slave_tick(index: u64, now: Time, tool: Option<Vec2>, digest: u64) -> SlaveTick {
    let at = tool.unwrap_or(Vec2::new(f64::NAN, f64::NAN));
    SlaveTick {
        stamp: Stamp(3),
        session: 1,
        index,
        deadline_ns: now.as_nanos(),
        lateness_ns: 7,
        skipped: 0,
        stops: false,
        plant: Vec::new(),
        plant_anew: false,
        sent_ns: now.as_nanos(),
        plays: tool.is_some(),
        sample_ns: 1,
        tool_x_m: at.x,
        tool_y_m: at.y,
        f_s_x_n: 0.0,
        f_s_y_n: 0.0,
        true_x_n: 0.0,
        true_y_n: 0.0,
        f_shadow_x_n: 0.0,
        f_shadow_y_n: 0.0,
        f_m_x_n: at.x,
        f_m_y_n: at.y,
        in_contact: false,
        object_x_m: 0.0,
        object_y_m: 0.0,
        object_angle_rad: 0.0,
        update: "timer".to_owned(),
        digest,
    }
}

/// What else a record has.
fn standing(kept: &mut Kept) {
    let (stamp, session) = (Stamp(1_700_000_000_123_456_789), 1);
    let packet = |direction: &str, number: u32, fate: &str| Packet {
        stamp: Stamp(stamp.0 + u64::from(number) * 1_000_000),
        session,
        direction: direction.to_owned(),
        number,
        sent_ns: u64::from(number) * 1_000_000,
        bytes: 60,
        kind: "command".to_owned(),
        update: 0,
        cause: String::new(),
        fate: fate.to_owned(),
    };
    kept.put("/master/packets", &packet("up", 1, "sent"));
    kept.put("/slave/packets", &packet("up", 1, "newest"));
    kept.put(
        "/slave/parameters",
        &Parameters {
            stamp,
            session,
            m_kg: 0.7,
            b_ns_per_m: 3.0,
            c_n: 2.0,
            covariance: [f64::NAN; 9],
        },
    );
    let link = Link {
        stamp,
        session,
        rtt_ms: 12.0,
        up_expected: 10,
        up_received: 9,
        down_expected: 5,
        down_received: 5,
    };
    kept.put("/master/link", &link);
    let about = Loop {
        stamp,
        session,
        ticks: 1000,
        skipped: 1,
        lateness_mean_us: 12.0,
        lateness_max_us: 99.0,
        missed: 0,
    };
    kept.put("/slave/loop", &about);
    kept.put(
        "/master/readings",
        &Reading {
            stamp,
            session,
            own_s: 1.5,
            x_m: 0.1,
            y_m: 0.2,
            held: true,
        },
    );
}

fn number_of(topic: &str) -> Option<u8> {
    TOPICS
        .iter()
        .position(|known| *known == topic)
        .map(|number| number as u8)
}

/// One message each, behind the number of its topic.
pub(in crate::fuzz) fn messages() -> Vec<Vec<u8>> {
    let mut seeds = Vec::new();
    let mut seen = [false; TOPICS.len()];
    for (topic, message) in recorded().0 {
        let Some(number) = number_of(topic) else {
            continue;
        };
        let short =
            message.len() < 1400 && !std::mem::replace(&mut seen[usize::from(number)], true);
        if short {
            seeds.push([&[number], message.as_slice()].concat());
        }
    }
    seeds
}

/// Whole files.
pub(in crate::fuzz) fn records() -> Vec<Vec<u8>> {
    let (_, file) = recorded();
    let cut = file[..file.len() * 2 / 3].to_vec();
    vec![file, cut]
}

/// All messages of a session, each behind the number of its topic and its length.
pub(in crate::fuzz) fn recorded_sessions() -> Vec<Vec<u8>> {
    let mut whole = Vec::new();
    for (topic, message) in recorded().0 {
        if let Some(number) = number_of(topic) {
            whole.push(number);
            whole.extend((message.len() as u16).to_le_bytes());
            whole.extend(message);
        }
    }
    vec![whole]
}

/// The messages of such an input.
pub(in crate::fuzz) fn messages_of(
    mut input: &[u8],
) -> impl Iterator<Item = (&'static str, &[u8])> {
    std::iter::from_fn(move || {
        let (head, rest) = input.split_first_chunk::<3>()?;
        let length = usize::from(u16::from_le_bytes([head[1], head[2]]));
        let (message, behind) = rest.split_at(length.min(rest.len()));
        input = behind;
        Some((TOPICS[usize::from(head[0]) % TOPICS.len()], message))
    })
}

/// Names of topics, in the order in which the first byte of a message means them.
pub(in crate::fuzz) const TOPICS: [&str; 11] = [
    "/master/ticks",
    "/slave/ticks",
    "/master/session",
    "/slave/session",
    "/master/arrivals",
    "/slave/arrivals",
    "/master/packets",
    "/slave/parameters",
    "/master/link",
    "/slave/loop",
    "/master/readings",
];
