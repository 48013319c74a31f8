//! Ranges and distributions of the settings.

use super::*;

const MS: Duration = Duration::from_millis(1);

#[test]
fn uniform_jitter_is_a_half_width_and_normal_jitter_a_standard_deviation() {
    let uniform = Delay::uniform(50 * MS, 5 * MS);
    assert_eq!(uniform.quantile(0.0), 45 * MS);
    assert_eq!(uniform.quantile(0.5), 50 * MS);
    assert_eq!(uniform.quantile(0.75), Duration::from_micros(52_500));

    let normal = Delay {
        mean: 50 * MS,
        jitter: 5 * MS,
        shape: Shape::Normal,
    };
    assert_eq!(normal.quantile(0.5), 50 * MS);
    let one_sigma = normal.quantile(0.841_344_746_068_542_9).as_nanos();
    assert!(one_sigma.abs_diff(55_000_000) <= 1, "{one_sigma}");
}

#[test]
fn a_delay_is_never_negative() {
    let wide = Delay {
        mean: MS,
        jitter: 10 * MS,
        shape: Shape::Normal,
    };
    assert_eq!(wide.quantile(0.1), Duration::ZERO);
    assert!(wide.quantile(0.9) > MS);
}

#[test]
fn settings_out_of_range_are_refused_with_their_value() {
    let delay = DELAY_MAX + MS;
    let config = LinkConfig {
        delay: Delay::constant(delay),
        ..LinkConfig::default()
    };
    assert_eq!(config.check(), Err(ConfigError::DelayTooLong { delay }));
    for limit in [0, LIMIT_MAX + 1] {
        let config = LinkConfig {
            limit: Limit {
                packets: limit,
                ..Limit::default()
            },
            ..LinkConfig::default()
        };
        assert_eq!(config.check(), Err(ConfigError::LimitOutOfRange { limit }));
    }
    assert_eq!(LinkConfig::default().check(), Ok(()));
}

#[test]
fn a_probability_exists_from_zero_to_one_only() {
    assert_eq!(Probability::from_percent(100.0), Some(Probability::ONE));
    for percent in [-0.1, 100.1, f64::NAN, f64::INFINITY] {
        assert_eq!(Probability::from_percent(percent), None);
    }
    assert_eq!(Probability::from_parts_per_billion(1_000_000_001), None);
}
