//! A program with all its traffic through emulated links: TCP there and back, in namespaces that the test makes.
//!
//! Needs namespaces and `python3`, and `tshark` for the capture: where the host forbids them the message is held to
//! be right, the test prints that it did not run, and with `CI` set it fails.

use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use serde_json::Value;

use super::mmt;
use super::netem::columns;
use crate::harness::process::{PROGRAM, did_not_run};

/// Sends back what comes, once.
const ECHO: &str = r#"
import socket, sys
listen = socket.create_server(("0.0.0.0", 5000))
peer, address = listen.accept()
open(sys.argv[1], "w").write(address[0])
try:
    while data := peer.recv(65536):
        peer.sendall(data)
except ConnectionResetError:
    pass
"#;

/// Prints a round trip, ms, and how many bytes came back of 100 000. It closes both ways at once: `pasta` of 2023 stalls a
/// connection that one end has half closed.
const CLIENT: &str = r#"
import os, socket, sys, time
to = sys.argv[1] if len(sys.argv) > 1 else os.environ["MMT_FAR"]
for attempt in range(600):
    try:
        peer = socket.create_connection((to, 5000), 60)
        break
    except OSError:
        time.sleep(0.05)
began = time.monotonic()
peer.sendall(b"x")
peer.recv(1)
print((time.monotonic() - began) * 1e3)
peer.sendall(b"y" * 100000)
back = 0
while back < 100000 and (data := peer.recv(65536)):
    back += len(data)
print(back)
peer.close()
"#;

const LINKS: [&str; 10] = [
    "netem",
    "shell",
    "--up",
    "delay 20ms",
    "--down",
    "delay 10ms loss list 3",
    "--report",
    "report.json",
    "--pcap",
    "run.pcapng",
];

fn home() -> tempfile::TempDir {
    let home = tempfile::tempdir().unwrap();
    std::fs::write(home.path().join("echo.py"), ECHO).unwrap();
    std::fs::write(home.path().join("client.py"), CLIENT).unwrap();
    home
}

/// Whether the host allowed it; if not, that is what it must have been.
fn ran(output: &Output) -> bool {
    if output.status.success() {
        return true;
    }
    let printed = String::from_utf8_lossy(&output.stderr);
    let words = ["this host forbids", "no way to the host's network"];
    assert!(
        words.iter().any(|words| printed.contains(words)) && printed.contains("what to do"),
        "{printed}"
    );
    did_not_run("a shell behind emulated links", &printed);
    false
}

/// What the client printed, and the report.
fn the_links_did_their_part(output: &Output, home: &Path) {
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let lines: Vec<f64> = printed.lines().map(|line| line.parse().unwrap()).collect();
    assert!(lines[0] >= 30.0, "{printed}");
    assert_eq!(lines[1], 100_000.0);
    let report = std::fs::read(home.join("report.json")).unwrap();
    let report: Value = serde_json::from_slice(&report).unwrap();
    let counters = &report["counters"];
    assert_eq!(counters["down"]["link"]["dropped"]["loss"]["packets"], 1);
    for way in ["up", "down"] {
        let count = |path: &str| counters[way].pointer(path).and_then(Value::as_u64).unwrap();
        // 100 000 bytes and their headers
        assert!(count("/link/offered/bytes") > 100_000, "{counters}");
        let gone = [
            "/sent/packets",
            "/link/dropped/loss/packets",
            "/in_flight",
            "/blocked/packets",
            "/failed/packets",
        ];
        assert_eq!(
            count("/link/offered/packets"),
            gone.map(count).iter().sum::<u64>(),
            "{counters}"
        );
    }
    assert_eq!(report["exit_code"], 0);
    assert_eq!(counters["uncaptured"], 0);
    the_capture_shows_both_sides(&home.join("run.pcapng"), counters);
}

/// Each packet as it came and as it left, and what became of it, as tshark reads it.
fn the_capture_shows_both_sides(capture: &Path, counters: &Value) {
    let names = [
        "frame.interface_name",
        "frame.comment",
        "tcp.port",
        "ip.src",
        "ip.dst",
    ];
    let Some(packets) = columns(capture, &names) else {
        return;
    };
    let on = |side: &str| packets.iter().filter(|packet| packet[0] == side).count() as u64;
    for way in ["up", "down"] {
        let count = |path: &str| counters[way].pointer(path).and_then(Value::as_u64).unwrap();
        let decided = count("/link/offered/packets") - count("/in_flight");
        assert_eq!(on(&format!("{way} in")), decided, "{counters}");
        assert_eq!(on(&format!("{way} out")), count("/sent/packets"));
    }
    let lost = |packet: &&Vec<String>| packet[1] == "down 3: lost (loss)";
    assert_eq!(packets.iter().filter(lost).count(), 1);
    assert!(packets.iter().any(|packet| packet[2].contains("5000")));
}

#[test]
fn two_own_namespaces_are_a_path_for_any_program() {
    let home = home();
    let mut arguments = LINKS.to_vec();
    arguments.extend([
        "--beside",
        "python3 echo.py peer",
        "--",
        "python3",
        "client.py",
    ]);
    let output = mmt(&home, &arguments).output().unwrap();
    if !ran(&output) {
        return;
    }
    the_links_did_their_part(&output, home.path());
    // the command's exit code is that of the run
    let arguments = [
        "netem", "shell", "--beside", "true", "--", "sh", "-c", "exit 7",
    ];
    assert_eq!(mmt(&home, &arguments).status().unwrap().code(), Some(7));
}

/// Runs `ip`; whether it could.
fn ip(words: &str) -> bool {
    let output = Command::new("ip").args(words.split(' ')).output();
    output.is_ok_and(|output| output.status.success())
}

/// Two hosts on a cable; gone when dropped.
struct Cable([String; 2]);

impl Cable {
    /// `name` is of this process alone.
    fn make(name: &str) -> Option<Self> {
        let names = ["here", "there"];
        let names = names.map(|host| format!("mmt-{}-{name}-{host}", std::process::id()));
        let cable = Self(names);
        let [here, there] = &cable.0;
        let words = [
            format!("netns add {here}"),
            format!("netns add {there}"),
            format!("-n {here} link add cable type veth peer name cable netns {there}"),
            format!("-n {here} address add 10.92.0.1/24 dev cable"),
            format!("-n {there} address add 10.92.0.2/24 dev cable"),
            format!("-n {here} link set cable up"),
            format!("-n {there} link set cable up"),
        ];
        words.iter().all(|words| ip(words)).then_some(cable)
    }
}

/// The program for a user without rights on a host, with a TUN device of this mode.
fn as_nobody(host: &str, home: &Path, mode: &str) -> Command {
    const SCRIPT: &str = r#"
        mknod tun c 10 200 && chmod "$0" tun && mount --bind tun /dev/net/tun
        exec setpriv --reuid 65534 --regid 65534 --clear-groups env HOME="$PWD" ./mmt "$@"
    "#;
    let mut command = Command::new("ip");
    command.args(["netns", "exec", host, "unshare", "--mount"]);
    command.args(["sh", "-c", SCRIPT, mode]).current_dir(home);
    command
}

#[test]
fn without_root_pasta_leads_to_the_network_of_the_host_and_a_host_that_forbids_it_is_named() {
    use std::fs::{Permissions, copy, set_permissions};
    use std::os::unix::fs::PermissionsExt;
    let home = home();
    let tools = ["pasta", "setpriv", "unshare"].map(|tool| {
        let found = Command::new(tool).arg("--version").output();
        found.is_ok_and(|output| output.status.success())
    });
    let (true, Some(cable)) = (tools == [true; 3], Cable::make("pasta")) else {
        let why = "it needs root, `ip`, `unshare`, `setpriv` and `pasta`";
        return did_not_run("a shell without root", why);
    };
    // a place where that user can read and write
    copy(PROGRAM, home.path().join("mmt")).unwrap();
    set_permissions(home.path(), Permissions::from_mode(0o777)).unwrap();
    let [here, there] = &cable.0;
    // what pasta takes for the way out is not the host of the echo: that address it gives to the host itself
    assert!(ip(&format!(
        "-n {there} address add 10.92.0.3/24 dev cable"
    )));
    assert!(ip(&format!("-n {here} route add default via 10.92.0.3")));

    let mut closed = as_nobody(here, home.path(), "600");
    let closed = closed.args(["netem", "shell", "--", "true"]).output();
    let closed = closed.unwrap();
    let printed = String::from_utf8_lossy(&closed.stderr);
    assert!(!closed.status.success());
    for words in ["this host forbids", "/dev/net/tun", "what to do"] {
        assert!(printed.contains(words), "{printed}");
    }

    std::fs::remove_file(home.path().join("tun")).unwrap();
    let mut echo = Command::new("ip")
        .args(["netns", "exec", there, "python3", "echo.py", "peer"])
        .current_dir(home.path())
        .spawn()
        .unwrap();
    let mut shell = as_nobody(here, home.path(), "666");
    let output = shell
        .args(LINKS)
        .args(["--", "python3", "client.py", "10.92.0.2"])
        .output()
        .unwrap();
    if !ran(&output) {
        echo.kill().unwrap();
        echo.wait().unwrap();
        return;
    }
    echo.wait().unwrap();
    the_links_did_their_part(&output, home.path());
    let peer = std::fs::read_to_string(home.path().join("peer")).unwrap();
    assert_eq!(peer, "10.92.0.1");
}

impl Drop for Cable {
    fn drop(&mut self) {
        for host in &self.0 {
            ip(&format!("netns del {host}"));
        }
    }
}

#[test]
fn as_root_the_way_leads_to_the_network_of_the_host_under_its_address() {
    let home = home();
    let Some(cable) = Cable::make("root") else {
        return did_not_run("a shell on the host's network", "it needs root and `ip`");
    };
    let on = |host: &String, program: &str| {
        let mut command = Command::new("ip");
        command
            .args(["netns", "exec", host, program])
            .current_dir(home.path());
        command
    };
    let [here, there] = &cable.0;
    let mut echo = on(there, "python3")
        .args(["echo.py", "peer"])
        .spawn()
        .unwrap();
    let mut shell = on(here, PROGRAM);
    let output = shell
        .args(LINKS)
        .args(["--", "python3", "client.py", "10.92.0.2"])
        .output()
        .unwrap();
    if !ran(&output) {
        echo.kill().unwrap();
        echo.wait().unwrap();
        return;
    }
    echo.wait().unwrap();
    the_links_did_their_part(&output, home.path());
    let peer = std::fs::read_to_string(home.path().join("peer")).unwrap();
    assert_eq!(peer, "10.92.0.1");
    let left = on(here, "nft").args(["list", "tables"]).output().unwrap();
    assert!(left.stdout.is_empty(), "{left:?}");
}

#[test]
fn the_last_of_the_runs_that_overlap_switches_forwarding_off() {
    let home = home();
    let Some(cable) = Cable::make("overlap") else {
        return did_not_run("shells that overlap", "it needs root and `ip`");
    };
    let on = |program: &str| {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &cable.0[0], program]);
        command.current_dir(home.path());
        command
    };
    let is_on = || {
        let forwarding = on("cat").arg("/proc/sys/net/ipv4/ip_forward").output();
        forwarding.unwrap().stdout == b"1\n"
    };
    assert!(!is_on());
    let begin = || {
        let mut shell = on(PROGRAM);
        shell.args([
            "netem",
            "shell",
            "--",
            "sh",
            "-c",
            "echo begun; read end; true",
        ]);
        let pipes = shell.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut shell = pipes.stderr(Stdio::piped()).spawn().unwrap();
        // fails where the host forbids it
        let _ = shell.stdout.as_mut().unwrap().read_exact(&mut [0; 6]);
        shell
    };
    // whose stdin closes, ends
    let end = |shell: Child| shell.wait_with_output().unwrap();
    let (first, second) = (begin(), begin());
    let first = end(first);
    let is_on_for_the_second = is_on();
    let second = end(second);
    if ran(&first) && ran(&second) {
        assert!(is_on_for_the_second && !is_on());
    }
}
