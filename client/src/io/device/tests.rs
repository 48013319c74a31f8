//! That the last that a device gets is no force, however a session or its process ends.

use mmt_shared::model::geometry::Vec2;
use std::fs::File;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::os::fd::AsFd;
use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Duration;

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use serde_json::Value;
use tungstenite::Message;

use super::*;
use crate::device::link::DeviceKind;
use crate::device::two_diy::{ANSWER_BYTES, RESET, SET_UP_BYTES, TORQUES_BYTES};

/// For what takes milliseconds; the host may be busy.
const GENEROUS: Duration = Duration::from_secs(60);

/// A device of this kind on a host that is busy now and then.
fn config(kind: DeviceKind) -> DeviceLinkConfig {
    DeviceLinkConfig {
        silence_ms: 120.0,
        ..DeviceLinkConfig::of(kind)
    }
}

/// An Inverse Service for one client and so many frames; a button that is down from the tenth on. Hands over each force.
fn service(at: SocketAddr, frames: u32) -> (SocketAddr, Receiver<f64>) {
    let listener = TcpListener::bind(at).unwrap();
    let at = listener.local_addr().unwrap();
    let (forces, asked) = channel();
    thread::spawn(move || {
        let (mut page, _) = listener.accept().unwrap();
        let mut request = [0; 256];
        assert!(page.read(&mut request).unwrap() > 0);
        let version = "HTTP/1.1 200 OK\r\n\r\n{\"project_version\": \"3.5.0.0\"}";
        page.write_all(version.as_bytes()).unwrap();
        drop(page);
        let mut socket = tungstenite::accept(listener.accept().unwrap().0).unwrap();
        for frame in 0..frames {
            let down = frame > 10;
            let text = serde_json::json!({
                "inverse3": [{"device_id": "1", "state": {"cursor_position": {"x": 0.0, "y": -0.12, "z": 0.15}}}],
                "wireless_verse_grip": [{"device_id": "2", "state": {"buttons": {"a": down}}}],
            });
            let sent = socket.send(Message::text(text.to_string()));
            let Ok(Message::Text(message)) = sent.and_then(|()| socket.read()) else {
                return;
            };
            let message: Value = serde_json::from_str(&message).unwrap();
            let force = message.pointer("/inverse3/0/commands/set_cursor_force/vector/x");
            if let Some(newtons) = force.and_then(Value::as_f64) {
                forces.send(newtons).unwrap();
            }
        }
    });
    (at, asked)
}

/// A 2DIY that stands still for so many frames, behind a link of this path. Hands over the torque of motor 1 in each frame.
fn board(at: &Path, frames: u32) -> Receiver<f64> {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&master).unwrap();
    unlockpt(&master).unwrap();
    let name = ptsname(&master, Vec::new()).unwrap();
    let path = PathBuf::from(name.into_string().unwrap());
    // held open, so that reads wait for whoever comes; raw before anybody comes
    let slave = File::options().read(true).write(true).open(&path).unwrap();
    let mut settings = tcgetattr(slave.as_fd()).unwrap();
    settings.make_raw();
    tcsetattr(slave.as_fd(), OptionalActions::Now, &settings).unwrap();
    let (torques, asked): (Sender<f64>, _) = channel();
    thread::spawn(move || {
        let _held = slave;
        let mut port = File::from(master);
        let mut start = [0; RESET.len() + SET_UP_BYTES];
        port.read_exact(&mut start).unwrap();
        assert_eq!(start[..3], [0, 0, 1]);
        let degrees = [60.0_f32, 120.0];
        let mut answer = [5; ANSWER_BYTES];
        answer[1..].copy_from_slice(degrees.map(f32::to_le_bytes).as_flattened());
        let mut frame = [0; TORQUES_BYTES];
        for _ in 0..frames {
            if port.read_exact(&mut frame).is_err() {
                return;
            }
            let first = f32::from_le_bytes(frame[6..].try_into().unwrap());
            if torques.send(first.into()).is_err() || port.write_all(&answer).is_err() {
                return;
            }
        }
    });
    let _ = std::fs::remove_file(at);
    std::os::unix::fs::symlink(path, at).unwrap();
    asked
}

/// Ticks a loop that pushes until the device is told to.
fn pushed(port: &mut DevicePort, asked: &Receiver<f64>) {
    for _ in 0..GENEROUS.as_millis() {
        port.give(HandOutput {
            force: Vec2::new(1.0, 0.0),
            engaged: true,
            ..HandOutput::default()
        });
        thread::sleep(Duration::from_millis(1));
        if asked.try_iter().any(|asked| asked != 0.0) {
            return;
        }
    }
    panic!("no force came to the device");
}

const ANYWHERE: &str = "127.0.0.1:0";

/// Both devices, each until the first force.
fn pushing(place: &Path) -> Vec<(DeviceHost, DevicePort, Receiver<f64>)> {
    let (service, service_asked) = service(ANYWHERE.parse().unwrap(), u32::MAX);
    let port = place.join("port");
    let board_asked = board(&port, u32::MAX);
    let both = [
        (
            DeviceAddress::Inverse3(service),
            DeviceKind::Inverse3,
            service_asked,
        ),
        (DeviceAddress::TwoDiy(port), DeviceKind::TwoDiy, board_asked),
    ];
    let started = both.into_iter().map(|(at, kind, asked)| {
        let host = DeviceHost::start(&at, config(kind)).unwrap();
        let mut port = host.port();
        pushed(&mut port, &asked);
        (host, port, asked)
    });
    started.collect()
}

#[test]
fn the_end_of_the_process_leaves_no_force_though_the_loop_was_pushing() {
    let place = tempfile::tempdir().unwrap();
    for (host, port, asked) in pushing(place.path()) {
        let address = host.address().to_owned();
        drop(host);
        // the board is held open by its test: its last frame is the newest
        let mut last = f64::NAN;
        while let Ok(next) = asked.recv_timeout(Duration::from_secs(2)) {
            last = next;
        }
        assert_eq!(last, 0.0, "{address}");
        drop(port);
    }
}

#[test]
fn the_end_of_a_session_leaves_no_force_while_the_device_goes_on() {
    let place = tempfile::tempdir().unwrap();
    for (host, port, asked) in pushing(place.path()) {
        drop(port);
        // what was asked for before, and the one that was under way, may push; then nothing does
        let before = asked.try_iter().count();
        let frames: Vec<_> = asked.iter().take(50).collect();
        let still = frames[2..].iter().all(|newtons| *newtons == 0.0);
        assert!(still, "{} after {before}: {frames:?}", host.address());
    }
}

#[test]
fn a_service_and_a_port_that_go_and_come_back_are_pushed_again_after_a_new_grip() {
    let (at, asked) = service(ANYWHERE.parse().unwrap(), 500);
    let host = DeviceHost::start(&DeviceAddress::Inverse3(at), config(DeviceKind::Inverse3));
    let host = host.unwrap();
    let mut port = host.port();
    pushed(&mut port, &asked);
    while asked.recv().is_ok() {}
    let (_, again) = service(at, u32::MAX);
    pushed(&mut port, &again);

    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("port");
    // it rests for a second before it is held
    let asked = board(&path, 3000);
    let at = DeviceAddress::TwoDiy(path.clone());
    let host = DeviceHost::start(&at, config(DeviceKind::TwoDiy)).unwrap();
    let mut port = host.port();
    pushed(&mut port, &asked);
    while asked.recv().is_ok() {}
    let again = board(&path, u32::MAX);
    pushed(&mut port, &again);
}

#[test]
fn a_service_and_a_port_that_are_not_there_are_refused_at_once() {
    let nobody = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let refused = |at, kind| DeviceHost::start(&at, config(kind)).unwrap_err();
    let service = refused(DeviceAddress::Inverse3(nobody), DeviceKind::Inverse3);
    assert!(
        matches!(service, DeviceHostError::Service { .. }),
        "{service}"
    );
    for no_port in ["/dev/no-such-port", "/dev/null"] {
        let port = refused(DeviceAddress::TwoDiy(no_port.into()), DeviceKind::TwoDiy);
        assert!(matches!(port, DeviceHostError::Port { .. }), "{port}");
    }
}
