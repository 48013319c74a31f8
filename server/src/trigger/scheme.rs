//! The update schemes and the words they are written with.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use serde::{Deserialize, Serialize};

/// When updates are sent. In files it is written in the same words as on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Scheme {
    /// (12) alone.
    Deadband {
        /// Delta, relative force error.
        delta: f64,
    },
    /// Section III-B: (12), or T_update since the last update.
    Hybrid {
        /// Delta, relative force error.
        delta: f64,
        /// T_update.
        t_update: Duration,
    },
    /// T_update since the last update alone.
    Timer {
        /// T_update.
        t_update: Duration,
    },
    /// Every sample period.
    EverySample,
    /// Distributed simulation's dead reckoning: an absolute threshold and a heartbeat.
    Dis {
        /// Greatest force error, N.
        threshold_n: f64,
        /// Longest time without an update.
        heartbeat: Duration,
    },
    /// (12) or T_update, in contact, if the update would change what is felt.
    Useful {
        /// Delta, relative force error.
        delta: f64,
        /// T_update.
        t_update: Duration,
    },
    /// (12), or when what the last update leaves unsaid has added up, in contact, to Delta for as long as
    /// `horizon`: T_update is short while the model changes and endless while it does not.
    Adaptive {
        /// Delta, relative force error.
        delta: f64,
        /// How long an error of Delta may go unsaid.
        horizon: Duration,
    },
}

/// Accepted Delta: beyond 100 % nothing is left of the force.
const DELTA: (f64, f64) = (0.001, 1.0);
/// Accepted T_update and heartbeat, ms.
const PERIOD_MS: (f64, f64) = (1.0, 60_000.0);
/// Accepted absolute threshold, N.
const THRESHOLD_N: (f64, f64) = (0.001, 100.0);

/// Why a text names no scheme.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SchemeError {
    /// The first word is not a scheme.
    #[error(
        "unknown update scheme '{word}'; use one of 'deadband 10%', 'hybrid 10% 150ms', \
         'timer 150ms', 'every-sample', 'dis 0.3N 1s', 'useful 10% 150ms', 'adaptive 10% 50ms'"
    )]
    Unknown {
        /// The word.
        word: String,
    },
    /// The scheme takes other words.
    #[error("the scheme '{scheme}' is written '{usage}', not '{text}'")]
    Words {
        /// The scheme.
        scheme: &'static str,
        /// How it is written.
        usage: &'static str,
        /// What was written.
        text: String,
    },
    /// A number is not a number with its unit, or out of range.
    #[error("'{word}' is not a {what} from {min} to {max} {unit}")]
    Number {
        /// The word.
        word: String,
        /// What it should be.
        what: &'static str,
        /// Least accepted.
        min: f64,
        /// Greatest accepted.
        max: f64,
        /// Unit of both.
        unit: &'static str,
    },
}

impl Scheme {
    /// The name used in files and on screens.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Deadband { .. } => "deadband",
            Self::Hybrid { .. } => "hybrid",
            Self::Timer { .. } => "timer",
            Self::EverySample => "every-sample",
            Self::Dis { .. } => "dis",
            Self::Useful { .. } => "useful",
            Self::Adaptive { .. } => "adaptive",
        }
    }

    /// The same with thresholds and times `by` as large, as congestion asks for; Delta stays at most 1. A factor of
    /// 1 or less changes nothing, and nothing changes `every-sample`, which knows neither.
    #[must_use]
    pub fn stretched(self, by: f64) -> Self {
        if by <= 1.0 || !by.is_finite() {
            return self;
        }
        let wider = |delta: f64| (delta * by).min(DELTA.1);
        let longer = |time: Duration| time.mul_f64(by);
        match self {
            Self::Deadband { delta } => Self::Deadband {
                delta: wider(delta),
            },
            Self::Hybrid { delta, t_update } => Self::Hybrid {
                delta: wider(delta),
                t_update: longer(t_update),
            },
            Self::Timer { t_update } => Self::Timer {
                t_update: longer(t_update),
            },
            Self::EverySample => Self::EverySample,
            Self::Dis {
                threshold_n,
                heartbeat,
            } => Self::Dis {
                threshold_n: threshold_n * by,
                heartbeat: longer(heartbeat),
            },
            Self::Useful { delta, t_update } => Self::Useful {
                delta: wider(delta),
                t_update: longer(t_update),
            },
            Self::Adaptive { delta, horizon } => Self::Adaptive {
                delta: wider(delta),
                horizon: longer(horizon),
            },
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

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ms = |t: &Duration| t.as_secs_f64() * 1e3;
        match self {
            Self::Deadband { delta } => write!(f, "deadband {}%", percent(*delta)),
            Self::Hybrid { delta, t_update } => {
                write!(f, "hybrid {}% {}ms", percent(*delta), ms(t_update))
            }
            Self::Timer { t_update } => write!(f, "timer {}ms", ms(t_update)),
            Self::EverySample => f.write_str("every-sample"),
            Self::Dis {
                threshold_n,
                heartbeat,
            } => {
                write!(f, "dis {threshold_n}N {}ms", ms(heartbeat))
            }
            Self::Useful { delta, t_update } => {
                write!(f, "useful {}% {}ms", percent(*delta), ms(t_update))
            }
            Self::Adaptive { delta, horizon } => {
                write!(f, "adaptive {}% {}ms", percent(*delta), ms(horizon))
            }
        }
    }
}

/// Per cent without the dust of binary fractions: six digits are more than anybody writes.
fn percent(share: f64) -> f64 {
    libm::round(share * 1e8) / 1e6
}

impl FromStr for Scheme {
    type Err = SchemeError;

    fn from_str(text: &str) -> Result<Self, SchemeError> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let wrong = |scheme, usage| SchemeError::Words {
            scheme,
            usage,
            text: text.to_owned(),
        };
        match words.as_slice() {
            ["deadband", delta] => Ok(Self::Deadband {
                delta: share(delta)?,
            }),
            ["hybrid", delta, t] => Ok(Self::Hybrid {
                delta: share(delta)?,
                t_update: period(t)?,
            }),
            ["timer", t] => Ok(Self::Timer {
                t_update: period(t)?,
            }),
            ["every-sample"] => Ok(Self::EverySample),
            ["dis", threshold, t] => Ok(Self::Dis {
                threshold_n: newtons(threshold)?,
                heartbeat: period(t)?,
            }),
            ["useful", delta, t] => Ok(Self::Useful {
                delta: share(delta)?,
                t_update: period(t)?,
            }),
            ["adaptive", delta, t] => Ok(Self::Adaptive {
                delta: share(delta)?,
                horizon: period(t)?,
            }),
            ["deadband", ..] => Err(wrong("deadband", "deadband 10%")),
            ["hybrid", ..] => Err(wrong("hybrid", "hybrid 10% 150ms")),
            ["timer", ..] => Err(wrong("timer", "timer 150ms")),
            ["every-sample", ..] => Err(wrong("every-sample", "every-sample")),
            ["dis", ..] => Err(wrong("dis", "dis 0.3N 1s")),
            ["useful", ..] => Err(wrong("useful", "useful 10% 150ms")),
            ["adaptive", ..] => Err(wrong("adaptive", "adaptive 10% 50ms")),
            _ => Err(SchemeError::Unknown {
                word: words.first().copied().unwrap_or_default().to_owned(),
            }),
        }
    }
}

fn number(
    word: &str,
    digits: Option<&str>,
    factor: f64,
    what: &'static str,
    (min, max): (f64, f64),
    unit: &'static str,
) -> Result<f64, SchemeError> {
    let value = digits
        .and_then(|digits| digits.parse::<f64>().ok())
        .map(|value| value * factor);
    value
        .filter(|value| (min..=max).contains(value))
        .ok_or_else(|| SchemeError::Number {
            word: word.to_owned(),
            what,
            min,
            max,
            unit,
        })
}

fn share(word: &str) -> Result<f64, SchemeError> {
    let (min, max) = (DELTA.0 * 100.0, DELTA.1 * 100.0);
    number(
        word,
        word.strip_suffix('%'),
        1.0,
        "deadband",
        (min, max),
        "%",
    )
    .map(|p| p / 100.0)
}

fn period(word: &str) -> Result<Duration, SchemeError> {
    let (digits, factor) = match (word.strip_suffix("ms"), word.strip_suffix('s')) {
        (Some(digits), _) => (Some(digits), 1.0),
        (None, Some(digits)) => (Some(digits), 1e3),
        (None, None) => (None, 1.0),
    };
    let ms = number(word, digits, factor, "time", PERIOD_MS, "ms")?;
    Ok(Duration::from_nanos(libm::round(ms * 1e6) as u64))
}

fn newtons(word: &str) -> Result<f64, SchemeError> {
    number(word, word.strip_suffix('N'), 1.0, "force", THRESHOLD_N, "N")
}

#[cfg(test)]
mod tests {
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
        assert_eq!(
            error("deadband 10"),
            "'10' is not a deadband from 0.1 to 100 %"
        );
        assert_eq!(
            error("timer nans"),
            "'nans' is not a time from 1 to 60000 ms"
        );
        assert_eq!(error("timer 0ms"), "'0ms' is not a time from 1 to 60000 ms");
    }
}
