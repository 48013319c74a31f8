//! The protocols of the devices, spoken from the device's side.

use std::net::SocketAddr;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::plug::{DEVICE_BYTES, PlugHead, PlugKind, PlugToken, decode, encode, singles};
use mmt_shared::time::Time;
use serde_json::Value;

use crate::device::inverse3::Inverse3;
use crate::device::link::{
    Axis, DeviceKind, DeviceLink, DeviceLinkConfig, Dialect, HandOutput, Version,
};
use crate::device::pantograph::Pantograph;
use crate::device::two_diy::{ANSWER_BYTES, TwoDiy};
use crate::operator::pointer::HandEvent;

/// What a device does, in its own words.
pub(super) trait Rig {
    fn name(&self) -> &'static str;
    fn config(&self) -> DeviceLinkConfig;
    /// It is there (m, device), its button down or not.
    fn reading(&mut self, now: Time, place: [f64; 3], down: bool, give: &mut dyn FnMut(HandEvent));
    /// Nothing comes.
    fn silence(&mut self, now: Time, give: &mut dyn FnMut(HandEvent));
    /// What nonsense it can send.
    fn nonsense(&self) -> &'static [&'static str];
    /// It sends that.
    fn nonsensical(&mut self, kind: usize, now: Time, give: &mut dyn FnMut(HandEvent));
    /// What it is commanded to press with at its tool, N, device.
    fn acts(&mut self, now: Time, output: &HandOutput) -> [f64; 3];
}

/// Every device in every version and dialect; those of a kind stand together.
pub(super) fn rigs() -> Vec<Box<dyn Rig>> {
    vec![
        Box::new(Link::new()),
        Box::new(Cursor::new("inverse3 of 3.5", "3.5.0.0", Dialect::Auto)),
        Box::new(Cursor::new("inverse3 of 3.1", "3.1.1.0", Dialect::Auto)),
        Box::new(Cursor::new(
            "inverse3 by its key",
            "3.5.0.0",
            Dialect::Values,
        )),
        Box::new(Board::new("2diy of version 2", Version::Two)),
        Box::new(Board::new("2diy of version 3", Version::Three)),
    ]
}

const TOKEN: PlugToken = PlugToken::new([3; 16]);

struct Link {
    config: DeviceLinkConfig,
    link: DeviceLink,
    sequence: u32,
    acts: [f64; 3],
}

impl Link {
    fn new() -> Self {
        let config = DeviceLinkConfig {
            axes: [Axis::MinusZ, Axis::X],
            scale: 2.0,
            workspace_m: 0.1,
            ..DeviceLinkConfig::default()
        };
        Self {
            config,
            link: DeviceLink::try_new(config, TOKEN).unwrap(),
            sequence: 0,
            acts: [0.0; 3],
        }
    }

    fn send(&mut self, now: Time, numbers: [f32; 6], down: bool, give: &mut dyn FnMut(HandEvent)) {
        self.sequence += 1;
        let head = PlugHead {
            flags: u16::from(down),
            sequence: self.sequence,
            answers: 0,
            stamp_ns: 1_000_000_000_000 + now.as_nanos(),
        };
        let numbers = numbers.map(f32::to_le_bytes);
        let packet: [u8; DEVICE_BYTES] = encode(PlugKind::Reading, &TOKEN, &head, numbers);
        let from = SocketAddr::from(([127, 0, 0, 1], 9));
        assert!(self.link.handle(now, from, &packet, give));
    }
}

impl Rig for Link {
    fn name(&self) -> &'static str {
        "link"
    }

    fn config(&self) -> DeviceLinkConfig {
        self.config
    }

    fn reading(
        &mut self,
        now: Time,
        [x, y, z]: [f64; 3],
        down: bool,
        give: &mut dyn FnMut(HandEvent),
    ) {
        let numbers = [x, y, z, 0.0, 0.0, 0.0].map(|n| n as f32);
        self.send(now, numbers, down, give);
    }

    fn silence(&mut self, _: Time, _: &mut dyn FnMut(HandEvent)) {}

    fn nonsense(&self) -> &'static [&'static str] {
        &["no place", "an endless speed", "far outside"]
    }

    fn nonsensical(&mut self, kind: usize, now: Time, give: &mut dyn FnMut(HandEvent)) {
        let (nan, inf) = (f32::NAN, f32::INFINITY);
        let numbers = [
            [nan, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, inf, 0.0, 0.0],
            [1e30, 0.0, 0.0, 0.0, 0.0, 0.0],
        ];
        self.send(now, numbers[kind], true, give);
    }

    /// A packet is answered, and nothing is sent without one: a silent device gets none, and has to let go by itself.
    fn acts(&mut self, now: Time, output: &HandOutput) -> [f64; 3] {
        let packet = self.link.answer(now, output);
        let (_, numbers) = decode(PlugKind::Force, DEVICE_BYTES, &TOKEN, &packet).unwrap();
        let [x, y, z, ..] = singles::<6>(numbers);
        self.acts = [x, y, z];
        self.acts
    }
}

struct Cursor {
    name: &'static str,
    config: DeviceLinkConfig,
    device: Inverse3,
    dialect: &'static str,
}

impl Cursor {
    fn new(name: &'static str, version: &str, dialect: Dialect) -> Self {
        let config = DeviceLinkConfig {
            dialect,
            ..DeviceLinkConfig::of(DeviceKind::Inverse3)
        };
        let mut device = Inverse3::try_new(config).unwrap();
        device.begin(Some(version), |_| ());
        let newer = version.starts_with("3.5") && dialect == Dialect::Auto;
        let dialect = if newer { "vector" } else { "values" };
        Self {
            name,
            config,
            device,
            dialect,
        }
    }
}

impl Rig for Cursor {
    fn name(&self) -> &'static str {
        self.name
    }

    fn config(&self) -> DeviceLinkConfig {
        self.config
    }

    fn reading(
        &mut self,
        now: Time,
        [x, y, z]: [f64; 3],
        down: bool,
        give: &mut dyn FnMut(HandEvent),
    ) {
        let frame = serde_json::json!({
            "inverse3": [{"device_id": "04BA", "state": {
                "cursor_position": {"x": x, "y": y, "z": z},
                "cursor_velocity": {"x": 0, "y": 0, "z": 0},
            }, "status": {"ready": true}}],
            "wireless_verse_grip": [{"device_id": "1", "state": {"buttons": {"a": down}}}],
        });
        self.device.handle(now, &frame.to_string(), give);
    }

    fn silence(&mut self, now: Time, give: &mut dyn FnMut(HandEvent)) {
        self.device.miss(now, give);
    }

    fn nonsense(&self) -> &'static [&'static str] {
        &[
            "no JSON",
            "no such number",
            "far outside",
            "no device",
            "a text for a number",
        ]
    }

    fn nonsensical(&mut self, kind: usize, now: Time, give: &mut dyn FnMut(HandEvent)) {
        let at = |x: &str| {
            format!(
                r#"{{"inverse3": [{{"device_id": "04BA", "state": {{"cursor_position": {{"x": {x}, "y": -0.12, "z": 0.15}}}}}}]}}"#
            )
        };
        let messages = [
            "{\"inverse3\": [{\"device_id".to_owned(),
            at("NaN"),
            at("1e30"),
            r#"{"inverse3": []}"#.to_owned(),
            at("\"0.0\""),
        ];
        self.device.handle(now, &messages[kind], give);
    }

    fn acts(&mut self, now: Time, output: &HandOutput) -> [f64; 3] {
        let message: Value = serde_json::from_str(&self.device.answer(now, output)).unwrap();
        let Some(command) = message.pointer("/inverse3/0/commands/set_cursor_force") else {
            return [0.0; 3];
        };
        assert_eq!(message["inverse3"][0]["device_id"], "04BA");
        ["x", "y", "z"].map(|axis| command[self.dialect][axis].as_f64().unwrap())
    }
}

/// A board with arms; the torques are turned to a force by their work, with difference quotients.
struct Board {
    name: &'static str,
    config: DeviceLinkConfig,
    device: TwoDiy,
    bars: Pantograph,
    angles: [f64; 2],
}

impl Board {
    fn new(name: &'static str, version: Version) -> Self {
        let file = crate::device::link::DeviceFile {
            version: Some(version),
            ..Default::default()
        };
        let config = file.device(DeviceKind::TwoDiy).unwrap();
        Self {
            name,
            config,
            device: TwoDiy::try_new(config).unwrap(),
            bars: Pantograph::new(version),
            angles: [0.0; 2],
        }
    }

    fn answer(id: u8, degrees: [f64; 2]) -> [u8; ANSWER_BYTES] {
        let [first, second] = degrees.map(|angle| (angle as f32).to_le_bytes());
        let mut answer = [id; ANSWER_BYTES];
        answer[1..5].copy_from_slice(&second);
        answer[5..].copy_from_slice(&first);
        answer
    }
}

impl Rig for Board {
    fn name(&self) -> &'static str {
        self.name
    }

    fn config(&self) -> DeviceLinkConfig {
        self.config
    }

    fn reading(
        &mut self,
        now: Time,
        [x, y, _]: [f64; 3],
        _: bool,
        give: &mut dyn FnMut(HandEvent),
    ) {
        self.angles = self.bars.angles(Vec2::new(x, y)).unwrap();
        let answer = Self::answer(5, self.angles.map(f64::to_degrees));
        self.device.handle(now, &answer, give);
    }

    fn silence(&mut self, now: Time, give: &mut dyn FnMut(HandEvent)) {
        self.device.miss(now, give);
    }

    fn nonsense(&self) -> &'static [&'static str] {
        &[
            "no angle",
            "an endless angle",
            "too short",
            "too long",
            "of another board",
            "at the rim",
        ]
    }

    fn nonsensical(&mut self, kind: usize, now: Time, give: &mut dyn FnMut(HandEvent)) {
        let degrees = self.angles.map(f64::to_degrees);
        let whole = Self::answer(5, degrees);
        let stretched = match self.config.version {
            Version::Two => [90.0, 90.0],
            Version::Three => [83.18, 96.82],
        };
        let answers: [&[u8]; 6] = [
            &Self::answer(5, [f64::NAN, degrees[1]]),
            &Self::answer(5, [degrees[0], f64::INFINITY]),
            &whole[..5],
            &[&whole[..], &whole[..3]].concat(),
            &Self::answer(7, degrees),
            &Self::answer(5, stretched),
        ];
        self.device.handle(now, answers[kind], give);
    }

    fn acts(&mut self, now: Time, output: &HandOutput) -> [f64; 3] {
        let frame = self.device.torques(now, output);
        assert_eq!(frame[..2], [2, 5]);
        let [second, first] = singles::<2>(&frame[2..]);
        let [a, b] = self.angles;
        let at = |a, b| self.bars.posture([a, b]).unwrap().tool;
        let (da, db) = (
            (at(a + 1e-6, b) - at(a - 1e-6, b)) / 2e-6,
            (at(a, b + 1e-6) - at(a, b - 1e-6)) / 2e-6,
        );
        // f of da·f = τ1 and db·f = τ2
        let determinant = da.x * db.y - da.y * db.x;
        let x = (first * db.y - second * da.y) / determinant;
        let y = (second * da.x - first * db.x) / determinant;
        [x, y, 0.0]
    }
}
