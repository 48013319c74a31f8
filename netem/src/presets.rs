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
    use super::*;
    use crate::LinkConfig;

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
    fn what_is_said_after_a_preset_goes_before_it() {
        let config: LinkConfig = "preset geo loss 2%".parse().unwrap();
        assert_eq!(config.to_string(), "delay 300ms 5ms tau 1s loss 2%");
        assert!("loss 2% preset geo".parse::<LinkConfig>().is_err());
        assert!("preset mars".parse::<LinkConfig>().is_err());
    }
}
