//! Delays against their distributions and correlations. Kolmogorov–Smirnov at one false alarm in 1000
//! (1.95); seeds are fixed.

use super::*;

fn drawn(words: &str, seed: u64) -> Vec<f64> {
    let drawn = delays(&fates(words, seed, LinkId::UP));
    drawn.into_iter().flatten().collect()
}

/// The correlation of neighbours `lag` packets apart.
fn correlation(values: &[f64], lag: usize) -> f64 {
    let (mean, sd) = mean_and_sd(values);
    let pairs = values.iter().zip(&values[lag..]);
    let sum: f64 = pairs.map(|(a, b)| (a - mean) * (b - mean)).sum();
    sum / (values.len() - lag) as f64 / (sd * sd)
}

fn normal(x: f64) -> f64 {
    0.5 * libm::erfc(-x / std::f64::consts::SQRT_2)
}

#[test]
fn the_heavy_tails_are_those_named() {
    let pareto = |x: f64| 1.0 - ((x - 50.0) / 5.0 * 0.75 + 1.5).powi(-3);
    // the cut at 4 J leaves a step of 1.1 % that is not compared
    let mut values = drawn("delay 50ms 5ms distribution pareto order free", 101);
    assert!(values.iter().all(|x| *x < 70.0));
    let below: Vec<f64> = values.iter().copied().filter(|x| *x < 69.9).collect();
    assert!((below.len() as f64 / N as f64 - pareto(69.9)).abs() < 0.002);
    values = below;
    let ks = kolmogorov_smirnov(&mut values, |x| pareto(x) / pareto(69.9));
    assert!(ks < 1.95, "{ks}");

    let mut values = drawn("delay 50ms 20ms distribution lognormal order free", 103);
    let variance = libm::log(1.16);
    let lognormal = |x: f64| normal((libm::log(x / 50.0) + 0.5 * variance) / variance.sqrt());
    let ks = kolmogorov_smirnov(&mut values, lognormal);
    assert!(ks < 1.95, "{ks}");
    // and the test would notice a normal in its place
    let ks = kolmogorov_smirnov(&mut values, |x| normal((x - 50.0) / 20.0));
    assert!(ks > 10.0, "{ks}");
}

#[test]
fn gamma_is_met_and_is_not_the_lognormal_of_its_moments() {
    // shape 4, scale 10 ms: the closed form of a whole shape
    let mut values = drawn("delay 40ms 20ms distribution gamma order free", 211);
    let erlang = |x: f64| {
        let x = x / 10.0;
        1.0 - libm::exp(-x) * (1.0 + x + x * x / 2.0 + x * x * x / 6.0)
    };
    let ks = kolmogorov_smirnov(&mut values, erlang);
    assert!(ks < 1.95, "{ks}");
    let (mean, sd) = mean_and_sd(&values);
    assert!(
        (mean - 40.0).abs() < 4.0 * 20.0 / (N as f64).sqrt(),
        "{mean}"
    );
    // the kurtosis of a gamma distribution of shape 4 is 4.5
    assert!(
        (sd / 20.0 - 1.0).abs() < 4.0 * (3.5 / 4.0 / N as f64).sqrt(),
        "{sd}"
    );
    let mut lognormal = drawn("delay 40ms 20ms distribution lognormal order free", 211);
    assert!(kolmogorov_smirnov(&mut lognormal, erlang) > 5.0);
}

#[test]
fn a_measured_distribution_is_met() {
    let mut values = drawn("delay cdf 40ms@0%,50ms@80%,100ms@100% order free", 107);
    let cdf = |x: f64| {
        if x < 50.0 {
            0.08 * (x - 40.0)
        } else {
            0.8 + 0.004 * (x - 50.0)
        }
    };
    let ks = kolmogorov_smirnov(&mut values, cdf);
    assert!(ks < 1.95, "{ks}");
}

#[test]
fn correlation_by_packet_is_what_was_set_and_leaves_the_distribution() {
    let values = drawn("delay 50ms 5ms 60% distribution normal order free", 109);
    for (lag, expected) in [(1, 0.6), (2, 0.36), (5, 0.077_76)] {
        let found = correlation(&values, lag);
        assert!((found - expected).abs() < 0.02, "lag {lag}: {found}");
    }
    // every 40th value is as good as independent
    let mut apart: Vec<f64> = values.iter().step_by(40).copied().collect();
    let ks = kolmogorov_smirnov(&mut apart, |x| normal((x - 50.0) / 5.0));
    assert!(ks < 1.95, "{ks}");
}

#[test]
fn correlation_in_time_falls_with_time_and_leaves_the_distribution() {
    let values = drawn(
        "delay 50ms 5ms tau 100ms distribution normal order free",
        113,
    );
    // 1 kHz: the lag is in milliseconds. 1000 independent stretches: four standard errors are 0.13
    for lag in [50, 100, 200, 500] {
        let expected = libm::exp(-(lag as f64) / 100.0);
        let found = correlation(&values, lag);
        assert!(
            (found - expected).abs() < 0.13,
            "lag {lag}: {found} {expected}"
        );
    }
    assert!(correlation(&values, 1) > 0.98);
    let mut apart: Vec<f64> = values.iter().step_by(500).copied().collect();
    let ks = kolmogorov_smirnov(&mut apart, |x| normal((x - 50.0) / 5.0));
    assert!(ks < 1.95, "{ks}");
}

#[test]
fn jitter_that_lives_in_time_keeps_the_order_nearly_for_free() {
    let waiting = |words: &str| {
        let config: crate::LinkConfig = words.parse().unwrap();
        config
            .expected(1000.0, crate::effect::BYTES)
            .unwrap()
            .waiting_ms
    };
    let by_packet = waiting("delay 50ms 5ms distribution normal");
    let in_time = waiting("delay 50ms 5ms tau 100ms distribution normal");
    assert!(in_time < by_packet / 10.0, "{in_time} {by_packet}");
}
