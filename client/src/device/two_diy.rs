//! Haply 2DIY: frames of its board over a USB serial port, in the vendor's hAPI.
//!
//! Learnt from the vendor's Python client (PyPI `HaplyHAPI` 1.0.1: `Board`, `Device`) and its Java examples
//! (`HaplyHaptics/Haply-API-Java`); nothing is copied. The host speaks first, always; all numbers are little endian:
//!
//! ```text
//! 00 00                                        the board forgets its set-up
//! 01 id mm dd dd ee dd dd 00 00  4 × f32       motors and encoders: their ports as bits, their senses; no sensors, no PWM;
//!                                              offset (degrees) and counts a turn for each encoder
//! 02 id  2 × f32                               torques, Nm, in the order of the ports
//! id     2 × f32                               the answer to that alone: angles, degrees, in the order of the ports
//! ```
//!
//! Motor 1 and encoder 1 are at port 2, motor 2 and encoder 2 at port 1. The board keeps the torques that it got last: it has to be
//! sent zero. Its encoders count from where the arms stand when it is set up: they have to be at the vendor's start then.
//!
//! Pure. The answer has no stamp: its arrival is one. Velocity is the difference of the angles between two answers through a
//! low-pass of 20 Hz (first order), times the Jacobian: a step of an encoder is 0.1 mm at the tool, 0.1 m/s in a millisecond.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::plug::{PlugCounts, singles};
use mmt_shared::time::Time;

use super::hand::Hand;
use super::link::{DeviceLinkConfig, DeviceLinkError, HandOutput, Reading, Version};
use super::pantograph::{Pantograph, Posture};
use crate::operator::pointer::HandEvent;

/// The board forgets its set-up.
pub const RESET: [u8; 2] = [0, 0];
/// Bytes of the set-up.
pub const SET_UP_BYTES: usize = 26;
/// Bytes of a frame with torques.
pub const TORQUES_BYTES: usize = 10;
/// Bytes of an answer.
pub const ANSWER_BYTES: usize = 9;

/// The board's number, as in the vendor's examples.
const ID: u8 = 5;
/// Ports 1 and 2 as bits.
const PORTS: u8 = 0b11;
/// No sensor and no PWM pin.
const NONE: [u8; 2] = [0, 0];
/// An angle beyond two turns is none, degrees.
const ANGLE_MAX_DEG: f64 = 720.0;
/// Time constant of the low-pass on the motors' speeds, s: 20 Hz.
const SPEED_TAU_S: f64 = 1.0 / (20.0 * std::f64::consts::TAU);

/// A 2DIY at the haptic loop.
#[derive(Clone, Debug)]
pub struct TwoDiy {
    config: DeviceLinkConfig,
    hand: Hand,
    counts: PlugCounts,
    bars: Pantograph,
    /// The newest posture that could be.
    posture: Option<Posture>,
    /// The newest angles, rad, when they came, and how fast they change, rad/s.
    turned: Option<([f64; 2], Time, [f64; 2])>,
}

impl TwoDiy {
    /// One that has not answered yet.
    ///
    /// # Errors
    /// Names the first number that is not accepted.
    pub fn try_new(config: DeviceLinkConfig) -> Result<Self, DeviceLinkError> {
        Ok(Self {
            config,
            hand: Hand::try_new(config)?,
            counts: PlugCounts::default(),
            bars: Pantograph::new(config.version),
            posture: None,
            turned: None,
        })
    }

    /// What became of its answers.
    pub fn counts(&self) -> &PlugCounts {
        &self.counts
    }

    /// The newest reading as it came, once.
    pub fn seen(&mut self) -> Option<Reading> {
        self.hand.seen()
    }

    /// The frame that sets the board up.
    pub fn set_up(&self) -> [u8; SET_UP_BYTES] {
        // senses (1: counter-clockwise), offsets and counts a turn of ports 1 and 2
        let (senses, numbers) = match self.config.version {
            Version::Two => ([0, 1], [-61.0_f32, 10_752.0, 241.0, 10_752.0]),
            Version::Three => ([1, 1], [12.0, 4880.0, 168.0, 4880.0]),
        };
        let [one, two] = senses;
        let parts: [&[u8]; 3] = [&[1, ID, PORTS, one, two], &[PORTS, one, two], &NONE];
        let numbers = numbers.map(f32::to_le_bytes);
        let bytes = parts
            .into_iter()
            .flatten()
            .chain(numbers.iter().flatten())
            .copied();
        filled(bytes)
    }

    /// Takes in what came in answer to torques, and gives what the hand does by it. Of several answers the last is the newest: a
    /// board that was late answers all that it was asked.
    pub fn handle(&mut self, now: Time, answers: &[u8], mut give: impl FnMut(HandEvent)) {
        self.hand.note_packet(now, &mut give);
        let (whole, rest) = answers.as_chunks::<ANSWER_BYTES>();
        let newest = whole.split_last().filter(|_| rest.is_empty());
        let Some(([ID, numbers @ ..], late)) = newest else {
            self.counts.malformed += 1;
            self.lose(give);
            return;
        };
        self.counts.taken += 1;
        self.counts.late += late.len() as u64;
        let [second, first] = singles::<2>(numbers);
        let degrees = [first, second];
        let can_be = degrees.iter().all(|angle| angle.abs() <= ANGLE_MAX_DEG);
        let angles = degrees.map(f64::to_radians);
        let posture = self.bars.posture(angles).filter(|_| can_be);
        let Some(posture) = posture else {
            self.counts.nonsense += 1;
            self.lose(give);
            return;
        };
        let velocity = posture.velocity(self.speeds(angles, now));
        let reading = Reading {
            stamp_ns: now.as_nanos(),
            place: [posture.tool.x, posture.tool.y, 0.0],
            velocity: [velocity.x, velocity.y, 0.0],
            buttons: 0,
        };
        let could_be = self.hand.take(&reading, give);
        self.counts.nonsense += u64::from(!could_be);
        self.posture = could_be.then_some(posture);
    }

    /// Nothing has come in this tick. Returns whether the device has been silent for so long that the hand is let go now.
    pub fn miss(&mut self, now: Time, give: impl FnMut(HandEvent)) -> bool {
        let silent = self.hand.is_silent(now);
        if silent {
            self.lose(give);
        }
        silent
    }

    /// The frame with the torques that the newest tick asks for.
    pub fn torques(&mut self, now: Time, output: &HandOutput) -> [u8; TORQUES_BYTES] {
        let [x, y, _] = self.hand.act(now, output).force;
        let silent = self.hand.is_silent(now);
        let posture = self.posture.filter(|_| !silent);
        let most = self.config.torque_max_nm;
        let torques = posture.map(|posture| posture.torques(Vec2::new(x, y), most));
        torque_frame(torques.unwrap_or_default())
    }

    /// The device is gone: the hand is let go, and nothing of before counts.
    pub fn lose(&mut self, give: impl FnMut(HandEvent)) {
        self.hand.anew(give);
        (self.posture, self.turned) = (None, None);
    }

    /// How fast the motors turn, rad/s.
    fn speeds(&mut self, angles: [f64; 2], now: Time) -> [f64; 2] {
        let mut speeds = [0.0; 2];
        if let Some((before, at, was)) = self.turned {
            let passed_s = now.saturating_since(at).as_secs_f64();
            let share = passed_s / (passed_s + SPEED_TAU_S);
            let turned = angles.into_iter().zip(before).zip(was);
            for (speed, ((angle, before), was)) in speeds.iter_mut().zip(turned) {
                let raw = if passed_s > 0.0 {
                    (angle - before) / passed_s
                } else {
                    was
                };
                *speed = was + share * (raw - was);
            }
        }
        self.turned = Some((angles, now, speeds));
        speeds
    }
}

/// The frame with no torques: it has to be the last that a board gets.
pub fn no_torques() -> [u8; TORQUES_BYTES] {
    torque_frame([0.0; 2])
}

/// A frame with the torques of motors 1 and 2, Nm.
fn torque_frame([first, second]: [f64; 2]) -> [u8; TORQUES_BYTES] {
    let numbers = [second as f32, first as f32].map(f32::to_le_bytes);
    filled([2, ID].into_iter().chain(numbers.into_iter().flatten()))
}

/// So many bytes of these; 0 where there are too few.
fn filled<const BYTES: usize>(bytes: impl IntoIterator<Item = u8>) -> [u8; BYTES] {
    let mut bytes = bytes.into_iter();
    std::array::from_fn(|_| bytes.next().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::super::link::DeviceKind;
    use super::*;

    fn of(version: Version) -> TwoDiy {
        TwoDiy::try_new(DeviceLinkConfig {
            version,
            ..DeviceLinkConfig::of(DeviceKind::TwoDiy)
        })
        .unwrap()
    }

    fn hex(bytes: &[u8]) -> String {
        bytes.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    fn answer(id: u8, degrees: [f32; 2]) -> Vec<u8> {
        let numbers = [degrees[1], degrees[0]].map(f32::to_le_bytes);
        [&[id][..], numbers.as_flattened()].concat()
    }

    #[test]
    fn the_set_up_is_byte_for_byte_what_the_vendors_client_sends() {
        // as the vendor's client 1.0.1 wrote them to an emulator, `tests/devices/check_2diy.py` compares again
        assert_eq!(
            hex(&of(Version::Three).set_up()),
            "0105030101030101000000004041008098450000284300809845"
        );
        assert_eq!(
            hex(&of(Version::Two).set_up()),
            "0105030001030001000000\
             0074c2000028460000714300002846"
        );
        assert_eq!(hex(&no_torques()), "02050000000000000000");
    }

    #[test]
    fn torques_and_angles_go_in_the_order_of_the_ports() {
        let frame = torque_frame([1.0, -2.0]);
        assert_eq!(singles::<2>(&frame[2..]), [-2.0, 1.0]);
        let mut device = of(Version::Three);
        device.handle(Time::from_millis(1), &answer(5, [150.0, 20.0]), |_| ());
        let place = device.seen().unwrap().place;
        let expected = Pantograph::new(Version::Three)
            .posture([150.0_f64, 20.0].map(f64::to_radians))
            .unwrap();
        assert!((place[0] - expected.tool.x).abs() < 1e-9, "{place:?}");
        assert!((place[1] - expected.tool.y).abs() < 1e-9, "{place:?}");
    }

    #[test]
    fn what_is_no_answer_is_malformed_and_what_cannot_be_is_nonsense() {
        let mut device = of(Version::Three);
        let whole = answer(5, [150.0, 20.0]);
        for bad in [
            &whole[..8],
            &[&whole[..], &[5]].concat(),
            &answer(6, [150.0, 20.0]),
            &[],
        ] {
            device.handle(Time::from_millis(1), bad, |_| ());
        }
        assert_eq!((device.counts.malformed, device.counts.taken), (4, 0));
        for bad in [
            [f32::NAN, 0.0],
            [f32::INFINITY, 0.0],
            [1e9, 0.0],
            [83.18, 96.82],
        ] {
            device.handle(Time::from_millis(2), &answer(5, bad), |_| ());
        }
        assert_eq!((device.counts.nonsense, device.counts.taken), (4, 4));
    }

    #[test]
    fn the_speed_is_that_of_the_tool_once_the_filter_has_settled() {
        let mut device = of(Version::Three);
        let bars = Pantograph::new(Version::Three);
        let (mut seen, speed) = (Reading::default(), 0.05);
        for ms in 0..400_u32 {
            let x = 0.009 + speed * f64::from(ms) * 1e-3;
            let angles = bars.angles(Vec2::new(x, 0.09)).unwrap();
            let degrees = angles.map(|angle| angle.to_degrees() as f32);
            device.handle(Time::from_millis(ms.into()), &answer(5, degrees), |_| ());
            seen = device.seen().unwrap();
        }
        let [x, y, _] = seen.velocity;
        assert!((x - speed).abs() < 0.01 * speed, "{x}");
        assert!(y.abs() < 0.02 * speed, "{y}");
    }
}
