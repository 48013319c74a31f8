//! Of arguments and files, what a slave is started with; what is printed; how it ends.

use clap::Parser;
use mmt_shared::model::settings::Mode;

use super::*;
use crate::args::{Arguments, Command};

fn options_of(words: &[&str]) -> SlaveOptions {
    let home = tempfile::tempdir().unwrap();
    let identity = home.path().display().to_string();
    let all = [
        "mmt",
        "slave",
        "--listen",
        "127.0.0.1:0",
        "--identity",
        &identity,
    ];
    match Arguments::parse_from(all.iter().chain(words)).command {
        Command::Slave(arguments) => options(&arguments, home.path()).unwrap(),
        _ => panic!("not a slave"),
    }
}

#[test]
fn the_command_line_comes_before_the_file_and_the_file_before_the_mode() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("slave.toml");
    std::fs::write(&path, "seed = 5\nmode = \"paper\"\n").unwrap();
    let file = path.display().to_string();
    let from_file = options_of(&["--config", &file]);
    assert_eq!(
        (from_file.config.seed, from_file.config.mode),
        (5, Mode::Paper)
    );
    assert_eq!(from_file.netem_seed, 5);
    let scheme = [
        "--scheme",
        "timer 50ms",
        "--seed",
        "6",
        "--mode",
        "recommended",
    ];
    let both = options_of(&[&["--config", file.as_str()], &scheme[..]].concat());
    assert_eq!((both.config.seed, both.config.mode), (6, Mode::Recommended));
    assert_eq!(both.config.trigger.scheme.to_string(), "timer 50ms");
}

#[test]
fn repeats_and_stretch_are_the_modes_unless_the_file_or_the_command_line_states_otherwise() {
    let of = |words: &[&str]| {
        let config = options_of(words).config;
        (config.repeats_ms.to_string(), config.stretch_max.get())
    };
    assert_eq!(of(&[]), ("10ms 30ms".to_owned(), 3.0));
    assert_eq!(of(&["--mode", "paper"]), ("none".to_owned(), 1.0));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("slave.toml");
    std::fs::write(&path, "repeats_ms = [5, 20.5]\nstretch_max = 2\n").unwrap();
    let file = path.display().to_string();
    assert_eq!(of(&["--config", &file]), ("5ms 20.5ms".to_owned(), 2.0));
    let both = ["--config", &file, "--repeats", "none", "--stretch-max", "1"];
    assert_eq!(of(&both), ("none".to_owned(), 1.0));
}

#[test]
fn a_loop_that_has_hung_has_an_exit_code_of_its_own() {
    assert_eq!(host_failure(&SlaveHostError::Hung).exit(), Exit::Hung);
    assert_eq!(host_failure(&SlaveHostError::Panicked).exit(), Exit::Failed);
}

#[test]
fn a_slave_that_nobody_came_to_still_has_a_report() {
    let report = unserved(&options_of(&["--once"]));
    assert_eq!(report.ending, Some("interrupted"));
    assert_eq!(report.seed, Some(1));
}

#[test]
fn only_the_session_of_a_slave_that_serves_once_decides_how_it_ends() {
    let ended = |ending: Ending| {
        let mut report = unserved(&options_of(&[]));
        report.ending = Some(ending.name());
        report
    };
    assert!(judge(true, Some(&ended(Ending::Failed))).is_err());
    assert_eq!(judge(false, Some(&ended(Ending::Failed))), Ok(()));
    for fine in [Ending::Finished, Ending::Interrupted] {
        assert_eq!(judge(true, Some(&ended(fine))), Ok(()));
    }
    assert_eq!(judge::<()>(true, None), Ok(()), "nobody came");
}

#[test]
fn a_slave_that_no_other_host_reaches_reports_that_and_shows_no_secret() {
    let pairing = |host: &str| {
        let text = format!("mmt://{host}:4433?pin={0}&token={0}", "5a".repeat(32));
        text.parse::<Pairing>().unwrap()
    };
    let lost = waiting(&pairing("127.0.0.1"), true);
    assert!(lost.contains("--advertise"), "{lost}");
    for (host, everywhere) in [("127.0.0.1", false), ("192.0.2.7", true), ("robot", true)] {
        let text = waiting(&pairing(host), everywhere);
        assert!(
            !text.contains("--advertise") && !text.contains("5a5a"),
            "{text}"
        );
        assert!(text.contains(&format!("{host}:4433")), "{text}");
    }
}
