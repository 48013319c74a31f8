//! The words mean what `docs/netem.md` says, and no text whatever panics.

mod generated;

use proptest::prelude::*;

use std::sync::Arc;

use super::*;
use crate::config::{
    Chance, Codel, ConfigError, Correlation, Cross, Delay, Framing, GilbertElliott, LIMIT_MAX,
    LIMIT_MAX_BYTES, Limit, Loss, Order, Outage, PacketList, Probability, Queue, RATE_MAX_BIT_S,
    Rate, Reorder, Service, Slot, SlotGap, TimedBursts,
};
use crate::distribution::Cdf;

const MS: Duration = Duration::from_millis(1);

fn parsed(text: &str) -> LinkConfig {
    text.parse().unwrap()
}

fn refused(text: &str) -> ParseError {
    text.parse::<LinkConfig>().unwrap_err()
}

#[test]
fn the_words_of_tc_are_taken_verbatim() {
    let config = parsed("delay 50ms 5ms distribution normal loss 1%");
    assert_eq!(
        config.delay,
        Delay {
            mean: 50 * MS,
            jitter: 5 * MS,
            shape: Shape::Normal
        }
    );
    let probability = Probability::from_percent(1.0).unwrap();
    assert_eq!(config.loss, Loss::Independent { probability });
    assert_eq!(config.order, Order::Fifo);
    assert_eq!(config.limit, Limit::default());
    assert_eq!(
        parsed("latency 50msec 5msecs distribution normal drop random 1"),
        config
    );
    assert_eq!(
        parsed("loss 1% distribution normal delay 0.05s 5000us"),
        config
    );
}

#[test]
fn times_have_the_units_of_the_command_line_too() {
    let (minute, hour) = (Duration::from_secs(60), Duration::from_secs(3600));
    assert_eq!(parsed("delay 1min").delay, Delay::constant(minute));
    assert_eq!(
        parsed("delay 1.5min").delay,
        Delay::constant(minute * 3 / 2)
    );
    assert_eq!(parsed("delay 1h").delay, Delay::constant(hour));
}

#[test]
fn plain_jitter_is_uniform() {
    let uniform = Delay::uniform(50 * MS, 5 * MS);
    assert_eq!(parsed("delay 50ms 5ms").delay, uniform);
    assert_eq!(parsed("delay 50ms 5ms distribution uniform").delay, uniform);
}

#[test]
fn nothing_and_none_are_the_link_that_does_nothing() {
    for text in ["", "  \t ", "none"] {
        assert_eq!(parsed(text), LinkConfig::default());
        assert!(parsed(text).is_transparent());
    }
    assert!(!parsed("delay 1ms").is_transparent());
    assert!(!parsed("loss 1%").is_transparent());
}

#[test]
fn a_bare_number_is_refused_because_tc_itself_reads_it_in_two_ways() {
    let error = refused("delay 50000");
    assert!(
        error.to_string().contains("tc reads a bare number"),
        "{error}"
    );
    assert_eq!(parsed("delay 0").delay, Delay::default());
}

/// The examples of the manual page tc-netem(8), and a sentence for each of its synopsis.
#[test]
fn what_the_manual_of_tc_shows_is_taken_as_it_stands() {
    for (text, printed) in [
        ("delay 100ms", "delay 100ms"),
        ("latency 100ms 10ms", "delay 100ms 10ms"),
        ("delay 100ms 10ms 25%", "delay 100ms 10ms 25%"),
        (
            "delay 100ms 20ms distribution normal",
            "delay 100ms 20ms distribution normal",
        ),
        ("loss 0.1%", "loss 0.1%"),
        ("loss random 0.3% 25%", "loss 0.3% 25%"),
        ("drop 1% ecn", "loss 1% ecn"),
        (
            "loss state 1% 90% 10% 50% 0.1%",
            "loss state 1% 90% 10% 50% 0.1%",
        ),
        (
            "loss gemodel 1% 10% 70% 0.1%",
            "loss gemodel 1% 10% 70% 0.1%",
        ),
        ("corrupt 0.1% 10%", "corrupt 0.1% 10%"),
        ("duplicate 1% 5%", "duplicate 1% 5%"),
        ("gap 5 delay 10ms", "delay 10ms reorder 100% gap 5"),
        ("delay 10ms reorder 25% 50%", "delay 10ms reorder 25% 50%"),
        (
            "delay 10ms reorder 25% 50% gap 5",
            "delay 10ms reorder 25% 50% gap 5",
        ),
        ("rate 5kbit 20 100 5", "rate 5kbit 20 100 5"),
        ("slot 20ms", "slot 20ms"),
        (
            "slot 800us 1ms packets 5 bytes 64000",
            "slot 800us 1ms packets 5 bytes 64000",
        ),
        (
            "slot distribution normal 4ms 1ms",
            "slot distribution normal 4ms 1ms",
        ),
        (
            "delay 10ms limit 1000 seed 42",
            "delay 10ms limit 1000 seed 42",
        ),
    ] {
        assert_eq!(parsed(text).to_string(), printed, "{text}");
    }
    // what could not do anything is told
    assert_eq!(refused("delay 5ms ecn").word, "ecn");
    assert_eq!(refused("gap 5").word, "gap");
    assert_eq!(refused("slot 2ms 1ms").word, "1ms");
    assert_eq!(refused("delay 5ms; at 1s seed 3").word, "1s");
}

#[test]
fn what_tc_knows_and_we_do_not_is_named_and_never_ignored() {
    for (text, word) in [
        ("delay 50ms 5ms distribution experimental", "experimental"),
        ("slot distribution experimental 1ms 1ms", "experimental"),
    ] {
        let error = refused(text);
        assert_eq!(error.word, word, "{text}");
        assert!(
            matches!(error.reason, Reason::NotSupportedYet { .. }),
            "{text}: {error}"
        );
    }
}

#[test]
fn an_error_shows_the_word_its_column_and_what_was_expected() {
    for (text, column, word, part) in [
        ("delay", 6, "", "a time with its unit"),
        ("delay 5xs", 7, "5xs", "a time with its unit"),
        ("delay -5ms", 7, "-5ms", "a time with its unit"),
        ("delay 1e3ms", 7, "1e3ms", "a time with its unit"),
        ("delay nan", 7, "nan", "a time with its unit"),
        ("delay 2d", 7, "2d", "a time with its unit"),
        ("delay 2h", 7, "2h", "3600s at most"),
        ("delay 61min", 7, "61min", "3600s at most"),
        ("delay 50ms 3601s", 12, "3601s", "3600s at most"),
        ("seed -1", 6, "-1", "expected a whole number"),
        (
            "delay 5ms distribution normal",
            11,
            "distribution",
            "jitter",
        ),
        ("loss 101%", 6, "101%", "0.0000001% to 100%"),
        ("loss 0.000000001%", 6, "0.000000001%", "0.0000001%"),
        ("loss half", 6, "half", "a percentage"),
        ("lag 5ms", 1, "lag", "delay, loss"),
        ("dealy 5ms", 1, "dealy", "; did you mean delay?"),
        ("preset 5g-dwn", 8, "5g-dwn", "; did you mean 5g-down?"),
        (
            "delay 5ms 1ms distribution norml",
            28,
            "norml",
            "; did you mean normal?",
        ),
        ("order random", 7, "random", "fifo or free"),
        ("limit 0", 7, "0", "1 to 1000000"),
        (
            "limit 99999999999999999999",
            7,
            "99999999999999999999",
            "1 to 1000000",
        ),
        ("limit +5", 7, "+5", "a number of packets"),
        ("loss 1% loss 2%", 9, "loss", "twice"),
        ("none delay 5ms", 6, "delay", "nothing beside none"),
        ("delay 5ms none", 11, "none", "nothing beside none"),
        ("délai 5ms", 1, "délai", "delay, loss"),
        ("delay 5ms; till 3s", 12, "till", "at TIME"),
        (
            "delay 5ms ; at 3s none; at 2s none",
            28,
            "2s",
            "after the step",
        ),
        ("delay 5ms; loop 3s", 12, "loop", "before a loop"),
        ("reorder 5%", 1, "reorder", "a delay beside it"),
        ("gap 5", 1, "gap", "a delay beside it"),
        ("queue 5ms", 1, "queue", "a rate beside it"),
        ("rate 0", 6, "0", "1bit to 1tbit"),
        ("rate 5furlong", 6, "5furlong", "a rate, such as"),
        ("rate 1mbit queue 5q", 18, "5q", "a time with its unit"),
        ("loss burst 1% 10us", 15, "10us", "1ms to 3600s"),
        ("loss state 60% 60% 60%", 6, "state", "100% together"),
        ("loss list 5-3", 11, "5-3", "3,17,100-120"),
        ("outage 5s 1s", 11, "1s", "for and how long"),
        ("outage 5s for 0s", 15, "0s", "1ns to 3600s"),
        (
            "delay cdf 5ms@0%,4ms@100%",
            11,
            "5ms@0%,4ms@100%",
            "must not fall",
        ),
        ("trace lan.json", 7, "lan.json", "on the command line only"),
        ("delay 5ms é", 11, "é", "delay, loss"),
        ("cross 2mbit poisson 1200", 1, "cross", "a rate beside it"),
        ("rate 9mbit cross 2mbit 1200", 24, "1200", "poisson"),
        ("rate 9mbit cross 2gbit poisson 1", 18, "2gbit", "packets/s"),
        ("delay 5ms; than loss 1%", 12, "than", "then and a link"),
        ("at 5s; loop 5s", 1, "at", "delay, loss"),
    ] {
        let error = refused(text);
        assert_eq!(
            (error.column, error.word.as_str()),
            (column, word),
            "{text}"
        );
        assert!(error.to_string().contains(part), "{text}: {error}");
    }
}

#[test]
fn the_pointer_stands_under_the_word() {
    let text = "delay 50ms\tlos 1%";
    assert_eq!(
        refused(text).pointer(text),
        "delay 50ms los 1%\n           ^^^"
    );
    let text = "loss";
    assert_eq!(refused(text).pointer(text), "loss\n    ^");
}

#[test]
fn settings_print_in_the_words_they_are_written_in() {
    for text in [
        "none",
        "delay 50ms",
        "delay 50ms 5ms",
        "delay 50ms 2500us distribution normal loss 0.25% order free limit 500",
        "delay 50ms 5ms 25% distribution pareto",
        "delay 50ms 5ms tau 100ms distribution paretonormal",
        "delay cdf 40ms@0%,50ms@90%,200ms@100% tau 1s",
        "delay 10ms reorder 25% 50% gap 5",
        "loss 1% 25%",
        "loss gemodel 1% 10% 70% 0.1%",
        "loss state 1% 90% 5% 30% 0.5%",
        "loss burst 2% 40ms 100% 0%",
        "loss every 100",
        "loss list 3,17,100-120 outage 10s for 500ms outage 20s for 1s every 60s",
        "duplicate 1% 10% corrupt 0.1% mtu 1200",
        "rate 1mbit 28 queue 64000b 100p 50ms codel limit 20",
        "rate 64kbit -14 48 5 codel 20ms 200ms",
        "rate 1mbit queue 100p drop-head codel",
        "delay 20ms; at 10s over 5s delay 80ms loss 2%; at 20s none; loop 30s",
        "loss 100%",
        "rate 10mbit 28 queue 100p cross 2mbit poisson 1200",
        "delay 5ms loss 1%; then rate 10mbit; then none",
        "delay 20ms; at 10s delay 80ms; loop 30s; then delay 5ms; at 1s loss 2%",
    ] {
        assert_eq!(parsed(text).to_string(), text);
    }
}

#[test]
fn a_chain_has_eight_links_at_most_and_a_preset_can_be_any_of_them() {
    let chain = |links: usize| vec!["delay 1ms"; links].join("; then ");
    assert_eq!(parsed(&chain(8)).links().count(), 8);
    let error = refused(&chain(9));
    assert_eq!(error.word, "then");
    assert!(error.to_string().contains("8 links"), "{error}");
    let chain = parsed("preset lan; then preset geo loss 1%");
    let then = chain.then.as_deref();
    assert_eq!(then, Some(&parsed("preset geo loss 1%")));
    assert_eq!(
        LinkConfig {
            then: None,
            ..chain
        },
        parsed("preset lan")
    );
    assert!(parsed("none; then none").is_transparent());
    assert!(!parsed("none; then delay 1ms").is_transparent());
    assert_eq!(
        parsed("delay 5ms 1ms; then delay 9ms 2ms").jitter_span(),
        6 * MS
    );
}

#[test]
fn a_configuration_file_holds_a_link_as_its_words() {
    let json = "\"delay 50ms 5ms loss 1%\"";
    let config: LinkConfig = serde_json::from_str(json).unwrap();
    assert_eq!(config, parsed("delay 50ms 5ms loss 1%"));
    assert_eq!(serde_json::to_string(&config).unwrap(), json);
    let error = serde_json::from_str::<LinkConfig>("\"lag 5ms\"").unwrap_err();
    assert!(
        error.to_string().contains("expected delay, loss"),
        "{error}"
    );
}
