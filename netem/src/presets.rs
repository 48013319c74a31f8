//! Networks by name, each in the words of a link; where their numbers come from is in
//! `docs/netem.md`.

/// A network by name, one direction of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preset {
    /// Its name.
    pub name: &'static str,
    /// Its settings in words.
    pub words: &'static str,
    /// Where the numbers come from, or that they are our choice.
    pub source: &'static str,
}

/// The names, for messages.
pub const NAMES: &str = "lan, wifi, 4g, 5g, 5g-up, 5g-down, starlink, geo, transatlantic or paper";

/// All of them.
pub const PRESETS: [Preset; 10] = [
    Preset {
        name: "lan",
        words: "delay 200us 50us rate 1gbit 66 queue 1000p",
        source: "rate and 66 bytes of Ethernet, IP and UDP framing: IEEE 802.3; delay and queue: our choice",
    },
    Preset {
        name: "wifi",
        words: "delay cdf 1ms@0%,3ms@50%,20ms@90%,250ms@99%,300ms@100% tau 1s loss burst 0.1% 20ms",
        source: "median 3 ms, p90 20 ms, p99 250 ms: Sui et al., MobiSys 2016; ends, time constant and loss: our choice",
    },
    Preset {
        name: "4g",
        words: "delay 30ms 8ms tau 50ms distribution lognormal loss burst 0.1% 30ms rate 20mbit 28 queue 200ms",
        source: "our choice: about twice the one-way delay of the 5g presets",
    },
    Preset {
        name: "5g",
        words: "delay 12ms 3ms tau 50ms distribution lognormal loss burst 0.05% 20ms rate 50mbit 28 queue 100ms",
        source: "between 5g-down and 5g-up",
    },
    Preset {
        name: "5g-up",
        words: "delay 18ms 4ms tau 50ms distribution lognormal loss burst 0.05% 20ms rate 50mbit 28 queue 100ms",
        source: "18 ms one way up at 15 Mbit/s: Kottkamp (Rohde & Schwarz), 2022; jitter, loss, rate and queue: our choice",
    },
    Preset {
        name: "5g-down",
        words: "delay 7ms 2ms tau 50ms distribution lognormal loss burst 0.05% 20ms rate 200mbit 28 queue 100ms",
        source: "7 ms one way down: Kottkamp (Rohde & Schwarz), 2022; jitter, loss, rate and queue: our choice",
    },
    Preset {
        name: "starlink",
        words: "delay cdf 10ms@0%,20ms@25%,25ms@50%,30ms@75%,60ms@100% tau 1s loss burst 0.5% 50ms outage 7500ms for 100ms every 15s",
        source: "half of round trips of 20 (least), 40, 50 and 60 ms (quartiles): Michel et al., IMC 2022; a change every 15 s: Mohan et al., WWW 2024; its 100 ms, the loss and the tail: our choice",
    },
    Preset {
        name: "geo",
        words: "delay 300ms 5ms tau 1s loss burst 0.1% 100ms",
        source: "half of a round trip of 600 ms: Michel et al., IMC 2022; light alone takes 239 ms for 71 572 km; jitter and loss: our choice",
    },
    Preset {
        name: "transatlantic",
        words: "delay 40ms 1ms tau 100ms loss 0.05%",
        source: "light in 7000 km of fibre takes 34 ms; the rest of the way, jitter and loss: our choice",
    },
    Preset {
        name: "paper",
        words: "none",
        source: "Xu et al.: the communication delay over the network is set to be negligible",
    },
];

/// The preset of this name.
#[must_use]
pub fn named(name: &str) -> Option<&'static Preset> {
    PRESETS.iter().find(|preset| preset.name == name)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use mmt_shared::stats::values::{self, rms, standard_deviation};
    use mmt_shared::time::Time;

    use super::*;
    use crate::{Link, LinkConfig, LinkId, Order, Packet};

    #[test]
    fn every_preset_parses_prints_as_written_and_is_named_in_the_message() {
        for preset in &PRESETS {
            let config: LinkConfig = preset.words.parse().unwrap();
            assert_eq!(config.check(), Ok(()), "{}", preset.name);
            assert!(NAMES.contains(preset.name));
            let by_name: LinkConfig = format!("preset {}", preset.name).parse().unwrap();
            assert_eq!(by_name, config);
            assert_eq!(config.to_string().parse(), Ok(config), "{}", preset.name);
        }
    }

    #[test]
    fn what_follows_a_preset_replaces_its_words() {
        let config: LinkConfig = "preset geo loss 2%".parse().unwrap();
        assert_eq!(config.to_string(), "delay 300ms 5ms tau 1s loss 2%");
        assert!("loss 2% preset geo".parse::<LinkConfig>().is_err());
        assert!("preset mars".parse::<LinkConfig>().is_err());
    }

    /// Delays of a preset's distribution and process, ms, without order and bottleneck, and its loss.
    fn met(name: &str, interval: Duration, packets: u32) -> (Vec<f64>, f64) {
        let config: LinkConfig = named(name).unwrap().words.parse().unwrap();
        let config = LinkConfig {
            order: Order::Free,
            rate: None,
            ..config
        };
        let mut link = Link::try_new(config, 11, LinkId::UP).unwrap();
        let mut delays = Vec::new();
        for packet in 0..packets {
            let now = Time::ZERO + interval * packet;
            link.offer(now, Packet::new(100, ()));
            let out = link.poll_delivered(Time::MAX);
            delays.extend(out.map(|out| out.due.saturating_since(now).as_secs_f64() * 1e3));
        }
        let lost = 1.0 - delays.len() as f64 / f64::from(packets);
        (delays, lost)
    }

    #[test]
    fn every_preset_has_the_mean_the_spread_and_the_loss_that_follow_from_its_words_by_hand() {
        // pieces of a distribution: share, from, to
        let pieces = |pieces: &[(f64, f64, f64)]| {
            let mean: f64 = pieces.iter().map(|(p, a, b)| p * (a + b) / 2.0).sum();
            let square = |(p, a, b): &(f64, f64, f64)| p * (a * a + a * b + b * b) / 3.0;
            let squares: f64 = pieces.iter().map(square).sum();
            (mean, (squares - mean * mean).sqrt())
        };
        let wifi = [
            (0.5, 1.0, 3.0),
            (0.4, 3.0, 20.0),
            (0.09, 20.0, 250.0),
            (0.01, 250.0, 300.0),
        ];
        let starlink = [
            (0.25, 10.0, 20.0),
            (0.25, 20.0, 25.0),
            (0.25, 25.0, 30.0),
            (0.25, 30.0, 60.0),
        ];
        let root = 3.0_f64.sqrt();
        for (name, (mean, sd), lost) in [
            ("lan", (0.2, 0.05 / root), 0.0),
            ("wifi", pieces(&wifi), 0.001),
            ("4g", (30.0, 8.0), 0.001),
            ("5g", (12.0, 3.0), 0.0005),
            ("5g-up", (18.0, 4.0), 0.0005),
            ("5g-down", (7.0, 2.0), 0.0005),
            (
                "starlink",
                pieces(&starlink),
                1.0 - 0.995 * (1.0 - 0.1 / 15.0),
            ),
            ("geo", (300.0, 5.0 / root), 0.001),
            ("transatlantic", (40.0, 1.0 / root), 0.0005),
            ("paper", (0.0, 0.0), 0.0),
        ] {
            // 10.007 s apart, ten times the longest tau, packets are independent and meet no multiple of 15 s
            let n = 40_000;
            let (delays, found_lost) = met(name, Duration::from_millis(10_007), n);
            let found_mean = values::mean(delays.iter().copied()).unwrap();
            let found_sd = standard_deviation(&delays).unwrap();
            let spread = f64::from(n).sqrt();
            assert!(
                (found_mean - mean).abs() <= 4.0 * sd / spread,
                "{name}: mean {found_mean}, not {mean}"
            );
            // the heaviest tail here has a kurtosis of 16
            assert!(
                (found_sd - sd).abs() <= 8.0 * sd / spread,
                "{name}: s.d. {found_sd}, not {sd}"
            );
            let share = 4.0 * f64::sqrt(lost * (1.0 - lost)) / spread;
            assert!(
                (found_lost - lost).abs() <= share,
                "{name}: loss {found_lost}, not {lost}"
            );
        }
    }

    #[test]
    fn the_step_from_packet_to_packet_is_that_of_the_process() {
        // log-normal over a Gaussian of correlation rho: covariance exp(s^2 rho) - 1
        for (name, mean, sd) in [("4g", 30.0, 8.0), ("5g", 12.0, 3.0), ("5g-down", 7.0, 2.0)] {
            let s2 = libm::log1p((sd / mean) * (sd / mean));
            let rho = libm::exp(-1.0 / 50.0);
            let correlation = libm::expm1(s2 * rho) / libm::expm1(s2);
            let expected = sd * (2.0 * (1.0 - correlation)).sqrt();
            let (delays, _) = met(name, Duration::from_millis(1), 200_000);
            let step = rms(delays.windows(2).map(|pair| pair[1] - pair[0])).unwrap();
            assert!(
                (step / expected - 1.0).abs() < 0.05,
                "{name}: {step}, not {expected}"
            );
        }
    }
}
