//! The packet delivery traces of mahimahi (`mm-link`): when a bottleneck can send 1500 bytes.

use std::time::Duration;

use mmt_shared::time::duration_nanos;

use super::{TraceError, meaningful_lines};

/// Bytes that one opportunity carries; several small packets share one, a large one takes several.
pub const OPPORTUNITY_BYTES: u64 = 1500;
/// The most opportunities in a trace.
const OPPORTUNITIES_MAX: usize = 50_000_000;
const NANOS_PER_MS: u64 = 1_000_000;

/// The times at which a bottleneck can send, over and over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Opportunities {
    /// The file, as the settings call it.
    pub(crate) name: String,
    /// Milliseconds from the start, ascending; the last is the period.
    times_ms: Vec<u64>,
    period_ns: u64,
}

impl Opportunities {
    /// Reads a trace: a line for each opportunity, in whole milliseconds, never falling; the last is
    /// when it begins again.
    ///
    /// # Errors
    /// Line and reason.
    pub fn parse(name: &str, text: &str) -> Result<Self, TraceError> {
        let mut times_ms: Vec<u64> = Vec::new();
        let mut last_line = 1;
        for (line, content) in meaningful_lines(text) {
            let time = content.parse().map_err(|_| {
                TraceError::at(line, "expected a time in whole milliseconds, such as 17")
            })?;
            if times_ms.last().is_some_and(|last| time < *last) {
                return Err(TraceError::at(line, "the times must not fall"));
            }
            if time > 1_000_000_000_000 || times_ms.len() >= OPPORTUNITIES_MAX {
                return Err(TraceError::at(line, "the trace is too long"));
            }
            times_ms.push(time);
            last_line = line;
        }
        let period_ms = times_ms.last().copied().unwrap_or(0);
        if period_ms == 0 {
            let why =
                "the trace must end after 0 ms: its last line is the time at which it begins again";
            return Err(TraceError::at(last_line, why));
        }
        Ok(Self {
            name: name.to_owned(),
            times_ms,
            period_ns: period_ms * NANOS_PER_MS,
        })
    }

    /// After how long it begins again.
    pub(crate) fn period(&self) -> Duration {
        Duration::from_nanos(self.period_ns)
    }

    /// Bits per second on average.
    #[must_use]
    pub fn mean_bit_s(&self) -> f64 {
        (self.times_ms.len() as u64 * OPPORTUNITY_BYTES * 8) as f64 * 1e9 / self.period_ns as f64
    }

    /// The time of opportunity `number`, counted on through the repetitions.
    pub(crate) fn time(&self, number: u64) -> Duration {
        let per_round = self.times_ms.len().max(1) as u64;
        let (round, within) = (number / per_round, number % per_round);
        let within = usize::try_from(within).unwrap_or(0);
        let ms = self.times_ms.get(within).copied().unwrap_or(0);
        let nanos = round.saturating_mul(self.period_ns);
        Duration::from_nanos(nanos.saturating_add(ms * NANOS_PER_MS))
    }

    /// The number of the first opportunity that is not before `elapsed`.
    pub(crate) fn first_from(&self, elapsed: Duration) -> u64 {
        let nanos = duration_nanos(elapsed);
        // at the very end of a round the last opportunity of that round is still to be had
        let round = nanos.saturating_sub(1) / self.period_ns;
        let within = nanos - round * self.period_ns;
        let passed = self
            .times_ms
            .partition_point(|ms| ms * NANOS_PER_MS < within);
        round
            .saturating_mul(self.times_ms.len() as u64)
            .saturating_add(passed as u64)
    }
}
