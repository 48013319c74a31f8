//! What follows from the settings of a link by formula, without the emulator: each packet's delay by itself, as under
//! `order free`, the step of the delay from packet to packet, and loss.

use std::time::Duration;

use mmt_netem::config::{Correlation, Delay, LinkConfig, Outage, Service, Shape};

/// What is known of a link by formula; absent where no formula is known.
pub(super) struct ClosedForm {
    /// Mean delay, ms.
    pub(super) mean_ms: Option<f64>,
    /// Standard deviation of the delay, ms.
    pub(super) sd_ms: Option<f64>,
    /// The delay that 99 % of the packets do not exceed, ms.
    pub(super) p99_ms: Option<f64>,
    /// Root mean square of the step of the delay between neighbouring packets, ms.
    pub(super) step_rms_ms: Option<f64>,
    /// Share of packets lost in the long run, 0 to 1.
    pub(super) loss: Option<f64>,
    /// Mean length of a run of lost packets, packets.
    pub(super) burst_packets: Option<f64>,
}

impl ClosedForm {
    /// Of packets of so many bytes, sent so many times a second.
    pub(super) fn of(config: &LinkConfig, rate_hz: f64, bytes: usize) -> Self {
        let curve = Curve::of(&config.delay);
        let sending_ms = sending_ms(config, bytes);
        let moments = curve.as_ref().map(Curve::moments);
        let correlation = gaussian_correlation(config.correlation, rate_hz);
        let step = |curve: &Curve| {
            let (_, sd) = curve.moments();
            let left = 1.0 - curve.correlation(correlation)?;
            Some(sd * (2.0 * left).sqrt())
        };
        let bursts = config.loss.mean_burst(rate_hz);
        Self {
            mean_ms: moments.map(|(mean, _)| mean + sending_ms),
            sd_ms: moments.map(|(_, sd)| sd),
            p99_ms: curve
                .as_ref()
                .map(|curve| curve.quantile(0.99) + sending_ms),
            step_rms_ms: curve.as_ref().and_then(step),
            loss: config.loss.share().map(|share| with_outages(config, share)),
            burst_packets: bursts.filter(|_| config.outages.is_empty()),
        }
    }
}

/// How long the bottleneck sends a packet, ms; nothing waits before it in an even stream below its rate.
fn sending_ms(config: &LinkConfig, bytes: usize) -> f64 {
    let Some(rate) = &config.rate else { return 0.0 };
    match rate.service {
        Service::Constant { bits_per_second } => {
            8e3 * (bytes as f64 + f64::from(rate.framing.overhead)) / bits_per_second as f64
        }
        Service::Opportunities(_) => 0.0,
    }
}

/// The share lost with the time of all outages that come again and again.
fn with_outages(config: &LinkConfig, share: f64) -> f64 {
    let on = |outage: &Outage| {
        let every = outage
            .every
            .map_or(f64::INFINITY, |every| every.as_secs_f64());
        outage.length.as_secs_f64() / every
    };
    let up: f64 = config
        .outages
        .iter()
        .map(|outage| 1.0 - on(outage))
        .product();
    1.0 - (1.0 - share) * up
}

/// The correlation of the Gaussian numbers behind neighbouring packets.
fn gaussian_correlation(of: Correlation, rate_hz: f64) -> f64 {
    match of {
        Correlation::None => 0.0,
        Correlation::PerPacket(correlation) => correlation.get(),
        Correlation::InTime(tau) => libm::exp(-1.0 / (rate_hz * tau.as_secs_f64())),
    }
}

/// A distribution of delay, ms.
pub(super) enum Curve {
    /// Straight pieces of the cumulative distribution: share, from, to. A constant is a piece without length.
    Straight(Vec<(f64, f64, f64)>),
    /// Log-normal: mean and standard deviation.
    LogNormal(f64, f64),
}

fn ms(of: Duration) -> f64 {
    of.as_secs_f64() * 1e3
}

impl Curve {
    /// The curve of a delay that nothing cuts at zero; none of a shape that no preset has.
    pub(super) fn of(delay: &Delay) -> Option<Self> {
        let (mean, jitter) = (ms(delay.mean), ms(delay.jitter));
        match &delay.shape {
            Shape::Constant => Some(Self::Straight(vec![(1.0, mean, mean)])),
            Shape::Uniform if jitter <= mean => {
                Some(Self::Straight(vec![(1.0, mean - jitter, mean + jitter)]))
            }
            Shape::LogNormal => Some(Self::LogNormal(mean, jitter)),
            Shape::Empirical(cdf) => {
                let pairs = cdf.points().zip(cdf.points().skip(1));
                let piece = |((from, low), (to, high)): ((u64, f64), (u64, f64))| {
                    (high - low, from as f64 / 1e6, to as f64 / 1e6)
                };
                Some(Self::Straight(pairs.map(piece).collect()))
            }
            _ => None,
        }
    }

    /// Mean and standard deviation.
    fn moments(&self) -> (f64, f64) {
        match self {
            Self::Straight(pieces) => {
                let mean: f64 = pieces.iter().map(|(p, a, b)| p * (a + b) / 2.0).sum();
                let square = |(p, a, b): &(f64, f64, f64)| {
                    p * ((b - a).powi(2) / 12.0 + ((a + b) / 2.0 - mean).powi(2))
                };
                (mean, pieces.iter().map(square).sum::<f64>().sqrt())
            }
            Self::LogNormal(mean, sd) => (*mean, *sd),
        }
    }

    /// What a share `p` does not exceed, `p` within 0 and 1.
    pub(super) fn quantile(&self, p: f64) -> f64 {
        match self {
            Self::Straight(pieces) => {
                let mut left = p;
                for (share, from, to) in pieces {
                    if left <= *share {
                        return from + (to - from) * left / share;
                    }
                    left -= share;
                }
                pieces.last().map_or(0.0, |(_, _, to)| *to)
            }
            Self::LogNormal(mean, sd) => {
                let variance = log_variance(*mean, *sd);
                mean * libm::exp(variance.sqrt() * normal_quantile(p) - 0.5 * variance)
            }
        }
    }

    /// The correlation of two delays behind which Gaussian numbers have the correlation `rho`.
    fn correlation(&self, rho: f64) -> Option<f64> {
        match self {
            _ if rho == 0.0 => Some(0.0),
            // Spearman's and Pearson's correlation of a Gaussian copula
            Self::Straight(pieces) if pieces.len() == 1 => {
                Some(6.0 / std::f64::consts::PI * libm::asin(rho / 2.0))
            }
            Self::Straight(_) => None,
            Self::LogNormal(mean, sd) => {
                let variance = log_variance(*mean, *sd);
                Some(libm::expm1(variance * rho) / libm::expm1(variance))
            }
        }
    }
}

/// Variance of the logarithm.
fn log_variance(mean: f64, sd: f64) -> f64 {
    libm::log1p((sd / mean).powi(2))
}

/// The standard normal's quantile, by halving on the error function: slow, and no other's formula.
fn normal_quantile(p: f64) -> f64 {
    let (mut low, mut high) = (-40.0, 40.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        let below = 0.5 * libm::erfc(-middle / std::f64::consts::SQRT_2);
        if below < p {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(words: &str) -> ClosedForm {
        ClosedForm::of(&words.parse().unwrap(), 1000.0, 90)
    }

    fn near(found: Option<f64>, expected: f64) {
        let found = found.unwrap();
        assert!(
            (found - expected).abs() < 1e-3 * expected,
            "{found}, not {expected}"
        );
    }

    #[test]
    fn delays_and_steps_are_those_of_the_textbook() {
        let uniform = of("delay 50ms 6ms rate 1mbit 35 order free");
        near(uniform.mean_ms, 51.0);
        near(uniform.sd_ms, 3.4641);
        near(uniform.p99_ms, 51.0 + 5.88);
        near(uniform.step_rms_ms, 4.8990);
        let lognormal = of("delay 30ms 8ms tau 50ms distribution lognormal");
        near(lognormal.p99_ms, 53.36);
        near(lognormal.step_rms_ms, 1.6204);
        let measured = of("delay cdf 0ms@0%,10ms@50%,30ms@100% tau 1s");
        near(measured.mean_ms, 12.5);
        near(measured.sd_ms, 8.7797);
        assert_eq!(measured.step_rms_ms, None);
        assert_eq!(
            of("delay 50ms 5ms distribution gamma").mean_ms,
            None,
            "no formula here"
        );
    }

    #[test]
    fn losses_and_outages_add_up_and_runs_have_a_length_where_a_formula_is_known() {
        near(of("loss 5%").loss, 0.05);
        near(of("loss 5%").burst_packets, 1.0 / 0.95);
        let outage = of("loss burst 10% 20ms outage 1s for 1s every 10s");
        near(outage.loss, 1.0 - 0.9 * 0.9);
        assert_eq!(outage.burst_packets, None);
        assert_eq!(of("loss every 10").burst_packets, None);
    }
}
