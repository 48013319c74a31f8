//! The words mean what `docs/netem.md` says, and no text whatever panics.

use proptest::prelude::*;

use super::*;
use crate::config::ConfigError;

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
        Delay::Normal {
            mean: 50 * MS,
            sigma: 5 * MS
        }
    );
    let probability = Probability::from_percent(1.0).unwrap();
    assert_eq!(config.loss, Loss::Independent { probability });
    assert_eq!(config.order, Order::Fifo);
    assert_eq!(config.limit, LIMIT_DEFAULT);
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
fn plain_jitter_is_uniform() {
    let uniform = Delay::Uniform {
        mean: 50 * MS,
        half_width: 5 * MS,
    };
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

#[test]
fn what_tc_knows_and_we_do_not_is_named_and_never_ignored() {
    for (text, word) in [
        ("delay 50ms 5ms 25%", "25%"),
        ("loss 1% 25%", "25%"),
        ("loss gemodel 1% 10%", "gemodel"),
        ("loss state 1%", "state"),
        ("delay 50ms 5ms distribution pareto", "pareto"),
        ("delay 50ms rate 1mbit", "rate"),
        ("duplicate 1%", "duplicate"),
        ("corrupt 1%", "corrupt"),
        ("delay 10ms reorder 25% 50%", "reorder"),
        ("delay 10ms gap 5", "gap"),
        ("slot 1ms", "slot"),
        ("loss 1% ecn", "ecn"),
        ("seed 3", "seed"),
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
fn an_error_tells_the_word_its_column_and_what_was_expected() {
    for (text, column, word, part) in [
        ("delay", 6, "", "a time with its unit"),
        ("delay 5xs", 7, "5xs", "a time with its unit"),
        ("delay -5ms", 7, "-5ms", "a time with its unit"),
        ("delay 1e3ms", 7, "1e3ms", "a time with its unit"),
        ("delay nan", 7, "nan", "a time with its unit"),
        ("delay 2h", 7, "2h", "a time with its unit"),
        ("delay 50ms 3601s", 12, "3601s", "3600s at most"),
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
        ("delay 5ms é", 11, "é", "delay, loss"),
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
        "loss 100%",
    ] {
        assert_eq!(parsed(text).to_string(), text);
    }
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

fn any_time() -> impl Strategy<Value = Duration> {
    prop_oneof![
        (0..=3_600_000_000_000_u64).prop_map(Duration::from_nanos),
        (0..=3_600_000_u64).prop_map(Duration::from_millis),
    ]
}

fn any_config() -> impl Strategy<Value = LinkConfig> {
    let delay = prop_oneof![
        any_time().prop_map(|delay| Delay::Constant { delay }),
        (any_time(), any_time()).prop_map(|(mean, half_width)| Delay::Uniform { mean, half_width }),
        (any_time(), any_time()).prop_map(|(mean, sigma)| Delay::Normal { mean, sigma }),
    ];
    let loss = prop_oneof![
        Just(Loss::None),
        (0..=1_000_000_000_u32)
            .prop_filter_map("range", Probability::from_parts_per_billion)
            .prop_map(|probability| Loss::Independent { probability }),
    ];
    let order = prop_oneof![Just(Order::Fifo), Just(Order::Free)];
    (delay, loss, order, 1..=LIMIT_MAX).prop_map(|(delay, loss, order, limit)| LinkConfig {
        delay,
        order,
        loss,
        limit,
    })
}

/// Texts made of the language's own words and numbers, so that the parser gets far into them.
fn nearly_words() -> impl Strategy<Value = String> {
    let word = prop_oneof![
        prop::sample::select(vec![
            "delay",
            "loss",
            "random",
            "order",
            "fifo",
            "free",
            "limit",
            "none",
            "distribution",
            "normal",
            "uniform",
            "gemodel",
            "rate",
            "reorder",
            "%",
            "ms",
            "é",
            "\u{0}",
        ])
        .prop_map(str::to_owned),
        "[0-9.]{0,25}(s|ms|us|ns|%|)",
        "\\PC{0,4}",
    ];
    prop::collection::vec(word, 0..8).prop_map(|words| words.join(" "))
}

proptest! {
    #[test]
    fn printing_and_parsing_are_inverses(config in any_config()) {
        let text = config.to_string();
        prop_assert_eq!(text.parse::<LinkConfig>(), Ok(config));
    }

    #[test]
    fn whatever_parses_is_in_range_and_whatever_does_not_is_pointed_at(
        text in prop_oneof![nearly_words(), any::<String>()],
    ) {
        match text.parse::<LinkConfig>() {
            Ok(config) => {
                prop_assert_eq!(config.check(), Ok::<(), ConfigError>(()));
                prop_assert_eq!(config.to_string().parse(), Ok(config));
            }
            Err(error) => {
                let at: String = text
                    .chars()
                    .skip(error.column - 1)
                    .take(error.word.chars().count())
                    .collect();
                prop_assert_eq!(at, error.word.clone());
                prop_assert!(!error.to_string().is_empty());
                prop_assert!(error.pointer(&text).ends_with('^'));
            }
        }
    }
}
