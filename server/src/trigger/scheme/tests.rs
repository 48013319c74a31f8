//! The promises of `scheme`.

use super::*;

#[test]
fn what_is_displayed_is_read_back() {
    for text in [
        "deadband 2.5%",
        "hybrid 10% 150ms",
        "timer 50ms",
        "every-sample",
        "dis 0.3N 1000ms",
        "useful 10% 150ms",
        "adaptive 10% 50ms",
    ] {
        let scheme: Scheme = text.parse().unwrap();
        assert_eq!(scheme.to_string(), text);
        assert_eq!(scheme.to_string().parse(), Ok(scheme));
    }
    assert_eq!("dis 0.3N 1s".parse(), "dis 0.3N 1000ms".parse::<Scheme>());
}

#[test]
fn stretching_widens_thresholds_and_times_and_one_changes_nothing() {
    for (text, thrice) in [
        ("deadband 10%", "deadband 30%"),
        ("deadband 60%", "deadband 100%"),
        ("hybrid 10% 150ms", "hybrid 30% 450ms"),
        ("timer 50ms", "timer 150ms"),
        ("every-sample", "every-sample"),
        ("dis 0.5N 1s", "dis 1.5N 3s"),
        ("useful 10% 150ms", "useful 30% 450ms"),
        ("adaptive 10% 50ms", "adaptive 30% 150ms"),
    ] {
        let scheme: Scheme = text.parse().unwrap();
        let thrice: Scheme = thrice.parse().unwrap();
        assert_eq!(scheme.stretched(3.0).to_string(), thrice.to_string());
        for by in [1.0, 0.5, f64::NAN, f64::INFINITY] {
            assert_eq!(scheme.stretched(by), scheme, "{text} by {by}");
        }
    }
}

#[test]
fn what_is_wrong_is_named() {
    let error = |text: &str| text.parse::<Scheme>().unwrap_err().to_string();
    assert!(error("").starts_with("unknown update scheme ''"));
    assert!(error("dedband 10%").starts_with("unknown update scheme 'dedband'"));
    assert_eq!(
        error("hybrid 10%"),
        "the scheme 'hybrid' is written 'hybrid 10% 150ms', not 'hybrid 10%'"
    );
    let range = "is not a time from 1 to 60000 ms, as in 'timer 150ms'";
    for word in ["nans", "inf", "0ms", "61s", "150min"] {
        assert_eq!(error(&format!("timer {word}")), format!("'{word}' {range}"));
    }
    assert_eq!(
        error("dis 10% 1s"),
        "'10%' is not a force from 0.001 to 100 N, as in 'dis 0.3N 1000ms'"
    );
}

#[test]
fn a_number_without_its_unit_is_answered_with_its_units_and_not_a_range() {
    for (text, message) in [
        (
            "deadband 10",
            "the deadband '10' has no unit (%), as in 'deadband 10%'",
        ),
        (
            "dis 0.3 1s",
            "the force '0.3' has no unit (N), as in 'dis 0.3N 1000ms'",
        ),
        (
            "hybrid 10% 150",
            "the time '150' has no unit (ms or s), as in 'hybrid 10% 150ms'",
        ),
        (
            "adaptive 0 50ms",
            "the deadband '0' has no unit (%), as in 'adaptive 10% 50ms'",
        ),
    ] {
        assert_eq!(text.parse::<Scheme>().unwrap_err().to_string(), message);
    }
}
