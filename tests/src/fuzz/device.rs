//! Haply's devices: no frame lets a hand do what it may not, or a force act on a hand that does not hold.

use std::time::Duration;

use mmt_client::device::inverse3::Inverse3;
use mmt_client::device::link::{DeviceKind, DeviceLinkConfig};
use mmt_client::device::two_diy::{ANSWER_BYTES, TwoDiy};
use mmt_shared::time::Time;

use super::outcome::Outcome;
use super::plug::{Held, output};

/// Lines, each a frame that comes a millisecond after the one before; one that is no text is handed over as such.
pub(super) fn inverse3(input: &[u8]) -> Outcome {
    let mut device = Inverse3::try_new(DeviceLinkConfig::of(DeviceKind::Inverse3)).unwrap();
    let mut held = Held::default();
    let version = input
        .first()
        .map(|byte| ["3.5.0", "3.1", "", "x.y"][usize::from(byte % 4)]);
    device.begin(version, |event| held.judge(event));
    let mut frames = 0;
    for (tick, line) in (1..).zip(input.split(|byte| *byte == b'\n')) {
        let now = Time::from_millis(tick);
        frames += 1;
        held.at(now);
        match std::str::from_utf8(line) {
            Ok(text) => device.handle(now, text, |event| held.judge(event)),
            Err(_) => device.handle_other(|event| held.judge(event)),
        }
        let counts = *device.counts();
        assert_eq!(counts.taken + counts.malformed, frames, "{counts:?}");
        judge_request(&device.answer(now, &output(tick)), &held);
    }
    let late = Time::from_millis(frames) + Duration::from_millis(200);
    held.at(late);
    device.miss(late, |event| held.judge(event));
    assert!(!held.is_held(), "a device that is silent is not held");
    let counts = device.counts();
    if counts.taken > 0 {
        return Outcome::taken(
            counts.nonsense.min(2) + 4 * counts.late.min(2) + 16 * counts.malformed.min(1),
        );
    }
    Outcome::refused(&"malformed")
}

/// What is sent is JSON with finite forces that a hand may feel.
fn judge_request(request: &str, held: &Held) {
    let value: serde_json::Value = serde_json::from_str(request).unwrap();
    let devices = value.get("inverse3").and_then(|devices| devices.as_array());
    for device in devices.into_iter().flatten() {
        let force = &device["commands"]["set_cursor_force"];
        let force = force.get("vector").or(force.get("values")).unwrap();
        let square: f64 = ["x", "y", "z"]
            .map(|axis| force[axis].as_f64().unwrap().powi(2))
            .iter()
            .sum();
        assert!(square.sqrt() <= 5.001, "{square}");
        assert!(
            held.may_feel() || square == 0.0,
            "a force on a hand that does not hold: {request}"
        );
    }
}

/// Records: the ms since the one before, the length of what came in bytes, and that.
pub(super) fn two_diy(input: &[u8]) -> Outcome {
    let config = DeviceLinkConfig::of(DeviceKind::TwoDiy);
    let mut device = TwoDiy::try_new(config).unwrap();
    let (mut held, mut now, mut tick) = (Held::default(), Time::from_millis(1), 0);
    let mut rest = input;
    while let [wait, length, tail @ ..] = rest {
        let (answers, behind) = tail.split_at(usize::from(*length).min(tail.len()));
        rest = behind;
        // up to 1.5 s: a device that rests is held after a second
        now += Duration::from_millis(u64::from(*wait) * 6);
        tick += 1;
        held.at(now);
        device.handle(now, answers, |event| held.judge(event));
        let counts = device.counts();
        assert_eq!(counts.taken + counts.malformed, tick, "{counts:?}");
        assert!(counts.late <= (input.len() / ANSWER_BYTES) as u64);
        let frame = device.torques(now, &output(tick));
        let [second, first] = mmt_shared::plug::singles::<2>(&frame[2..]);
        for torque in [first, second] {
            assert!(torque.abs() <= config.torque_max_nm * 1.001, "{torque} Nm");
            assert!(
                held.may_feel() || torque == 0.0,
                "{torque} Nm on a hand that does not hold"
            );
        }
    }
    let counts = device.counts();
    if counts.taken > counts.nonsense {
        return Outcome::taken(u64::from(held.is_held()) + 2 * counts.late.min(2));
    }
    Outcome::refused(&if counts.nonsense > 0 {
        "nonsense"
    } else {
        "malformed"
    })
}
