//! What the command line takes, and how it answers what it does not take.

use std::time::Duration;

use clap::CommandFactory;
use mmt_lab::experiments::ALL;

use super::values::Period;
use super::*;

fn parse(words: &[&str]) -> Result<Command, String> {
    let all = ["mmt"].iter().chain(words);
    let parsed = Arguments::try_parse_from(all);
    parsed
        .map(|arguments| arguments.command)
        .map_err(|error| error.to_string())
}

fn complaint(words: &[&str]) -> String {
    parse(words).unwrap_err()
}

#[test]
fn the_command_line_is_consistent() {
    Arguments::command().debug_assert();
}

#[test]
fn the_demo_needs_no_argument_and_has_the_documented_defaults() {
    let Ok(Command::Demo(demo)) = parse(&["demo"]) else {
        panic!("no demo");
    };
    assert_eq!(demo.duration, Duration::from_secs(20));
    // the rest is the configuration's (mmt_lab::layers)
    assert!(demo.config.is_none() && demo.seed.is_none() && demo.netem.is_none());
    assert!(demo.mode.is_none() && demo.scheme.is_none() && !demo.json);
}

#[test]
fn a_duration_has_a_unit_and_a_range() {
    let seconds = |text| values::duration(text).map(|time| time.as_secs_f64());
    assert_eq!(seconds("20s"), Ok(20.0));
    assert_eq!(seconds("1.5s"), Ok(1.5));
    assert_eq!(seconds("500ms"), Ok(0.5));
    assert_eq!(seconds("2min"), Ok(120.0));
    assert_eq!(seconds("2m"), Ok(120.0));
    assert_eq!(seconds("1h"), Ok(3600.0));
    for wrong in [
        "", "20", "s", "-1s", "+1s", "0s", "nans", "infs", "1e3s", "169h", "1d", "1 s", "1..s", "é",
    ] {
        assert!(seconds(wrong).unwrap_err().contains("20s"), "{wrong}");
    }
}

#[test]
fn a_number_that_is_none_or_out_of_range_is_told_its_range() {
    let seed = "write a whole number from 0 to 18446744073709551615";
    let relay = ["netem", "--listen", "[::]:1", "--to", "h:1"];
    let clients = [&relay[..], &["--clients", "0"]].concat();
    for (words, range) in [
        (&["demo", "--seed", "1.5"][..], seed),
        (&["demo", "--seed", "abc"], seed),
        (&["demo", "--seed", "-1"], seed),
        (&["soak", "--seed", "18446744073709551616"], seed),
        (&["swarm", "--first", "-1"], seed),
        (&["swarm", "--jobs", "0"], "threads, 1 or more"),
        (&["swarm", "--seeds", "0"], "from 1 to 1000000"),
        (&["demo", "--repeat-samples", "32"], "from 0 to 31"),
        (&["demo", "--duration", "-5s"], "from 1ms to 168 h"),
        (
            &["reproduce", "fig5", "--duration", "-5s"],
            "from 1ms to 168 h",
        ),
        (&["config", "show", "--stiffness", "soft"], "write a number"),
        (&clients, "from 1 to 65535"),
    ] {
        let text = complaint(words);
        assert!(text.contains("invalid value"), "{words:?}: {text}");
        assert!(text.contains(range), "{words:?}: {text}");
    }
}

#[test]
fn a_wrong_word_of_a_network_has_a_caret_below_it() {
    let text = complaint(&["demo", "--netem", "delay 50ms los 1%"]);
    let lines: Vec<&str> = text.lines().collect();
    let at = lines
        .iter()
        .position(|line| line.trim() == "delay 50ms los 1%");
    let caret = lines[at.unwrap() + 1];
    assert_eq!(caret, format!("    {}^^^", " ".repeat(11)), "{text}");
    assert!(
        text.contains("--netem") && text.contains("write it as"),
        "{text}"
    );
}

#[test]
fn every_wrong_value_is_answered_with_its_option_and_what_would_be_right() {
    for (words, option, right) in [
        (
            &["slave", "--listen", "4433"][..],
            "--listen",
            "0.0.0.0:4433",
        ),
        (
            &["slave", "--listen", "[::]:1", "--advertise", "a b"],
            "--advertise",
            "host name",
        ),
        (
            &["slave", "--listen", "[::]:1", "--scheme", "hybrid 10%"],
            "--scheme",
            "hybrid 10% 150ms",
        ),
        (
            &["slave", "--listen", "[::]:1", "--mode", "best"],
            "--mode",
            "recommended",
        ),
        (&["slave"], "--listen", "required"),
        (
            &["master", "x", "--operator", "trace:"],
            "--operator",
            "trace:FILE",
        ),
        (
            &["master", "x", "--device", "phantom"],
            "--device",
            "falcon",
        ),
        (
            &["master", "x", "--samples-per-command", "33"],
            "--samples-per-command",
            "1 to 32",
        ),
        (&["master", "x", "--duration", "20"], "--duration", "20s"),
        (
            &["netem", "--listen", "[::]:1", "--to", "host"],
            "--to",
            "HOST:PORT",
        ),
        (&["replay", "f", "--deadband", "10"], "--deadband", "10%"),
        (
            &["replay", "f", "--t-update", "soon"],
            "--t-update",
            "150ms",
        ),
        (&["replay"], "FILE", "required"),
    ] {
        let text = complaint(words);
        assert!(
            text.contains(option) && text.contains(right),
            "{words:?}: {text}"
        );
    }
}

#[test]
fn the_pairing_string_is_not_in_what_is_shown_of_the_arguments() {
    let secret = "mmt://h:1?token=secret-token";
    let parsed = parse(&["master", secret]).unwrap();
    assert!(!format!("{parsed:?}").contains("secret-token"));
    let text = complaint(&["master", secret, "--duration", "x"]);
    assert!(!text.contains("secret-token"), "{text}");
}

#[test]
fn a_period_may_be_none_and_a_deadband_is_a_share() {
    assert_eq!(values::period("none"), Ok(Period(None)));
    assert_eq!(
        values::period("1s"),
        Ok(Period(Some(Duration::from_secs(1))))
    );
    assert_eq!(values::deadband("2.5%"), Ok(0.025));
    assert!(values::deadband("10% 5").is_err() && values::period("1ms 2").is_err());
}

#[test]
fn every_help_has_examples() {
    for command in Arguments::command().get_subcommands() {
        let help = command.clone().render_long_help().to_string();
        assert!(help.contains("Examples:"), "{}", command.get_name());
    }
}

#[test]
fn every_experiment_can_be_asked_for_and_all_of_them() {
    for name in ALL.iter().map(|experiment| experiment.name).chain(["all"]) {
        let Ok(Command::Reproduce(reproduce)) = parse(&["reproduce", name]) else {
            panic!("{name}");
        };
        let asked = reproduce.chosen.experiments;
        assert!(
            asked
                .iter()
                .all(|experiment| name == "all" || experiment.name == name)
        );
        assert!(!asked.is_empty());
    }
}

#[test]
fn an_observer_takes_nothing_over_and_has_no_hand() {
    let Ok(Command::Master(observer)) = parse(&["master", "mmt://…", "--observe"]) else {
        panic!("no master");
    };
    assert!(observer.observe);
    for words in [
        &["--take-over"][..],
        &["--operator", "pointer"],
        &["--device", "falcon"],
        &["--record", "file.mcap"],
        &["--stiffness", "500"],
    ] {
        let text = complaint(&[&["master", "mmt://…", "--observe"], words].concat());
        assert!(text.contains("cannot be used with"), "{text}");
        assert!(text.contains(words[0]), "{text}");
    }
    let listen = ["slave", "--listen", "127.0.0.1:0"];
    let observers = |words: &[&str]| match parse(&[&listen[..], words].concat()) {
        Ok(Command::Slave(slave)) => Ok(slave.observers),
        Ok(_) => panic!("no slave"),
        Err(text) => Err(text),
    };
    assert_eq!(observers(&[]), Ok(8));
    assert_eq!(observers(&["--observers", "0"]), Ok(0));
    assert_eq!(observers(&["--observers", "64"]), Ok(64));
    assert!(
        observers(&["--observers", "65"])
            .unwrap_err()
            .contains("0 to 64")
    );
}

#[test]
fn an_address_behind_a_space_is_refused_with_how_it_is_written() {
    let refusal = |words: &[&str]| {
        let words: Vec<String> = words.iter().map(|&word| word.to_owned()).collect();
        let error = Arguments::try_parse_from(&words).unwrap_err();
        hinted(error, &words).to_string()
    };
    for words in [
        &["mmt", "demo", "--console", "127.0.0.1:8080"][..],
        &["mmt", "master", "-", "--console", "127.0.0.1:8080"],
        &["mmt", "master", "--console", "127.0.0.1:8080", "-"],
    ] {
        let text = refusal(words);
        assert!(text.contains("write --console=127.0.0.1:8080"), "{text}");
    }
    let other = refusal(&["mmt", "demo", "--console", "--nonsense"]);
    assert!(!other.contains("write --console"), "{other}");
}
