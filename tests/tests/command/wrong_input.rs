//! Wrong input of every kind: exit code 2, a message that says what, where and what to do, no panic.

use std::process::Output;

/// Runs `mmt` with these arguments, with a directory of its own for everything that it keeps.
fn mmt(arguments: &[&str]) -> (Output, tempfile::TempDir) {
    let home = tempfile::tempdir().unwrap();
    let output = super::mmt(&home, arguments).output().unwrap();
    (output, home)
}

/// Checks that the command refuses these arguments with a message that has these parts.
fn refuses(arguments: &[&str], parts: &[&str]) {
    let (output, _home) = mmt(arguments);
    complains(&output, 2, parts);
}

fn complains(output: &Output, code: i32, parts: &[&str]) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(output.stdout.is_empty(), "data on stdout");
    assert!(
        !text.contains("panicked") && !text.contains("RUST_BACKTRACE"),
        "{text}"
    );
    for part in parts {
        assert!(text.contains(part), "{part} is missing in: {text}");
    }
}

fn pairing() -> String {
    let (pin, token) = ("0f".repeat(32), "a5".repeat(32));
    format!("mmt://127.0.0.1:9?pin={pin}&token={token}")
}

#[test]
fn wrong_arguments_are_refused_with_the_option_and_what_would_be_right() {
    refuses(&["fly"], &["fly", "--help"]);
    refuses(
        &["demo", "--duration", "20"],
        &["--duration", "such as 20s"],
    );
    refuses(&["demo", "--netem", "delay 50"], &["--netem", "^^", "50ms"]);
    refuses(&["slave"], &["--listen"]);
    refuses(
        &["slave", "--listen", "4433"],
        &["--listen", "0.0.0.0:4433"],
    );
    refuses(&["replay"], &["FILE"]);
}

#[test]
fn a_wrong_trace_or_record_is_refused_with_its_line() {
    let home = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(home.path().join(name), text).unwrap();
    write("lens.csv", "timestamp,rtt\n1.0,5\n2.0,x\n");
    write("record.csv", "# mmt netem record 1\nup,1\n");
    for (arguments, parts) in [
        (
            &["demo", "--netem", "trace lens.csv"][..],
            &["--netem", "^^^^^^^^", "line 3"][..],
        ),
        (
            &["demo", "--netem", "rate trace none.up"],
            &[
                "none.up\", column 12: cannot read",
                "^^^^^^^",
                "check the path",
            ],
        ),
        (
            &["netem", "report", "record.csv"],
            &["record.csv", "line 2", "nine fields"],
        ),
        (
            &["netem", "trace", "record.csv", "record.csv"],
            &["record.csv", "neither pcap nor pcapng", "two captures"],
        ),
        (
            &["netem", "report", "none.csv"],
            &["none.csv", "check the path"],
        ),
        (&["netem"], &["--listen"]),
    ] {
        complains(&super::mmt(&home, arguments).output().unwrap(), 2, parts);
    }
}

#[test]
fn a_file_that_holds_something_else_or_is_being_written_is_refused_and_nothing_is_lost() {
    let home = tempfile::tempdir().unwrap();
    let file = home.path().join("c.toml");
    std::fs::write(&file, "seed = 3\n").unwrap();
    let pairing = pairing();
    let other = "cannot write the";
    for arguments in [
        &["demo", "--config", "c.toml", "--record", "c.toml"][..],
        &["demo", "--netem-record", "c.toml"],
        &["master", &pairing, "--record-path", "c.toml"],
    ] {
        let parts = [
            other,
            "c.toml: it holds something else, which would be lost",
        ];
        complains(&super::mmt(&home, arguments).output().unwrap(), 2, &parts);
    }
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "seed = 3\n");
    let twice = ["demo", "--record", "z", "--netem-record", "z"];
    let parts = [
        other,
        "another run writes it, or another option of this one",
    ];
    complains(&super::mmt(&home, &twice).output().unwrap(), 2, &parts);
    // before a session begins, not after it
    let nowhere = ["master", &pairing, "--record-path", "none/x.csv"];
    let parts = ["cannot write the path none/x.csv", "what to do"];
    complains(&super::mmt(&home, &nowhere).output().unwrap(), 2, &parts);
}

#[test]
fn a_record_without_a_session_is_refused() {
    let home = tempfile::tempdir().unwrap();
    std::fs::write(home.path().join("empty"), "").unwrap();
    // as a process leaves it that is killed at once
    std::fs::write(home.path().join("head"), b"\x89MCAP0\r\n\x01\x10").unwrap();
    for arguments in [
        ["report", "empty"],
        ["export", "empty"],
        ["report", "head"],
        ["replay", "head"],
    ] {
        let parts = ["there is no session in th", "made with --record"];
        complains(&super::mmt(&home, &arguments).output().unwrap(), 2, &parts);
    }
}

#[test]
fn the_same_mistake_has_the_same_code_and_sentence_in_every_command() {
    let home = tempfile::tempdir().unwrap();
    std::fs::write(
        home.path().join("plan.toml"),
        "duration_s = 5\nseeds = { first = 1, count = 1 }\n",
    )
    .unwrap();
    std::fs::write(home.path().join("file"), "no folder").unwrap();
    let commands = [
        &["reproduce", "fig5"][..],
        &["sweep", "plan.toml"],
        &["man"],
    ];
    let folder = [
        "cannot make the folder file/under: Not a directory",
        "give another one with --out",
    ];
    for command in commands {
        let arguments = [command, &["--out", "file/under"]].concat();
        complains(&super::mmt(&home, &arguments).output().unwrap(), 2, &folder);
    }
    for command in &commands[..2] {
        let arguments = [command, &["--jobs", "0"][..]].concat();
        let parts = [
            "invalid value '0' for '--jobs <N>': write a whole number",
            "1 or more",
        ];
        complains(&super::mmt(&home, &arguments).output().unwrap(), 2, &parts);
    }
}

#[test]
fn a_wrong_pairing_string_is_refused_without_showing_its_secret() {
    let whole = pairing();
    let cut = &whole[..whole.len() - 1];
    for (text, parts) in [
        ("localhost:4433", &["PAIRING", "mmt slave"][..]),
        ("mmt://h:1", &["no pin", "quotes"]),
        (cut, &["63 characters", "copy the whole line"]),
    ] {
        let (output, _home) = mmt(&["master", text]);
        complains(&output, 2, parts);
        assert!(!String::from_utf8_lossy(&output.stderr).contains("a5a5a5"));
    }
}

#[test]
fn a_wrong_configuration_is_refused_with_line_and_caret() {
    let home = tempfile::tempdir().unwrap();
    let file = home.path().join("slave.toml");
    for (text, parts) in [
        (
            "seed = 1\nmas_kg = 0.7\n",
            &["slave.toml", "line 2", "^^^^^^", "mas_kg", "what to do"][..],
        ),
        (
            "[environment]\nmass_kg = \"heavy\"\n",
            &["line 2", "^", "heavy"],
        ),
        (
            "[environment]\nmass_kg = -1.0\n",
            &["mass", "-1", "what to do"],
        ),
        (
            "tool_force_max_n = 0.0\n",
            &["tool force", "limit 0 ", "0.1 to 1000 N", "what to do"],
        ),
        ("tool_force_max_n = nan\n", &["tool force", "NaN"]),
        ("= 1", &["line 1"]),
    ] {
        std::fs::write(&file, text).unwrap();
        let arguments = ["slave", "--listen", "127.0.0.1:0", "--config", "slave.toml"];
        complains(&super::mmt(&home, &arguments).output().unwrap(), 2, parts);
    }
    refuses(
        &["slave", "--listen", "127.0.0.1:0", "--config", "none.toml"],
        &["none.toml", "check the path"],
    );
}

#[test]
fn a_stiffness_that_the_device_has_not_is_refused_with_line_and_caret_by_every_command_with_a_hand()
{
    let home = tempfile::tempdir().unwrap();
    std::fs::write(home.path().join("c.toml"), "stiffness_n_per_m = 1e9\n").unwrap();
    let pairing = pairing();
    for command in [
        &["demo"][..],
        &["master", &pairing],
        &["config", "show"],
        &["config", "show", "master"],
    ] {
        let arguments = [command, &["--config", "c.toml"]].concat();
        let parts = [
            "c.toml: line 1, column 21",
            "^^^",
            "50 to 3000 N/m",
            "correct that place",
        ];
        complains(&super::mmt(&home, &arguments).output().unwrap(), 2, &parts);
    }
    for command in [&["master", &pairing][..], &["config", "show", "master"]] {
        let arguments = [command, &["--stiffness", "1e9"]].concat();
        let parts = [
            "error: --stiffness: stiffness 1000000000",
            "change that option",
        ];
        refuses(&arguments, &parts);
    }
}

#[test]
fn a_scene_that_cannot_be_is_refused_by_its_own_file() {
    let home = tempfile::tempdir().unwrap();
    for (text, parts) in [
        ("[[bodies]]\n[[bodies]]\n", &["bodies 1 and 2 overlap"][..]),
        (
            "contact_friction = 6\n",
            &["line 1, column 20", "^", "contact friction 6"],
        ),
        (
            "[[walls]]\ndistance_m = 0\n",
            &["wall 1 of the scene", "0.18 to 10 m"],
        ),
    ] {
        std::fs::write(home.path().join("sc.toml"), text).unwrap();
        let arguments = ["demo", "--scene", "sc.toml"];
        let output = super::mmt(&home, &arguments).output().unwrap();
        complains(&output, 2, &["the scene sc.toml: line 1", "docs/scenes.md"]);
        complains(&output, 2, parts);
    }
}

#[test]
fn an_option_without_the_one_that_it_goes_with_is_refused() {
    let listen = ["--plant-listen", "127.0.0.1:0"];
    let parts = ["--plant-listen goes with --plant link only", "leave it out"];
    for command in [
        &["slave", "--listen", "127.0.0.1:0"][..],
        &["bench", "plant"],
    ] {
        refuses(&[command, &listen].concat(), &parts);
    }
}

#[cfg(not(feature = "live"))]
#[test]
fn a_build_without_mmt_live_names_where_it_is() {
    for arguments in [&["live", "run.mcap"][..], &["live", "--help"]] {
        let parts = ["this build of mmt has no `mmt live`", "--features live"];
        refuses(arguments, &parts);
    }
    refuses(&["fly", "live"], &["unrecognized subcommand"]);
}

#[test]
fn a_wrong_trace_is_refused_with_file_and_line() {
    let home = tempfile::tempdir().unwrap();
    let pairing = pairing();
    for (name, text, parts) in [
        (
            "a.csv",
            "t_s,x_m,y_m\n0,0,zero\n",
            &["a.csv", "line 2", "y_m", "zero"][..],
        ),
        ("b.csv", "0,0,0\n", &["b.csv", "line 1", "t_s,x_m,y_m"]),
        ("c.txt", "1 2 3", &["c.txt", "line 1", "what to do"]),
        ("d.txt", "", &["d.txt", "line 1"]),
    ] {
        std::fs::write(home.path().join(name), text).unwrap();
        let operator = format!("trace:{name}");
        let arguments = ["master", &pairing, "--operator", &operator];
        complains(&super::mmt(&home, &arguments).output().unwrap(), 2, parts);
    }
}

#[test]
fn a_wrong_recording_is_refused_before_any_is_replayed() {
    let home = tempfile::tempdir().unwrap();
    std::fs::write(home.path().join("binary.txt"), [0xff, 0xfe]).unwrap();
    let output = super::mmt(&home, &["replay", "binary.txt"])
        .output()
        .unwrap();
    complains(&output, 2, &["binary.txt", "UTF-8"]);
    refuses(&["replay", "none.txt"], &["none.txt", "check the path"]);
    refuses(&["replay", "."], &["path of a file"]);
}

#[test]
fn a_file_beside_a_record_that_is_neither_record_nor_pushes_is_named() {
    let home = tempfile::tempdir().unwrap();
    std::fs::write(home.path().join("run.mcap"), b"\x89MCAP0\r\n").unwrap();
    std::fs::write(home.path().join("plan.toml"), "seeds = 1\n").unwrap();
    for (file, parts) in [
        ("none.txt", &["none.txt", "check the path"][..]),
        (
            "plan.toml",
            &["plan.toml is no record", "line 1", "what to do"],
        ),
    ] {
        let output = super::mmt(&home, &["replay", "run.mcap", file]).output();
        complains(&output.unwrap(), 2, parts);
    }
}

#[test]
fn an_address_in_use_has_an_exit_code_of_its_own() {
    let taken = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    for arguments in [
        &["slave", "--listen", &address][..],
        &["netem", "--listen", &address, "--to", "127.0.0.1:9"],
    ] {
        let (output, _home) = mmt(arguments);
        complains(&output, 5, &[&address, "--listen", "port 0"]);
    }
    let linked = ["bench", "plant", "--plant", "link", "--plant-listen"];
    let (output, _home) = mmt(&[&linked[..], &[&address]].concat());
    complains(&output, 5, &[&address, "--plant-listen", "port 0"]);
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let console = format!("--console={address}");
    let (output, _home) = mmt(&["demo", "--duration", "1s", &console]);
    complains(&output, 5, &[&address, "--console", "port 0"]);
}

#[test]
fn a_wrong_log_filter_is_refused_by_the_name_of_its_variable() {
    let home = tempfile::tempdir().unwrap();
    let output = super::mmt(&home, &["replay", "x"])
        .env("MMT_LOG", "mmt=loud")
        .output();
    complains(&output.unwrap(), 2, &["MMT_LOG", "debug"]);
}

#[test]
fn nobody_reading_stdout_is_no_panic() {
    let home = tempfile::tempdir().unwrap();
    for arguments in [
        &["--help"][..],
        &[
            "netem",
            "--listen",
            "127.0.0.1:0",
            "--to",
            "127.0.0.1:9",
            "--duration",
            "1ms",
        ],
    ] {
        let mut child = super::mmt(&home, arguments).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.success() && !text.contains("panicked"),
            "{text}"
        );
    }
}
