//! Spaced repeats of an update: when the same is sent again, unless something newer was sent.
//!
//! Pure and of fixed size. A repeat must never outlive the update that it repeats, and never be a new update.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use mmt_shared::model::update::Update;
use mmt_shared::time::Time;
use serde::{Deserialize, Serialize};

/// Most repeats of one update.
pub const REPEATS_MAX: usize = 4;
/// Accepted times, ms. After a second the acknowledgements have long shown what is lost.
const AFTER_MS: (f64, f64) = (1.0, 1000.0);

/// When an update is sent again: times after it, increasing; none, or up to [`REPEATS_MAX`].
///
/// In files a list of ms, on the command line words such as `10ms 30ms` or `none`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<f64>", into = "Vec<f64>")]
pub struct Repeats {
    after: [Duration; REPEATS_MAX],
    count: usize,
}

/// Why these are no repeats.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RepeatsError {
    /// Too many.
    #[error("{0} repeats; at most {REPEATS_MAX}")]
    Count(usize),
    /// A number without its unit.
    #[error("time '{0}' has no unit (ms); write 'none', '10ms' or '10ms 30ms'")]
    Unit(String),
    /// A time out of range, or no time.
    #[error(
        "time '{0}' is outside the accepted range {min} to {max} ms; write 'none', '10ms' or '10ms 30ms'",
        min = AFTER_MS.0,
        max = AFTER_MS.1
    )]
    Time(String),
    /// Not in order.
    #[error("the times of repeats must increase")]
    Order,
}

impl Repeats {
    /// Nothing is sent twice.
    pub const NONE: Self = Self {
        after: [Duration::ZERO; REPEATS_MAX],
        count: 0,
    };

    /// 10 and 30 ms after the update: what `mmt reproduce repeats` found worth its packets (docs/traffic.md).
    #[must_use]
    pub fn recommended() -> Self {
        let mut after = [Duration::ZERO; REPEATS_MAX];
        let times = [Duration::from_millis(10), Duration::from_millis(30)];
        after
            .iter_mut()
            .zip(times)
            .for_each(|(slot, time)| *slot = time);
        Self {
            after,
            count: times.len(),
        }
    }

    /// From times in ms.
    ///
    /// # Errors
    /// Too many, out of range, or not increasing.
    pub fn try_new(times_ms: &[f64]) -> Result<Self, RepeatsError> {
        if times_ms.len() > REPEATS_MAX {
            return Err(RepeatsError::Count(times_ms.len()));
        }
        let mut after = [Duration::ZERO; REPEATS_MAX];
        let mut last = Duration::ZERO;
        for (slot, ms) in after.iter_mut().zip(times_ms) {
            if !(AFTER_MS.0..=AFTER_MS.1).contains(ms) {
                return Err(RepeatsError::Time(ms.to_string()));
            }
            *slot = Duration::from_nanos(libm::round(ms * 1e6) as u64);
            if *slot <= last {
                return Err(RepeatsError::Order);
            }
            last = *slot;
        }
        Ok(Self {
            after,
            count: times_ms.len(),
        })
    }

    /// The times after the update, increasing.
    #[must_use]
    pub fn after(&self) -> &[Duration] {
        self.after.get(..self.count).unwrap_or_default()
    }
}

impl TryFrom<Vec<f64>> for Repeats {
    type Error = RepeatsError;

    fn try_from(times_ms: Vec<f64>) -> Result<Self, RepeatsError> {
        Self::try_new(&times_ms)
    }
}

impl From<Repeats> for Vec<f64> {
    fn from(repeats: Repeats) -> Self {
        let ms = |after: &Duration| after.as_nanos() as f64 / 1e6;
        repeats.after().iter().map(ms).collect()
    }
}

impl FromStr for Repeats {
    type Err = RepeatsError;

    fn from_str(text: &str) -> Result<Self, RepeatsError> {
        if text.trim() == "none" {
            return Ok(Self::NONE);
        }
        let ms = |word: &str| {
            let digits = word
                .strip_suffix("ms")
                .and_then(|digits| digits.parse().ok());
            let is_bare = word.parse().is_ok_and(f64::is_finite);
            let wrong = if is_bare {
                RepeatsError::Unit
            } else {
                RepeatsError::Time
            };
            digits.ok_or_else(|| wrong(word.to_owned()))
        };
        let times: Vec<f64> = text.split_whitespace().map(ms).collect::<Result<_, _>>()?;
        if times.is_empty() {
            Err(RepeatsError::Time(text.to_owned()))
        } else {
            Self::try_new(&times)
        }
    }
}

impl fmt::Display for Repeats {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.count == 0 {
            return f.write_str("none");
        }
        for (n, ms) in Vec::<f64>::from(*self).into_iter().enumerate() {
            let gap = if n == 0 { "" } else { " " };
            write!(f, "{gap}{ms}ms")?;
        }
        Ok(())
    }
}

/// The newest update, as long as it has repeats to come.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Repeating {
    pub(crate) update: Update,
    sent: Time,
    done: usize,
}

impl Repeating {
    /// An update that was sent at `now`; it takes the place of the one before.
    pub(crate) fn new(now: Time, update: Update) -> Self {
        Self {
            update,
            sent: now,
            done: 0,
        }
    }

    /// When the next repeat is due; none after the last.
    pub(crate) fn due(&self, repeats: &Repeats) -> Option<Time> {
        repeats
            .after()
            .get(self.done)
            .map(|after| self.sent + *after)
    }

    /// Whether a repeat is due at `now`. One that is asked for late takes the ones before it along.
    pub(crate) fn take_due(&mut self, now: Time, repeats: &Repeats) -> bool {
        let before = self.done;
        while self.due(repeats).is_some_and(|due| due <= now) {
            self.done += 1;
        }
        self.done > before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeats_are_written_as_words_and_as_a_list_and_read_back() {
        for text in ["none", "10ms", "10ms 30ms", "1ms 2.5ms 3ms 1000ms"] {
            let repeats: Repeats = text.parse().unwrap();
            assert_eq!(repeats.to_string(), text);
            assert_eq!(Repeats::try_from(Vec::from(repeats)), Ok(repeats));
        }
        assert_eq!("10ms 30ms".parse(), Ok(Repeats::recommended()));
        assert_eq!(Repeats::try_new(&[]), Ok(Repeats::NONE));
    }

    #[test]
    fn what_is_no_repeat_is_named() {
        let error = |text: &str| text.parse::<Repeats>().unwrap_err();
        for wrong in ["", "0ms", "1001ms", "nanms", "10ms soon"] {
            assert!(matches!(error(wrong), RepeatsError::Time(_)), "{wrong}");
        }
        assert_eq!(error("10ms 30"), RepeatsError::Unit("30".to_owned()));
        assert_eq!(error("10ms 10ms"), RepeatsError::Order);
        assert_eq!(error("1ms 2ms 3ms 4ms 5ms"), RepeatsError::Count(5));
    }
}
