//! Devices and plants of somebody else's, in another language, plugged into the real programs (`contrib`, `docs/plugs.md`).
//!
//! Needs Python: without it, the test reports that, and fails where `CI` is set.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "a test may panic"
)]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "starts processes, knocks at a port"
)]

use std::net::UdpSocket;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use serde_json::Value;

use crate::harness::process::{Ended, Running, did_not_run, number};
use crate::harness::python::python;
use crate::harness::{in_real_time, root};

/// For what takes seconds; the host may be busy.
const GENEROUS: Duration = Duration::from_secs(120);

/// A program of `contrib`, which reads the address of its plug, no argument, from standard input.
fn contrib(python: &str, program: &str, address: &str, arguments: &[&str]) -> Running {
    let mut command = Command::new(python);
    command.arg(root().join("contrib").join(program));
    command.args(arguments);
    Running::start_reading(command, &format!("{address}\n")).unwrap()
}

/// What stands behind these words on a line that the program prints.
fn announced(program: &mut Running, words: &str) -> String {
    let line = program.wait_for_line(GENEROUS, |line| line.starts_with(words));
    line.unwrap()[words.len()..].to_owned()
}

/// A slave for one session, and its pairing string.
fn slave(place: &Path, options: &[&str]) -> (Running, String) {
    let identity = place.join("identity");
    let own = ["--once", "--identity", identity.to_str().unwrap()];
    Running::slave(&[&own[..], options].concat()).unwrap()
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

#[test]
fn a_hand_that_knows_only_the_document_is_plugged_in_and_pushes_the_box() {
    in_real_time(|| {
        let Some(python) = python("a hand in Python", "socket") else {
            return;
        };
        let place = tempfile::tempdir().unwrap();
        let record = place.path().join("hand.mcap");
        let record = record.to_str().unwrap();
        let (slave, pairing) = slave(place.path(), &[]);
        let device = ["master", &pairing, "--device", "link", "--json"];
        let device = [&device[..], &["--record", record]].concat();
        let mut master = Running::mmt(&device).unwrap();
        let address = announced(&mut master, "device: ");
        a_stranger_knocks(&address);
        let hand = contrib(&python, "hand.py", &address, &["--way", "0.45"]);
        let hand = document(&hand.end(GENEROUS).unwrap(), 0);
        master.interrupt().unwrap();
        let master = document(&master.end(GENEROUS).unwrap(), 0);
        let slave = document(&slave.end(GENEROUS).unwrap(), 1);
        assert_eq!(master["configuration"]["operator"], "device link");
        // the way is the device's, less what the force of the box takes of it
        let way = get(&hand, "/hip_to_m/0") - get(&hand, "/hip_from_m/0");
        assert!(way > 0.3, "{hand:#}");
        assert!(get(&hand, "/contact_s") > 0.3, "{hand:#}");
        assert!(get(&hand, "/force_peak_n") > 0.5, "{hand:#}");
        assert!(get(&hand, "/force_peak_n") <= 8.0, "{hand:#}");
        assert!(get(&slave, "/updates/sent") >= 3.0, "{slave:#}");
        // what one counts as sent the other has taken or missed
        let counted = |name: &str| get(&master, &format!("/drops/device_{name}"));
        assert_eq!(counted("stranger"), 1.0, "{master:#}");
        assert_eq!(counted("malformed"), 1.0, "{master:#}");
        assert!(counted("lost") <= get(&hand, "/sent"), "{master:#}");
        assert_eq!(counted("nonsense"), 0.0, "{master:#}");
        // its readings are inputs: the session runs again to the same bits
        let again = Running::mmt(&["replay", record, "--json"]).unwrap();
        let again = document(&again.end(GENEROUS).unwrap(), 0);
        assert!(
            get(&again, "/records/0/sessions/0/ticks") > 1000.0,
            "{again:#}"
        );
    });
}

/// A packet with another token, and one that is none: neither is answered.
fn a_stranger_knocks(address: &str) {
    let place = address.strip_prefix("udp://").unwrap();
    let (place, _) = place.split_once('?').unwrap();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut packet = [0; 64];
    packet[..6].copy_from_slice(b"MMTL\x01\x01");
    socket.send_to(&packet, place).unwrap();
    socket.send_to(b"hello", place).unwrap();
    socket.set_nonblocking(true).unwrap();
    std::thread::sleep(Duration::from_millis(50));
    assert!(socket.recv(&mut packet).is_err());
}

#[test]
fn a_device_that_cannot_be_is_refused_in_words() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("device.toml");
    std::fs::write(&file, "axes = [\"x\", \"w\"]\n").unwrap();
    let file = file.to_str().unwrap();
    let pairing = format!("mmt://127.0.0.1:9?pin={0}&token={0}", "5a".repeat(32));
    let refused = |words: &[&str]| {
        let all = [&["master", &pairing][..], words].concat();
        let ended = Running::mmt(&all).unwrap().end(GENEROUS).unwrap();
        assert_eq!(ended.status.code(), Some(2), "{}", ended.err);
        ended.err
    };
    let link = ["--device", "link"];
    let text = refused(&[&link[..], &["--device-config", file]].concat());
    for part in ["device.toml", "line 1", "^^^", "docs/plugs.md"] {
        assert!(text.contains(part), "{text}");
    }
    let text = refused(&[&link[..], &["--device-listen", "0.0.0.0:0"]].concat());
    assert!(text.contains("--device-insecure"), "{text}");
    assert!(refused(&["--device-config", file]).contains("--device link"));
    let text = refused(&[&link[..], &["--operator", "pointer"]].concat());
    assert!(text.contains("leave --operator out"), "{text}");
}

/// Numbers of `mmt bench plant` with a program of `contrib` as the plant.
fn bench(python: &str, program: &[&str], options: &[&str]) -> Value {
    let all = ["bench", "plant", "--plant", "link", "--json"];
    let mut mmt = Running::mmt(&[&all[..], options].concat()).unwrap();
    let address = announced(&mut mmt, "plant: ");
    let (name, rest) = program.split_first().unwrap();
    let _plant = contrib(python, name, &address, rest);
    document(&mmt.end(GENEROUS).unwrap(), 0)
}

#[test]
fn a_plant_in_lock_step_gives_the_same_bits_twice_and_feels_like_the_world_that_it_is_like() {
    let Some(python) = python("a plant in Python", "socket") else {
        return;
    };
    let options = ["--duration", "20s", "--seed", "3"];
    let once = bench(&python, &["plant.py"], &options);
    let twice = bench(&python, &["plant.py"], &options);
    assert_eq!(once, twice);
    assert_eq!(once["truth"], Value::Null);
    let world = ["bench", "plant", "--json"];
    let world = Running::mmt(&[&world[..], &options].concat()).unwrap();
    let world = document(&world.end(GENEROUS).unwrap(), 0);
    // the block does not turn and has no noise: the same friction is found, and no more packets are needed
    let c = get(&once, "/estimate/2");
    let truth = get(&world, "/truth/2");
    assert!(
        (c - truth).abs() < 0.35 * truth,
        "{c} for {truth}: {once:#}"
    );
    let relative = |of: &Value| get(of, "/force_relative_error");
    assert!(
        relative(&once) < 1.5 * relative(&world) + 0.05,
        "{once:#} {world:#}"
    );
    assert!(get(&once, "/moved_m") > 0.05, "{once:#}");
}

#[test]
fn objects_of_mujoco_are_pushed_over_the_emulated_network_within_the_contract() {
    let test = "MuJoCo as a plant";
    let Some(python) = python(test, "mujoco") else {
        return;
    };
    // relative error of the force at most: the wedge has a slanted face where the model has a corner, and no box is a door
    let objects: [(&[&str], f64); 5] = [
        (&["cube"], 0.2),
        (&["cube", "--tool-friction", "0.2"], 0.2),
        (&["cylinder"], 0.4),
        (&["wedge"], 1.0),
        (&["door"], 1.5),
    ];
    for (object, most) in objects {
        let program = [&["mujoco_plant.py", "--object"], object].concat();
        let runs = ["1", "2", "3", "4", "5"].map(|seed| {
            let run = bench(&python, &program, &["--duration", "12s", "--seed", seed]);
            assert!(get(&run, "/largest_force_n") <= 8.0, "{object:?}: {run:#}");
            assert!(get(&run, "/packets") >= 3.0, "{object:?}: {run:#}");
            // far fewer than the 1000 samples a second
            assert!(get(&run, "/packets_per_s") < 60.0, "{object:?}: {run:#}");
            run
        });
        // whether a hand finds such a face is chance: the run in the middle of five is judged
        let middle = |name: &str| {
            let mut found = runs.each_ref().map(|run| get(run, name));
            found.sort_by(f64::total_cmp);
            found[2]
        };
        assert!(middle("/contact_s") > 1.0, "{object:?}: {runs:#?}");
        let relative = middle("/force_relative_error");
        assert!(relative < most, "{object:?}: {relative}");
    }
}

#[test]
fn a_plant_that_dies_stops_the_tool_and_is_reported_to_the_master_and_its_return_ends_that() {
    in_real_time(|| {
        let Some(python) = python("a plant in Python", "socket") else {
            return;
        };
        let place = tempfile::tempdir().unwrap();
        let record = place.path().join("plant.mcap");
        let identity = place.path().join("identity");
        let options = [
            "slave",
            "--listen",
            "127.0.0.1:0",
            "--once",
            "--json",
            "--plant",
            "link",
        ];
        let kept = [
            "--identity",
            identity.to_str().unwrap(),
            "--record",
            record.to_str().unwrap(),
        ];
        let mut slave = Running::mmt(&[&options[..], &kept].concat()).unwrap();
        let address = announced(&mut slave, "plant: ");
        let plant = contrib(&python, "plant.py", &address, &[]);
        let pairing = slave.pairing().unwrap();
        let mut master = Running::mmt(&["master", &pairing, "--json"]).unwrap();
        master
            .wait_for_line(GENEROUS, |line| line.contains("the session begins"))
            .unwrap();
        std::thread::sleep(Duration::from_secs(6));
        drop(plant);
        slave
            .wait_for_line(GENEROUS, |line| line.contains("the plant is silent"))
            .unwrap();
        master
            .wait_for_line(GENEROUS, |line| line.contains("EMERGENCY STOP (slave)"))
            .unwrap();
        let _plant = contrib(&python, "plant.py", &address, &[]);
        slave
            .wait_for_next_line(GENEROUS, |line| line.contains("a plant is plugged in"))
            .unwrap();
        std::thread::sleep(Duration::from_secs(1));
        master.interrupt().unwrap();
        document(&master.end(GENEROUS).unwrap(), 0);
        let slave = document(&slave.end(GENEROUS).unwrap(), 1);
        assert_eq!(slave["model"]["mass_kg"]["truth"], Value::Null);
        assert!(get(&slave, "/updates/sent") >= 1.0, "{slave:#}");
        assert_eq!(get(&slave, "/drops/plant_nonsense"), 0.0, "{slave:#}");
        // the plant's answers are inputs: the session runs again to the same bits without the plant
        let again = Running::mmt(&["replay", record.to_str().unwrap(), "--json"]).unwrap();
        let again = document(&again.end(GENEROUS).unwrap(), 0);
        assert!(
            get(&again, "/records/0/sessions/0/ticks") > 1000.0,
            "{again:#}"
        );
    });
}

/// A client of `contrib` in C++, compiled without a warning; none where there is no compiler.
fn compiled(place: &Path, name: &str) -> Option<String> {
    let program = place.join(name);
    let mut compiler = Command::new("c++");
    compiler.args(["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", "-o"]);
    compiler.arg(&program);
    compiler.arg(root().join("contrib").join(format!("{name}.cpp")));
    let Ok(compiling) = Running::start(compiler) else {
        did_not_run("the clients in C++", "there is no c++");
        return None;
    };
    let ended = compiling.end(GENEROUS).unwrap();
    assert!(ended.status.success(), "{}", ended.err);
    Some(program.to_str().unwrap().to_owned())
}

#[test]
fn a_hand_and_a_plant_in_cpp_meet_over_the_emulated_network() {
    in_real_time(|| {
        let place = tempfile::tempdir().unwrap();
        let programs = (
            compiled(place.path(), "hand"),
            compiled(place.path(), "plant"),
        );
        let (Some(hand), Some(plant)) = programs else {
            return;
        };
        let start = |program: &str, address: &str, more: &str| {
            let mut command = Command::new(program);
            command.args(["-", more]);
            Running::start_reading(command, &format!("{address}\n")).unwrap()
        };
        let identity = place.path().join("identity");
        let network = ["--netem", "delay 20ms loss 1%"];
        let slave = [
            "slave",
            "--listen",
            "127.0.0.1:0",
            "--once",
            "--json",
            "--plant",
            "link",
        ];
        let identity = ["--identity", identity.to_str().unwrap()];
        let mut slave = Running::mmt(&[&slave[..], &identity, &network].concat()).unwrap();
        let address = announced(&mut slave, "plant: ");
        let _plant = start(&plant, &address, "100");
        let pairing = slave.pairing().unwrap();
        let master = ["master", &pairing, "--device", "link", "--json"];
        let mut master = Running::mmt(&[&master[..], &network].concat()).unwrap();
        let address = announced(&mut master, "device: ");
        let hand = start(&hand, &address, "0.45").end(GENEROUS).unwrap();
        let hand = document(&hand, 0);
        master.interrupt().unwrap();
        document(&master.end(GENEROUS).unwrap(), 0);
        let slave = document(&slave.end(GENEROUS).unwrap(), 1);
        assert!(get(&hand, "/contact_s") > 0.3, "{hand:#}");
        assert!(get(&hand, "/force_peak_n") > 0.5, "{hand:#}");
        assert!(get(&slave, "/force/contact_samples") > 300.0, "{slave:#}");
        assert_eq!(get(&slave, "/drops/plant_malformed"), 0.0, "{slave:#}");
    });
}

#[test]
fn a_node_of_ros_2_has_its_topics_and_packets() {
    // ROS itself is not there: a stand-in takes the messages' own definitions and encodes each as ROS 2 does
    let Some(python) = python("a node of ROS 2", "rosbags") else {
        return;
    };
    let mut command = Command::new(&python);
    command.arg(root().join("tests/ros/check_node.py"));
    command.env("PYTHONDONTWRITEBYTECODE", "1");
    let ended = Running::start(command).unwrap().end(GENEROUS).unwrap();
    assert!(ended.status.success(), "{:?} {}", ended.out, ended.err);
    assert_eq!(ended.out.len(), 7, "{:?}", ended.out);
}
