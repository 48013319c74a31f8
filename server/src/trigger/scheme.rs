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
    /// (12), or when the error that the last update left has added up, in contact, to Delta for as long as
    /// `horizon`: T_update is short while the model changes and endless while it does not.
    Adaptive {
        /// Delta, relative force error.
        delta: f64,
        /// How long an error of Delta may last without an update.
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
    #[error("unknown update scheme '{word}'; use one of {}", known())]
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
        usage: String,
        /// What was written.
        text: String,
    },
    /// A number has no unit.
    #[error("the {what} '{word}' has no unit ({units}), as in '{usage}'")]
    Unit {
        /// The word.
        word: String,
        /// What it should be.
        what: &'static str,
        /// The units that it can have.
        units: &'static str,
        /// How the scheme is written.
        usage: String,
    },
    /// A number is not a number with its unit, or out of range.
    #[error("'{word}' is not a {what} from {min} to {max} {unit}, as in '{usage}'")]
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
        /// How the scheme is written.
        usage: String,
    },
}

/// What a scheme's threshold is measured in.
enum Threshold<'a> {
    /// Delta, relative force error.
    Share(&'a mut f64),
    /// Force error, N.
    Newtons(&'a mut f64),
}

impl Threshold<'_> {
    fn read(self, word: &str, usage: &str) -> Result<(), SchemeError> {
        match self {
            Self::Share(delta) => {
                let range = (DELTA.0 * 100.0, DELTA.1 * 100.0);
                let value = digits(word, "%");
                *delta = number((word, usage), value, "deadband", range, ("%", "%"))? / 100.0;
            }
            Self::Newtons(force) => {
                let value = digits(word, "N");
                *force = number((word, usage), value, "force", THRESHOLD_N, ("N", "N"))?;
            }
        }
        Ok(())
    }
}

impl Scheme {
    /// One of each, with the numbers that messages use as examples.
    const EXAMPLES: [Self; 7] = [
        Self::Deadband { delta: 0.1 },
        Self::Hybrid {
            delta: 0.1,
            t_update: Duration::from_millis(150),
        },
        Self::Timer {
            t_update: Duration::from_millis(150),
        },
        Self::EverySample,
        Self::Dis {
            threshold_n: 0.3,
            heartbeat: Duration::from_secs(1),
        },
        Self::Useful {
            delta: 0.1,
            t_update: Duration::from_millis(150),
        },
        Self::Adaptive {
            delta: 0.1,
            horizon: Duration::from_millis(50),
        },
    ];

    /// Name, threshold and time, in the order in which they are written.
    fn terms(&mut self) -> (&'static str, Option<Threshold<'_>>, Option<&mut Duration>) {
        use Threshold::{Newtons, Share};
        match self {
            Self::Deadband { delta } => ("deadband", Some(Share(delta)), None),
            Self::Hybrid { delta, t_update } => ("hybrid", Some(Share(delta)), Some(t_update)),
            Self::Timer { t_update } => ("timer", None, Some(t_update)),
            Self::EverySample => ("every-sample", None, None),
            Self::Dis {
                threshold_n,
                heartbeat,
            } => ("dis", Some(Newtons(threshold_n)), Some(heartbeat)),
            Self::Useful { delta, t_update } => ("useful", Some(Share(delta)), Some(t_update)),
            Self::Adaptive { delta, horizon } => ("adaptive", Some(Share(delta)), Some(horizon)),
        }
    }

    /// The name used in files and on screens.
    #[must_use]
    pub fn name(&self) -> &'static str {
        let mut copy = *self;
        copy.terms().0
    }

    /// The same with thresholds and times `by` as large, as congestion asks for; Delta stays at most 1. A factor of
    /// 1 or less changes nothing, and nothing changes `every-sample`, which has neither.
    #[must_use]
    pub fn stretched(mut self, by: f64) -> Self {
        if by <= 1.0 || !by.is_finite() {
            return self;
        }
        let (_, threshold, time) = self.terms();
        match threshold {
            Some(Threshold::Share(delta)) => *delta = (*delta * by).min(DELTA.1),
            Some(Threshold::Newtons(force)) => *force *= by,
            None => {}
        }
        if let Some(time) = time {
            *time = time.mul_f64(by);
        }
        self
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
        let mut copy = *self;
        let (name, threshold, time) = copy.terms();
        f.write_str(name)?;
        match threshold {
            // six digits are more than anybody writes, and hide the rounding of binary fractions
            Some(Threshold::Share(delta)) => write!(f, " {}%", libm::round(*delta * 1e8) / 1e6)?,
            Some(Threshold::Newtons(force)) => write!(f, " {force}N")?,
            None => {}
        }
        time.map_or(Ok(()), |time| write!(f, " {}ms", time.as_secs_f64() * 1e3))
    }
}

impl FromStr for Scheme {
    type Err = SchemeError;

    fn from_str(text: &str) -> Result<Self, SchemeError> {
        let mut words = text.split_whitespace();
        let word = words.next().unwrap_or_default();
        let example = Self::EXAMPLES.into_iter().find(|s| s.name() == word);
        let mut scheme = example.ok_or_else(|| SchemeError::Unknown {
            word: word.to_owned(),
        })?;
        let usage = scheme.to_string();
        let words: Vec<&str> = words.collect();
        match (scheme.terms(), words.as_slice()) {
            ((_, None, None), []) => {}
            ((_, Some(threshold), None), [word]) => threshold.read(word, &usage)?,
            ((_, None, Some(time)), [word]) => *time = period(word, &usage)?,
            ((_, Some(threshold), Some(time)), [word, late]) => {
                threshold.read(word, &usage)?;
                *time = period(late, &usage)?;
            }
            ((scheme, ..), _) => {
                return Err(SchemeError::Words {
                    scheme,
                    usage,
                    text: text.to_owned(),
                });
            }
        }
        Ok(scheme)
    }
}

/// All schemes as they are written.
fn known() -> String {
    Scheme::EXAMPLES
        .map(|scheme| format!("'{scheme}'"))
        .join(", ")
}

/// The number before a unit.
fn digits(word: &str, unit: &str) -> Option<f64> {
    word.strip_suffix(unit)?.parse().ok()
}

/// A number in its range, whose unit is `unit`; it can be written with `units`.
fn number(
    (word, usage): (&str, &str),
    value: Option<f64>,
    what: &'static str,
    (min, max): (f64, f64),
    (unit, units): (&'static str, &'static str),
) -> Result<f64, SchemeError> {
    let value = value.filter(|value| (min..=max).contains(value));
    let is_bare = word.parse().is_ok_and(f64::is_finite);
    let (word, usage) = (word.to_owned(), usage.to_owned());
    match value {
        Some(value) => Ok(value),
        None if is_bare => Err(SchemeError::Unit {
            word,
            what,
            units,
            usage,
        }),
        None => Err(SchemeError::Number {
            word,
            what,
            min,
            max,
            unit,
            usage,
        }),
    }
}

fn period(word: &str, usage: &str) -> Result<Duration, SchemeError> {
    let ms = digits(word, "ms").or_else(|| Some(digits(word, "s")? * 1e3));
    let ms = number((word, usage), ms, "time", PERIOD_MS, ("ms", "ms or s"))?;
    Ok(Duration::from_nanos(libm::round(ms * 1e6) as u64))
}

#[cfg(test)]
mod tests;
