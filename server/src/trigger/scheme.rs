//! The update schemes of III-B and beyond, and how a person writes them.
//!
//! A scheme is written as its name and its numbers: `deadband 10%`, `hybrid 10% 150ms`, `timer 150ms`,
//! `every-sample`, `dis 0.3N 1s`, `useful 10% 150ms`. Configuration files and reports hold the same
//! text. What is written must never be accepted with a word left over.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use serde::{Deserialize, Serialize};

/// When an update is sent, geometry aside.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Scheme {
    /// On violation of the deadband: (12).
    Deadband {
        /// Delta, the relative mismatch that is tolerated.
        delta: f64,
    },
    /// On violation, or when `t_update` has passed since the last update: the paper's proposal.
    Hybrid {
        /// Delta.
        delta: f64,
        /// T_update.
        t_update: Duration,
    },
    /// When `t_update` has passed since the last update.
    Timer {
        /// T_update.
        t_update: Duration,
    },
    /// At every sample.
    EverySample,
    /// On an absolute force error, and as a heartbeat: distributed interactive simulation, IEEE 1278.
    Dis {
        /// The force error that is tolerated, N.
        threshold_n: f64,
        /// Longest time without an update.
        heartbeat: Duration,
    },
    /// As hybrid with the timer in contact only, and only if the update would change the force or the
    /// orientation: recommended.
    Useful {
        /// Delta.
        delta: f64,
        /// T_update.
        t_update: Duration,
    },
}

/// Why a text is no scheme.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SchemeError {
    /// The first word is no scheme's name.
    #[error(
        "unknown update scheme \"{name}\"; write one of: deadband 10%, hybrid 10% 150ms, timer 150ms, every-sample, dis 0.3N 1s, useful 10% 150ms"
    )]
    UnknownName {
        /// The word.
        name: String,
    },
    /// A number of the scheme is missing.
    #[error("the scheme {scheme} needs {what}; write for example \"{example}\"")]
    Missing {
        /// The scheme.
        scheme: &'static str,
        /// What is missing.
        what: &'static str,
        /// A complete scheme.
        example: &'static str,
    },
    /// A word is not the number that belongs there.
    #[error("\"{word}\" is not {what}; write for example \"{example}\"")]
    BadNumber {
        /// The word.
        word: String,
        /// What belongs there.
        what: &'static str,
        /// A complete scheme.
        example: &'static str,
    },
    /// Words are left over.
    #[error("\"{word}\" is one word too many; write for example \"{example}\"")]
    TooMany {
        /// The first word left over.
        word: String,
        /// A complete scheme.
        example: &'static str,
    },
}

const DELTA: &str = "a deadband above 0, such as 10%";
const TIME: &str = "a time above 0, such as 150ms or 1s";
const FORCE: &str = "a force above 0, such as 0.3N";

impl Scheme {
    /// The scheme's name, without its numbers.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Deadband { .. } => "deadband",
            Self::Hybrid { .. } => "hybrid",
            Self::Timer { .. } => "timer",
            Self::EverySample => "every-sample",
            Self::Dis { .. } => "dis",
            Self::Useful { .. } => "useful",
        }
    }
}

/// The words of a scheme after its name.
struct Words<'a> {
    words: std::str::SplitWhitespace<'a>,
    scheme: &'static str,
    example: &'static str,
}

impl<'a> Words<'a> {
    fn next<T>(
        &mut self,
        what: &'static str,
        read: impl Fn(&str) -> Option<T>,
    ) -> Result<T, SchemeError> {
        let (scheme, example) = (self.scheme, self.example);
        let word = self.words.next().ok_or(SchemeError::Missing {
            scheme,
            what,
            example,
        })?;
        read(word).ok_or_else(|| SchemeError::BadNumber {
            word: word.to_owned(),
            what,
            example,
        })
    }

    fn delta(&mut self) -> Result<f64, SchemeError> {
        self.next(DELTA, |word| match word.strip_suffix('%') {
            Some(percent) => positive(percent).map(|percent| percent / 100.0),
            None => positive(word),
        })
    }

    fn time(&mut self) -> Result<Duration, SchemeError> {
        self.next(TIME, read_duration)
    }

    fn force(&mut self) -> Result<f64, SchemeError> {
        self.next(FORCE, |word| positive(word.strip_suffix('N')?))
    }

    fn end(mut self, scheme: Scheme) -> Result<Scheme, SchemeError> {
        match self.words.next() {
            None => Ok(scheme),
            Some(word) => Err(SchemeError::TooMany {
                word: word.to_owned(),
                example: self.example,
            }),
        }
    }
}

/// A number above 0; infinity is one, and means never.
fn positive(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number| *number > 0.0)
}

fn read_duration(word: &str) -> Option<Duration> {
    if word == "inf" {
        return Some(Duration::MAX);
    }
    // the longer unit first: "ms" ends in "s"
    let units = [("ns", 1e-9), ("us", 1e-6), ("ms", 1e-3), ("s", 1.0)];
    let (number, unit) = units
        .into_iter()
        .find_map(|(name, unit)| Some((word.strip_suffix(name)?, unit)))?;
    let seconds = positive(number)? * unit;
    Duration::try_from_secs_f64(seconds)
        .ok()
        .filter(|duration| !duration.is_zero())
}

impl FromStr for Scheme {
    type Err = SchemeError;

    fn from_str(text: &str) -> Result<Self, SchemeError> {
        let mut words = text.split_whitespace();
        let name = words.next().unwrap_or_default();
        let after = |scheme, example| Words {
            words: words.clone(),
            scheme,
            example,
        };
        match name {
            "deadband" => {
                let mut words = after("deadband", "deadband 10%");
                let delta = words.delta()?;
                words.end(Self::Deadband { delta })
            }
            "hybrid" => {
                let mut words = after("hybrid", "hybrid 10% 150ms");
                let (delta, t_update) = (words.delta()?, words.time()?);
                words.end(Self::Hybrid { delta, t_update })
            }
            "timer" => {
                let mut words = after("timer", "timer 150ms");
                let t_update = words.time()?;
                words.end(Self::Timer { t_update })
            }
            "every-sample" => after("every-sample", "every-sample").end(Self::EverySample),
            "dis" => {
                let mut words = after("dis", "dis 0.3N 1s");
                let (threshold_n, heartbeat) = (words.force()?, words.time()?);
                words.end(Self::Dis {
                    threshold_n,
                    heartbeat,
                })
            }
            "useful" => {
                let mut words = after("useful", "useful 10% 150ms");
                let (delta, t_update) = (words.delta()?, words.time()?);
                words.end(Self::Useful { delta, t_update })
            }
            _ => Err(SchemeError::UnknownName {
                name: name.to_owned(),
            }),
        }
    }
}

impl TryFrom<String> for Scheme {
    type Error = SchemeError;

    fn try_from(text: String) -> Result<Self, SchemeError> {
        text.parse()
    }
}

impl From<Scheme> for String {
    fn from(scheme: Scheme) -> Self {
        scheme.to_string()
    }
}

/// A deadband as a person writes it, such that reading it gives the same bits.
struct Percent(f64);

impl fmt::Display for Percent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = libm::round(self.0 * 100.0 * 1e9) / 1e9;
        if percent / 100.0 == self.0 {
            write!(f, "{percent}%")
        } else {
            write!(f, "{}", self.0)
        }
    }
}

/// A time as a person writes it: in the largest unit of which it is a whole number.
struct Whole(Duration);

impl fmt::Display for Whole {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0 == Duration::MAX {
            return f.write_str("inf");
        }
        let nanos = self.0.as_nanos();
        let units = [("s", 1_000_000_000), ("ms", 1_000_000), ("us", 1_000)];
        match units
            .into_iter()
            .find(|(_, unit)| nanos.is_multiple_of(*unit))
        {
            Some((name, unit)) => write!(f, "{}{name}", nanos / unit),
            None => write!(f, "{nanos}ns"),
        }
    }
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.name();
        match *self {
            Self::Deadband { delta } => write!(f, "{name} {}", Percent(delta)),
            Self::Hybrid { delta, t_update } | Self::Useful { delta, t_update } => {
                write!(f, "{name} {} {}", Percent(delta), Whole(t_update))
            }
            Self::Timer { t_update } => write!(f, "{name} {}", Whole(t_update)),
            Self::EverySample => f.write_str(name),
            Self::Dis {
                threshold_n,
                heartbeat,
            } => write!(f, "{name} {threshold_n}N {}", Whole(heartbeat)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn every_scheme_reads_as_it_is_written() {
        let ms = Duration::from_millis;
        for (text, scheme) in [
            ("deadband 10%", Scheme::Deadband { delta: 0.10 }),
            (
                "hybrid 2.5% 150ms",
                Scheme::Hybrid {
                    delta: 0.025,
                    t_update: ms(150),
                },
            ),
            ("timer 50ms", Scheme::Timer { t_update: ms(50) }),
            ("every-sample", Scheme::EverySample),
            (
                "dis 0.3N 1s",
                Scheme::Dis {
                    threshold_n: 0.3,
                    heartbeat: ms(1000),
                },
            ),
            (
                "useful 7% 2500us",
                Scheme::Useful {
                    delta: 0.07,
                    t_update: Duration::from_micros(2500),
                },
            ),
        ] {
            assert_eq!(text.parse(), Ok(scheme));
            assert_eq!(scheme.to_string(), text);
        }
        let never = Scheme::Hybrid {
            delta: f64::INFINITY,
            t_update: Duration::MAX,
        };
        assert_eq!(never.to_string().parse(), Ok(never));
    }

    #[test]
    fn what_is_no_scheme_says_what_and_what_to_write() {
        for (text, part) in [
            ("", "unknown update scheme \"\""),
            ("Hybrid 10% 150ms", "write one of: deadband 10%"),
            ("hybrid 10%", "needs a time above 0"),
            ("hybrid ten 150ms", "\"ten\" is not a deadband"),
            ("hybrid -1% 150ms", "\"-1%\" is not a deadband"),
            ("hybrid nan 150ms", "\"nan\" is not a deadband"),
            ("timer 150", "\"150\" is not a time"),
            ("timer 0ms", "\"0ms\" is not a time"),
            ("timer 1e300s", "\"1e300s\" is not a time"),
            ("dis 0.3 1s", "\"0.3\" is not a force"),
            ("every-sample 3", "\"3\" is one word too many"),
        ] {
            let error = text.parse::<Scheme>().unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    proptest! {
        #[test]
        fn writing_and_reading_gives_the_same_bits(
            delta in 1e-6..10.0_f64, threshold_n in 1e-6..100.0_f64, nanos in 1_000..10_000_000_000_u64,
        ) {
            let t_update = Duration::from_nanos(nanos);
            for scheme in [
                Scheme::Deadband { delta },
                Scheme::Useful { delta, t_update },
                Scheme::Dis { threshold_n, heartbeat: t_update },
            ] {
                prop_assert_eq!(scheme.to_string().parse::<Scheme>(), Ok(scheme));
            }
        }

        #[test]
        fn no_text_panics(text in ".{0,40}") {
            let _ = text.parse::<Scheme>();
        }
    }
}
