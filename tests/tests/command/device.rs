//! `mmt device`: what it finds, and how it ends.

use std::net::TcpListener;

use super::{document, mmt};

/// An address of this host at which nobody listens.
fn nobody() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().to_string()
}

#[test]
fn the_list_names_every_kind_and_ends_well_with_or_without_devices() {
    let home = tempfile::tempdir().unwrap();
    let at = nobody();
    let list = ["device", "list", "--service", &at];
    let output = mmt(&home, &list).output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let text = String::from_utf8(output.stdout).unwrap();
    for kind in ["link", "inverse3", "2diy"] {
        assert!(text.lines().any(|line| line.starts_with(kind)), "{text}");
    }
    let output = mmt(&home, &[&list[..], &["--json"]].concat()).output();
    let document = document(&output.unwrap());
    assert_eq!(document["inverse3"]["reachable"], false);
    assert_eq!(document["inverse3"]["service"], at.as_str());
    assert!(document["inverse3"]["why"].is_string());
    assert!(document["2diy"]["ports"].is_array());
}

#[test]
fn a_device_that_is_not_there_ends_with_its_exit_code_and_what_to_do() {
    let home = tempfile::tempdir().unwrap();
    let at = nobody();
    let file = home.path().join("device.toml");
    let test = |words: &[&str], keys: &str| {
        std::fs::write(&file, keys).unwrap();
        let config = ["--device-config", "device.toml"];
        let config: &[&str] = if keys.is_empty() { &[] } else { &config };
        let all = [&["device", "test"][..], words, config].concat();
        let output = mmt(&home, &all).output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            output.stdout.is_empty() && !text.contains("panicked"),
            "{text}"
        );
        (output.status.code(), text)
    };
    for (words, keys, code, parts) in [
        (
            &["--device", "inverse3", "--device-at", &at][..],
            "",
            4,
            &["no Inverse Service", "Haply Hub"][..],
        ),
        (
            &["--device", "2diy", "--device-at", "/dev/no-such-port"],
            "",
            2,
            &["/dev/no-such-port", "mmt device list"],
        ),
        (&["--device", "falcon"], "", 2, &["add --device link"]),
        (
            &["--device", "link", "--device-at", &at],
            "",
            2,
            &["--device-at goes with --device inverse3 or 2diy only"],
        ),
        (
            &["--device", "2diy", "--device-listen", &at],
            "",
            2,
            &["--device-listen goes with --device link only"],
        ),
        (
            &["--device", "inverse3", "--device-at", "192.0.2.1:10001"],
            "",
            2,
            &["192.0.2.1", "--device-insecure"],
        ),
        (
            &["--device", "inverse3", "--device-at", "here"],
            "",
            2,
            &["--device-at", "127.0.0.1:10001"],
        ),
        (
            &["--device", "inverse3", "--force", "20"],
            "",
            2,
            &["--force", "0 to 2"],
        ),
        (
            &["--device", "inverse3", "--device-at", &at],
            "version = \"2\"\n",
            2,
            &["version goes with --device 2diy only"],
        ),
        (
            &["--device", "2diy", "--device-at", "/dev/null"],
            "version = \"4\"\n",
            2,
            &["line 1", "^^^"],
        ),
        (
            &["--device", "2diy", "--device-at", "/dev/null"],
            "torque_max_nm = 30.0\n",
            2,
            &["torque_max_nm 30 ", "0.01 to 2 Nm", "--device-config"],
        ),
        (
            &["--device", "2diy", "--device-at", "/dev/null"],
            "hold = \"button\"\n",
            2,
            &["has no button"],
        ),
        (
            &["--device", "2diy", "--device-at", "/dev/null"],
            "",
            2,
            &["/dev/null cannot be used"],
        ),
    ] {
        let (found, text) = test(words, keys);
        assert_eq!(found, Some(code), "{words:?}: {text}");
        for part in parts {
            assert!(text.contains(part), "{part} is missing in: {text}");
        }
    }
}
