//! Completions and manual pages name every command.

use super::mmt;

const COMMANDS: [&str; 18] = [
    "demo",
    "slave",
    "master",
    "netem",
    "replay",
    "check",
    "report",
    "export",
    "reproduce",
    "soak",
    "swarm",
    "sweep",
    "doctor",
    "device",
    "identity",
    "config",
    "completions",
    "bench",
];

#[test]
fn every_shell_completes_every_command() {
    let home = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = mmt(&home, &["completions", shell]).output().unwrap();
        assert!(output.status.success());
        let script = String::from_utf8(output.stdout).unwrap();
        for command in COMMANDS {
            assert!(script.contains(command), "{shell}: {command}");
        }
    }
    let wrong = mmt(&home, &["completions", "csh"]).output().unwrap();
    assert_eq!(wrong.status.code(), Some(2));
}

#[test]
fn each_command_has_a_page_with_its_options() {
    let home = tempfile::tempdir().unwrap();
    let output = mmt(&home, &["man", "--out", "pages"]).output().unwrap();
    assert!(output.status.success() && output.stdout.is_empty());
    let page = |name: &str| std::fs::read_to_string(home.path().join("pages").join(name)).unwrap();
    for command in COMMANDS {
        assert!(page("mmt.1").contains(command), "{command}");
        let own = page(&format!("mmt-{command}.1"));
        assert!(own.starts_with(".ie") || own.starts_with(".TH"), "{own}");
    }
    assert!(page("mmt-slave.1").contains("listen"));
    assert!(page("mmt-netem-report.1").contains("json"));
    assert!(page("mmt-device-test.1").contains("Examples"));
}
