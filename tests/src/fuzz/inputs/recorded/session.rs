//! A session of some ticks in virtual time: both ends, the datagrams between them without a network, and what each records.

use mmt_client::again::MasterSetting;
use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceProfile;
use mmt_client::end::{MasterEnd, MasterGiven};
use mmt_server::end::{SlaveEnd, SlaveGiven};
use mmt_server::slave::SlaveConfig;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::pairing::Token;
use mmt_shared::record::digest::RunDigest;
use mmt_shared::record::messages::{Arrival, MasterTick, Session, SlaveTick, Stamp};
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{Claim, DATAGRAM_MAX, Hello, Label, Role};

use super::kept::{Kept, Topical};

/// Ticks of each end.
const TICKS: u64 = 6;

/// A session of some ticks: its messages, and the file.
pub(super) fn recorded() -> (Vec<Topical>, Vec<u8>) {
    let mut kept = Kept::new();
    let (mut master, mut slave) = begun(&mut kept);
    let mut down = Vec::new();
    for tick in 0..TICKS {
        let up = master.tick(tick, down, &mut kept);
        down = slave.tick(up, &mut kept);
    }
    kept.put_standing();
    kept.finish()
}

/// Both ends, and what their sessions are recorded as.
fn begun(kept: &mut Kept) -> (Master, Slave) {
    let device = DeviceProfile::default();
    let (hello, config) = (hello(&device), SlaveConfig::default());
    let (now, slave_now) = (Time::from_millis(100), Time::from_millis(9000));
    let slave = SlaveEnd::of_session(slave_now, &config, &hello, None).unwrap();
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
    let numbered = |session: Session| Session {
        session: 1,
        stamp: Stamp(1),
        ..session
    };
    let of_slave = mmt_server::again::session(slave_now, &config, &hello, None, &());
    kept.put("/master/session", &numbered(setting.session(&())));
    kept.put("/slave/session", &numbered(of_slave));
    let master = Master {
        end: setting.end().unwrap(),
        now,
        from: welcome.tool,
        index: 0,
        digest: RunDigest::default(),
    };
    let slave = Slave {
        end: slave,
        now: slave_now,
        index: 0,
        digest: RunDigest::default(),
    };
    (master, slave)
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

/// The master's end at its clock.
struct Master {
    end: MasterEnd,
    now: Time,
    /// Where its hand begins.
    from: Vec2,
    index: u64,
    digest: RunDigest,
}

impl Master {
    /// Takes what has arrived, ticks, and gives what it sends.
    fn tick(&mut self, tick: u64, arrived: Vec<Vec<u8>>, kept: &mut Kept) -> Vec<Vec<u8>> {
        self.now += TICK;
        let now = self.now;
        for datagram in arrived {
            self.end.handle_datagram(now, &datagram);
            let arrival = arrival(&mut self.index, now, datagram);
            kept.put("/master/arrivals", &arrival);
        }
        let reading = self.from + Vec2::new(1e-4 * tick as f64, 0.0);
        let given = MasterGiven::held_at(reading);
        let done = self.end.tick(now, &given);
        self.digest.tick(&done);
        let hip = done.sample.hip.metres();
        let ticked = MasterTick {
            stamp: Stamp(tick),
            session: 1,
            index: self.index,
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
            f_m_x_n: done.displayed.x,
            f_m_y_n: done.displayed.y,
            hand_x_n: done.hand_force.x,
            hand_y_n: done.hand_force.y,
            in_contact: false,
            link: done.link.name().to_owned(),
            digest: self.digest.value(),
        };
        kept.put("/master/ticks", &ticked);
        self.index += 1;
        let (mut out, mut sent) = ([0; DATAGRAM_MAX], Vec::new());
        while let Some(length) = self.end.poll_transmit(now, &mut out).unwrap() {
            self.digest.datagram(&out[..length]);
            sent.push(out[..length].to_vec());
        }
        sent
    }
}

/// The slave's end at its clock.
struct Slave {
    end: SlaveEnd,
    now: Time,
    index: u64,
    digest: RunDigest,
}

impl Slave {
    /// Takes what has arrived, ticks, and gives what it sends.
    fn tick(&mut self, arrived: Vec<Vec<u8>>, kept: &mut Kept) -> Vec<Vec<u8>> {
        self.now += TICK;
        let now = self.now;
        for datagram in arrived {
            self.end.handle_datagram(now, &datagram);
            let arrival = arrival(&mut self.index, now, datagram);
            kept.put("/slave/arrivals", &arrival);
        }
        let done = self.end.tick(now, &SlaveGiven::default());
        self.digest.tick(&done);
        let tool = done.map(|done| done.tool);
        let ticked = slave_tick(self.index, now, tool, self.digest.value());
        kept.put("/slave/ticks", &ticked);
        self.index += 1;
        let (mut out, mut sent) = ([0; DATAGRAM_MAX], Vec::new());
        while let Some(length) = self.end.poll_transmit(now, &mut out).unwrap() {
            self.digest.datagram(&out[..length]);
            sent.push(out[..length].to_vec());
        }
        sent
    }
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
