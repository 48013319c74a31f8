//! That messages are read and written as the vendor's pages have them.

use mmt_shared::model::geometry::Vec2;

use super::*;
use crate::device::link::DeviceKind;

const INVENTORY: &str = r#"{"session_id": 7, "inverse3": [{"device_id": "049D", "config": {"type": "inverse3",
    "handedness": "right"}, "state": {"cursor_position": {"x": 0.0, "y": -0.12, "z": 0.15},
    "cursor_velocity": {"x": 0.0, "y": 0.25, "z": 0.0}, "control_mode": "idle"}, "status": {"ready": true}}],
    "wireless_verse_grip": [{"device_id": "61548", "state": {"buttons": {"a": false, "b": true, "c": false}}}]}"#;

fn begun(version: Option<&str>) -> Inverse3 {
    let mut device = Inverse3::try_new(DeviceLinkConfig::of(DeviceKind::Inverse3)).unwrap();
    device.begin(version, |_| ());
    device
}

#[test]
fn both_dialects_are_written_as_the_vendors_pages_have_them() {
    const ZERO: &str = r#"{"x":0.0,"y":0.0,"z":0.0}"#;
    let command = |dialect: &str| {
        let force = format!(r#"{{"set_cursor_force":{{"{dialect}":{ZERO}}}}}"#);
        format!(r#""inverse3":[{{"device_id":"049D","commands":{force}}}]}}"#)
    };
    for (version, dialect) in [
        (Some("3.5.0.0"), "vector"),
        (Some("3.5.1"), "vector"),
        (Some("4.0"), "vector"),
        (None, "vector"),
        (Some("3.4.2.0"), "values"),
        (Some("3.1.1"), "values"),
    ] {
        let mut device = begun(version);
        assert_eq!(
            device.no_force(),
            r#"{"session":{"force_render_full_state":{}}}"#,
            "no device yet"
        );
        device.handle(Time::from_millis(1), INVENTORY, |_| ());
        let first = device.no_force();
        if dialect == "vector" {
            let greeting = r#"{"session":{"configure":{"profile":{"name":"mmt"}}},"#;
            assert_eq!(first, format!("{greeting}{}", command(dialect)));
        }
        assert_eq!(device.no_force(), format!("{{{}", command(dialect)));
    }
}

#[test]
fn place_speed_and_buttons_are_read() {
    let mut device = begun(None);
    device.handle(Time::from_millis(1), INVENTORY, |_| ());
    let seen = device.seen().unwrap();
    assert_eq!(seen.place, [0.0, -0.12, 0.15]);
    assert_eq!(seen.velocity, [0.0, 0.25, 0.0]);
    assert_eq!(seen.buttons, 2);
    let wired = INVENTORY.replace("wireless_verse_grip", "verse_grip");
    let wired = wired.replace(
        r#""buttons": {"a": false, "b": true, "c": false}"#,
        r#""button": true"#,
    );
    device.handle(Time::from_millis(2), &wired, |_| ());
    assert_eq!(device.seen().unwrap().buttons, 1);
}

#[test]
fn what_is_no_frame_is_malformed_and_one_without_the_device_forgets_it() {
    let mut device = begun(None);
    let deep = "[".repeat(100_000);
    for bad in [
        "",
        "{",
        "null",
        "[]",
        r#"{"inverse3": 3}"#,
        &deep,
        "{\"inverse3\": [{}]}",
    ] {
        device.handle(Time::from_millis(1), bad, |_| ());
    }
    assert_eq!(
        device.counts.malformed, 6,
        "an empty array is an empty frame"
    );
    device.handle(Time::from_millis(2), INVENTORY, |_| ());
    assert!(device.device.is_some());
    let other = INVENTORY.replace("049D", "04BA");
    device.handle(Time::from_millis(3), &other, |_| ());
    assert_eq!(device.device, None);
    device.handle(Time::from_millis(4), &other, |_| ());
    assert_eq!(device.device.as_deref(), Some("04BA"));
}

#[test]
fn a_frame_without_a_position_is_no_reading() {
    let mut device = begun(None);
    device.handle(Time::from_millis(1), INVENTORY, |_| ());
    device.seen();
    let partial = r#"{"inverse3": [{"device_id": "049D", "state": {}}]}"#;
    device.handle(Time::from_millis(2), partial, |_| ());
    assert_eq!((device.seen(), device.counts.late), (None, 1));
}

#[test]
fn frames_without_a_position_are_a_silence() {
    let mut device = begun(None);
    device.handle(Time::from_millis(1), INVENTORY, |_| ());
    let pressed = INVENTORY.replace(r#""a": false"#, r#""a": true"#);
    device.handle(Time::from_millis(2), &pressed, |_| ());
    let pushed = |device: &mut Inverse3, ms| {
        let output = HandOutput {
            tick: ms,
            force: Vec2::new(1.0, 0.0),
            engaged: true,
            ..HandOutput::default()
        };
        let answer = device.answer(Time::from_millis(ms), &output);
        answer.contains(r#""x":1.0"#)
    };
    assert!(pushed(&mut device, 2));
    let partial = r#"{"inverse3": [{"device_id": "049D", "state": {}}]}"#;
    let mut released = Vec::new();
    for ms in 3..=60 {
        device.handle(Time::from_millis(ms), partial, |event| {
            released.extend((event == HandEvent::Release).then_some(ms));
        });
        assert_eq!(pushed(&mut device, ms), ms < 42, "{ms} ms");
    }
    assert_eq!(released, [42]);
}
