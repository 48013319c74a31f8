//! A recorded path: what delay a packet had and which were lost, as a function of time.

use std::sync::Arc;
use std::time::Duration;

use mmt_shared::stats::values::quantile;
use mmt_shared::time::duration_nanos;

use super::{Sample, TraceError, irtt, lens, mmt, ping};
use crate::direction::Direction;
use crate::distribution::DELAY_MAX;

/// The most samples of a path.
const SAMPLES_MAX: usize = 10_000_000;

/// What befell probes on a path, one direction. A packet meets what the last probe before it met; after
/// the last probe it begins again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathTrace {
    samples: Vec<Sample>,
    /// The time from the first sample to the repetition of it.
    period: Duration,
}

/// A recorded path as a setting of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// The file, as the settings call it.
    pub name: String,
    /// Which direction of it, if the file has both.
    pub direction: Option<Direction>,
    /// The path.
    pub path: Arc<PathTrace>,
}

impl PathTrace {
    /// A path from samples in any order of time.
    ///
    /// # Errors
    /// In words: no sample, none that arrived, a delay beyond 1 h.
    pub fn try_new(mut samples: Vec<Sample>) -> Result<Self, &'static str> {
        samples.sort_by_key(|sample| sample.at);
        let first = samples.first().map_or(Duration::ZERO, |sample| sample.at);
        for sample in &mut samples {
            sample.at = sample.at.saturating_sub(first);
        }
        let last = samples.last().map_or(Duration::ZERO, |sample| sample.at);
        if samples.len() > SAMPLES_MAX {
            return Err("a path has ten million samples at most");
        }
        let mut delays = samples.iter().filter_map(|sample| sample.delay).peekable();
        if delays.peek().is_none() {
            return Err("no probe of this path arrived");
        }
        if delays.any(|delay| delay > DELAY_MAX) {
            return Err("a delay is longer than 1 h");
        }
        let intervals = samples.len().saturating_sub(1).max(1) as u64;
        let interval = Duration::from_nanos(duration_nanos(last) / intervals);
        Ok(Self {
            samples,
            period: last + interval.max(Duration::from_nanos(1)),
        })
    }

    /// Reads a path in any of the formats known, recognised by their first line: irtt JSON, `ping -D`,
    /// LENS CSV, the CSV of our own recorder. `direction` picks one where the file has both.
    ///
    /// # Errors
    /// Line and reason.
    pub fn parse(text: &str, direction: Option<Direction>) -> Result<Self, TraceError> {
        let opens = |line: &&str| !line.is_empty() && !line.starts_with("ping: ");
        let first = text.lines().map(str::trim).find(opens);
        let first = first.unwrap_or_default();
        let samples = match first {
            line if line.starts_with('{') => irtt::parse(text, direction),
            line if line.starts_with("timestamp,rtt") => lens::parse(text, direction),
            line if line.starts_with("PING") || line.starts_with('[') => ping::parse(text),
            line if line.starts_with(mmt::OPENING) => {
                mmt::parse(text, direction.unwrap_or(Direction::Up))
            }
            _ => Err(TraceError::at(
                1,
                "no trace known: irtt JSON, `ping -D`, LENS CSV or a record of mmt begin otherwise",
            )),
        }?;
        let lines = text.lines().count().max(1);
        Self::try_new(samples).map_err(|why| TraceError::at(lines, why))
    }

    /// What a packet meets that is offered `elapsed` after the start.
    #[must_use]
    pub fn at(&self, elapsed: Duration) -> Option<Duration> {
        let nanos = duration_nanos(elapsed) % duration_nanos(self.period).max(1);
        let within = Duration::from_nanos(nanos);
        let begun = self.samples.partition_point(|sample| sample.at <= within);
        self.samples.get(begun.saturating_sub(1))?.delay
    }

    /// The samples in order of time, the first at zero.
    #[must_use]
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// After how long it repeats.
    #[must_use]
    pub fn period(&self) -> Duration {
        self.period
    }

    /// The share of probes lost, 0 to 1.
    #[must_use]
    pub fn loss(&self) -> f64 {
        let lost = self.samples.iter().filter(|sample| sample.delay.is_none());
        lost.count() as f64 / self.samples.len().max(1) as f64
    }

    /// How far apart the shortest and the longest 0.5 % of the delays are.
    pub(crate) fn span(&self) -> Duration {
        let mut delays: Vec<_> = self.samples.iter().filter_map(|s| s.delay).collect();
        delays.sort_unstable();
        let (low, high) = (quantile(&delays, 0.005), quantile(&delays, 0.995));
        high.unwrap_or_default()
            .saturating_sub(low.unwrap_or_default())
    }
}
