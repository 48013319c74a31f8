//! From arguments to options, and from errors to exit codes.

use clap::Parser;
use mmt_shared::wire::Ending;

use super::*;
use crate::args::{Arguments, Command};

fn arguments(words: &[&str]) -> MasterArguments {
    let all = ["mmt", "master"].iter().chain(words);
    match Arguments::parse_from(all).command {
        Command::Master(arguments) => arguments,
        _ => panic!("not a master"),
    }
}

fn pairing_string() -> String {
    let (pin, token) = ("0f".repeat(32), "a5".repeat(32));
    format!("mmt://localhost:4433?pin={pin}&token={token}")
}

fn complaint(words: &[&str]) -> String {
    let failure = options(&arguments(words)).unwrap_err();
    assert_eq!(failure.exit(), Exit::Usage);
    failure.to_string()
}

#[test]
fn the_options_say_what_the_arguments_said() {
    let pairing = pairing_string();
    let words = [
        &pairing,
        "--device",
        "falcon",
        "--stiffness",
        "2000",
        "--seed",
        "7",
    ];
    let (options, _) = options(&arguments(&words)).unwrap();
    assert_eq!(options.pairing.to_string(), pairing);
    assert_eq!(options.device.stiffness_n_per_m(), 2000.0);
    assert_eq!(
        (options.netem_seed, options.commands),
        (7, CommandConfig::default())
    );
    assert_eq!(options.duration, None);
    let OperatorChoice::Scripted(scripted) = options.operator else {
        panic!("not scripted");
    };
    assert_eq!(scripted.seed, 7);
}

#[test]
fn a_csv_trace_starts_in_front_of_the_face() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("path.csv");
    std::fs::write(&path, "t_s,x_m,y_m\n0,1,1\n1,1.5,1\n").unwrap();
    let trace = trace(&path, None).unwrap();
    let (_, first) = trace.samples()[0];
    assert_eq!((first.x, first.y), TRACE_START_M);
    assert!(super::trace(&path, Some(0)).is_err());
}

#[test]
fn each_wrong_input_is_named_with_what_to_do() {
    let pairing = pairing_string();
    let cut = complaint(&[&pairing[..60]]);
    assert!(
        cut.contains("PAIRING") && cut.contains("copy the whole line"),
        "{cut}"
    );
    let soft = complaint(&[&pairing, "--stiffness", "1e9"]);
    assert!(
        soft.contains("--stiffness") && soft.contains("3000"),
        "{soft}"
    );
    let lone = complaint(&[&pairing, "--push", "1"]);
    assert!(
        lone.contains("--push") && lone.contains("what to do"),
        "{lone}"
    );
    let none = complaint(&[&pairing, "--operator", "trace:no-such.csv"]);
    assert!(
        none.contains("no-such.csv") && none.contains("check the path"),
        "{none}"
    );
}

#[test]
fn a_pointer_without_a_console_is_refused_as_a_hand_that_nobody_can_take() {
    let words = [&pairing_string(), "--operator", "pointer", "--no-console"];
    let nobody = complaint(&words);
    assert!(
        nobody.contains("--no-console") && nobody.contains("what to do"),
        "{nobody}"
    );
}

#[test]
fn a_session_that_broke_is_a_failure_and_one_that_was_ended_is_not() {
    assert!(judge(Some(SessionEnd::LinkSilent)).is_err());
    assert!(judge(Some(SessionEnd::SlaveEnded(Ending::Failed))).is_err());
    for fine in [
        None,
        Some(SessionEnd::Stopped),
        Some(SessionEnd::DurationOver),
    ] {
        assert_eq!(judge(fine), Ok(()));
    }
}

#[test]
fn a_refusal_and_silence_have_exit_codes_of_their_own() {
    let address = std::net::SocketAddr::from(([127, 0, 0, 1], 1));
    assert_eq!(
        host_failure(&MasterHostError::Busy { address }).exit(),
        Exit::Refused
    );
    let limit = std::time::Duration::from_secs(5);
    let silent = MasterHostError::from(ConnectError::NoAnswer { address, limit });
    assert_eq!(host_failure(&silent).exit(), Exit::NoAnswer);
    assert_eq!(host_failure(&MasterHostError::Hung).exit(), Exit::Hung);
}
