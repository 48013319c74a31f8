//! Devices with a protocol of their own, plugged into the real programs: emulators in Python, written from the vendor's pages
//! (`tests/devices`, `docs/plugs.md`). What every device is promised stands in `client/src/device/conformance.rs`; this is that
//! it holds over sockets and serial ports.
//!
//! Needs Python: without it, a test reports that, and fails where `CI` is set.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "a test may panic"
)]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "starts processes, writes files for them"
)]

use std::process::Command;
use std::time::Duration;

use serde_json::Value;

use crate::harness::process::{Ended, Running, number};
use crate::harness::python::python;
use crate::harness::{in_real_time, root};

/// For what takes seconds; the host may be busy.
const GENEROUS: Duration = Duration::from_secs(120);
/// How much more than the host asked for may act at the tool: torques are those of where the arms were when the host read them,
/// and a busy host does that late.
const MOVED: f64 = 1.05;
/// Every device that is emulated: its name on the command line, its program, and the words for its versions.
const EMULATED: [(&str, &str, &[&str]); 4] = [
    ("inverse3", "inverse3.py", &["--version", "3.5.0.0"]),
    ("inverse3", "inverse3.py", &["--version", "3.1.1.0"]),
    ("2diy", "two_diy.py", &["--geometry", "3"]),
    (
        "2diy",
        "two_diy.py",
        &["--geometry", "2", "--start", "0,0.09", "--goal=-0.03,0.09"],
    ),
];

/// An emulator, and where it is.
fn emulator(python: &str, program: &str, options: &[&str]) -> (Running, String) {
    let mut command = Command::new(python);
    command.arg(root().join("tests/devices").join(program));
    command.arg("--once").args(options);
    command.env("PYTHONDONTWRITEBYTECODE", "1");
    let mut emulator = Running::start(command).unwrap();
    let line = emulator.first_line(GENEROUS).unwrap();
    let (_, at) = line.split_once(": ").unwrap();
    (emulator, at.to_owned())
}

/// A file with what a device is like.
fn file(place: &tempfile::TempDir, text: &str) -> String {
    let file = place.path().join("device.toml");
    std::fs::write(&file, text).unwrap();
    file.to_str().unwrap().to_owned()
}

/// The keys of a device of this version. A busy host is silent for longer than any device.
fn keys(version: &[&str]) -> &'static str {
    match version {
        ["--geometry", "2", ..] => "silence_ms = 120.0\nversion = \"2\"\n",
        _ => "silence_ms = 120.0\n",
    }
}

fn document(ended: &Ended, skip: usize) -> Value {
    assert_eq!(
        ended.status.code(),
        Some(0),
        "{:?} {}",
        ended.out,
        ended.err
    );
    ended.document(skip).unwrap()
}

fn get(document: &Value, path: &str) -> f64 {
    number(document, path).unwrap_or_else(|| panic!("{path} in {document:#}"))
}

/// `mmt device test` of an emulated device: what it printed and how it ended, and what the emulator saw.
fn tested(python: &str, emulated: (&str, &str, &[&str]), options: &[&str]) -> (Ended, Value) {
    let (device, program, version) = emulated;
    let place = tempfile::tempdir().unwrap();
    let (emulator, at) = emulator(python, program, &[version, options].concat());
    let file = file(&place, keys(version));
    let all = [
        "device",
        "test",
        "--device",
        device,
        "--device-at",
        &at,
        "--device-config",
        &file,
        "--duration",
        "4s",
        "--force",
        "0.5",
        "--json",
    ];
    let ended = Running::mmt(&all).unwrap().end(GENEROUS).unwrap();
    let emulator = emulator.end(GENEROUS).unwrap();
    let seen = document(&emulator, 1);
    (ended, seen)
}

#[test]
fn each_device_of_its_own_protocol_is_read_and_pulled_gently_and_let_go_at_the_end() {
    in_real_time(|| {
        let Some(python) = python("emulated devices", "socket") else {
            return;
        };
        for emulated in EMULATED {
            let (ended, seen) = tested(&python, emulated, &[]);
            let found: Value = ended.document(0).unwrap();
            let what = format!("{emulated:?}: {found:#} {seen:#}");
            // a busy host is slow, and says so
            let unfit = i32::from(found["verdict"] == "unfit");
            assert_eq!(ended.status.code(), Some(unfit), "{what}");
            assert_eq!(found["device"], emulated.0);
            assert_eq!(seen["refused"], Value::Array(Vec::new()), "{what}");
            assert!(get(&found, "/readings") >= 100.0, "{what}");
            assert!(
                get(&found, "/readings") <= get(&seen, "/taken") + 1.0,
                "{what}"
            );
            // where the emulator was, it was seen to be
            for axis in 0..2 {
                for end in ["min", "max"] {
                    let path = format!("/place_{end}_m/{axis}");
                    let apart = get(&found, &path) - get(&seen, &path);
                    assert!(apart.abs() < 3e-3, "{path}: {what}");
                }
            }
            let way = get(&found, "/place_max_m/0") - get(&found, "/place_min_m/0");
            assert!(way > 0.02, "it moved: {what}");
            // held, pulled with what was asked for, and let go
            assert!(get(&found, "/held_s") > 0.2, "{what}");
            assert!(get(&found, "/force_peak_n") <= 0.5, "{what}");
            let peak = get(&seen, "/force_peak_n");
            assert!(peak > 0.2 && peak < 0.5 * MOVED, "{what}");
            for newtons in seen["force_last_n"].as_array().unwrap() {
                assert_eq!(newtons.as_f64().map(f64::abs), Some(0.0), "{what}");
            }
            assert_eq!(get(&found, "/drops/malformed"), 0.0, "{what}");
        }
    });
}

#[test]
fn garbage_and_silence_of_a_device_end_in_no_force_and_it_goes_on() {
    in_real_time(|| {
        let Some(python) = python("emulated devices", "socket") else {
            return;
        };
        for emulated in [EMULATED[0], EMULATED[2]] {
            let options = ["--garbage-at", "1.8", "--silent-at", "2.4"];
            let (ended, seen) = tested(&python, emulated, &options);
            let found: Value = ended.document(0).unwrap();
            let what = format!("{emulated:?}: {found:#} {seen:#}");
            assert_eq!(get(&found, "/drops/malformed"), 1.0, "{what}");
            assert!(
                get(&found, "/interval_ms/max") > 250.0,
                "the silence: {what}"
            );
            assert!(get(&found, "/readings") >= 100.0, "{what}");
            assert!(get(&seen, "/force_peak_n") < 0.5 * MOVED, "{what}");
            assert_eq!(seen["refused"], Value::Array(Vec::new()), "{what}");
            let last = get(&seen, "/force_last_n/0");
            assert_eq!(last.abs(), 0.0, "{what}");
        }
    });
}

#[test]
fn a_hand_at_a_device_of_its_own_protocol_pushes_the_box_over_the_emulated_network() {
    in_real_time(|| {
        let Some(python) = python("emulated devices", "socket") else {
            return;
        };
        // from one end of its room to the other, which is a third of a metre in the world
        for (device, program, keys, most, motion) in [
            (
                "inverse3",
                "inverse3.py",
                "silence_ms = 120.0\nscale = 4.0\n",
                8.0,
                ["--start=-0.05,-0.12,0.15", "--goal=0.05,-0.12,0.15"],
            ),
            (
                "2diy",
                "two_diy.py",
                "silence_ms = 120.0\nscale = 3.3\n",
                3.0 * MOVED,
                ["--start=0.064,0.09", "--goal=-0.026,0.09"],
            ),
        ] {
            let place = tempfile::tempdir().unwrap();
            let file = file(&place, keys);
            let motion = [&motion[..], &["--rest", "3"]].concat();
            let (emulator, at) = emulator(&python, program, &motion);
            let identity = place.path().join("identity");
            let record = place.path().join("hand.mcap");
            let record = record.to_str().unwrap();
            let network = ["--netem", "delay 20ms loss 1%"];
            let own = ["--once", "--identity", identity.to_str().unwrap()];
            let (slave, pairing) = Running::slave(&[&own[..], &network].concat()).unwrap();
            let options = ["--json", "--duration", "8s", "--record", record];
            let at = [
                "--device",
                device,
                "--device-at",
                &at,
                "--device-config",
                &file,
            ];
            let master = [&["master", &pairing][..], &options, &at].concat();
            let master = Running::mmt(&[&master[..], &network].concat()).unwrap();
            let master = document(&master.end(GENEROUS).unwrap(), 0);
            let slave = document(&slave.end(GENEROUS).unwrap(), 1);
            let seen = document(&emulator.end(GENEROUS).unwrap(), 1);
            let what = format!("{device}: {seen:#} {master:#} {slave:#}");
            let operator = format!("device {device}");
            assert_eq!(master["configuration"]["operator"], operator.as_str());
            assert_eq!(master["configuration"]["device"]["name"], device);
            assert_eq!(get(&master, "/drops/device_malformed"), 0.0, "{what}");
            assert_eq!(get(&master, "/drops/device_nonsense"), 0.0, "{what}");
            assert!(get(&slave, "/force/contact_samples") > 100.0, "{what}");
            assert!(get(&slave, "/updates/sent") >= 1.0, "{what}");
            // it was felt, within the device's limit, and is over
            let peak = get(&seen, "/force_peak_n");
            assert!(peak > 0.2 && peak <= most * 1.000_1, "{what}");
            assert_eq!(get(&seen, "/force_last_n/0").abs(), 0.0, "{what}");
            assert_eq!(seen["refused"], Value::Array(Vec::new()), "{what}");
            // its readings are inputs: the session runs again to the same bits without the device
            let again = Running::mmt(&["replay", record, "--json"]).unwrap();
            let again = document(&again.end(GENEROUS).unwrap(), 0);
            let ticks = get(&again, "/records/0/sessions/0/ticks");
            assert!(ticks > 1000.0, "{again:#}");
        }
    });
}

#[test]
fn the_link_is_tested_by_the_same_command() {
    in_real_time(|| {
        let Some(python) = python("a hand in Python", "socket") else {
            return;
        };
        let all = [
            "device",
            "test",
            "--device",
            "link",
            "--duration",
            "3s",
            "--force",
            "0.5",
            "--json",
        ];
        let mut mmt = Running::mmt(&all).unwrap();
        let line = mmt.wait_for_line(GENEROUS, |line| line.starts_with("device: "));
        let line = line.unwrap();
        let (_, address) = line.split_once(": ").unwrap();
        let mut command = Command::new(&python);
        command.arg(root().join("contrib/hand.py"));
        command.args([address, "--way", "0.1"]);
        let hand = document(&Running::start(command).unwrap().end(GENEROUS).unwrap(), 0);
        let ended = mmt.end(GENEROUS).unwrap();
        let found: Value = ended.document(0).unwrap();
        let unfit = i32::from(found["verdict"] == "unfit");
        assert_eq!(ended.status.code(), Some(unfit), "{found:#}");
        assert!(get(&found, "/readings") >= 100.0, "{found:#}");
        assert!(get(&found, "/held_s") > 0.2, "{found:#}");
        assert!(!found["address"].as_str().unwrap().contains("token"));
        assert!(get(&hand, "/force_peak_n") > 0.2, "{hand:#}");
        assert!(get(&hand, "/force_peak_n") < 0.501, "{hand:#}");
    });
}
