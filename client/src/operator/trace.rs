//! A recorded tool path as an operator: where the HIP is at each moment, whatever it feels.
//!
//! A path comes from plain CSV or from a file of recorded pushes. It never reads a clock and never
//! extrapolates: before its first sample and after its last it holds them. Between samples it is linear.
//!
//! A recorded path was made around another object, elsewhere. [`Trace::starting_at`] carries it to where
//! ours is, unscaled. A path from CSV is left as it lies; recorded pushes are turned to push towards +x, one
//! going on where the other ended.

use std::time::Duration;

use mmt_shared::model::geometry::{Vec2, rotate};
use mmt_shared::recording::{ParseError, Push, Recording};

/// The first line of a tool path in CSV, exactly.
pub const CSV_HEADER: &str = "t_s,x_m,y_m";
/// The most samples that a path may hold: 2.8 hours at 1 kHz.
pub const SAMPLES_MAX: usize = 10_000_000;
/// The latest time accepted in CSV, s: a month.
pub const TIME_MAX_S: f64 = 2.7e6;
/// The farthest coordinate accepted in CSV, m.
pub const COORDINATE_MAX_M: f64 = 100.0;
/// Way in +x before the first recorded push, m: from the stand-off nearly to the box, so that a push of
/// two centimetres, as they are recorded, gets there.
pub const APPROACH_M: f64 = 0.06;
/// Its speed, m/s: the scripted operator's.
const APPROACH_M_PER_S: f64 = 0.06;
/// Speed at which the hand is led from the tool to where a path begins, m/s.
const LEAD_M_PER_S: f64 = 0.2;
/// From the last sample of a push to the first of the next, s: the recordings' own sample period.
const BETWEEN_S: f64 = 0.03;
/// A finger that ends nearer than this to where it began has no direction, m.
const DIRECTION_MIN_M: f64 = 1e-6;

/// Why a text is not a tool path.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TraceError {
    /// The first line is not the header.
    #[error("line 1: the header should be exactly {CSV_HEADER:?}, found {found:?}")]
    Header {
        /// The first line, at most 48 characters of it.
        found: String,
    },
    /// A line has the wrong number of fields.
    #[error("line {line}: expected 3 fields ({CSV_HEADER}), found {found}")]
    Fields {
        /// Line, from 1.
        line: usize,
        /// Number of fields found.
        found: usize,
    },
    /// A field is no number, not finite, or out of range.
    #[error("line {line}: {field} should be a number from {least} to {most}, found {found:?}")]
    Number {
        /// Line, from 1.
        line: usize,
        /// The column's name.
        field: &'static str,
        /// The field, at most 48 characters of it.
        found: String,
        /// Least accepted value.
        least: i64,
        /// Greatest accepted value.
        most: i64,
    },
    /// Time does not increase.
    #[error("line {line}: t_s {t_s} is not later than {before} on the line before")]
    Time {
        /// Line, from 1.
        line: usize,
        /// The time, s.
        t_s: String,
        /// The time before it, s.
        before: String,
    },
    /// There is no sample.
    #[error("line 2: there is no sample; at least one line of {CSV_HEADER} must follow the header")]
    Empty,
    /// There are too many samples.
    #[error("line {line}: more than {SAMPLES_MAX} samples; cut the path into several files")]
    TooLong {
        /// Line, from 1.
        line: usize,
    },
    /// The text is not a recording of pushes.
    #[error(transparent)]
    Recording(#[from] ParseError),
    /// The recording has no push of that number.
    #[error("there is no push {index}: the recording holds pushes 0 to {last}")]
    NoSuchPush {
        /// The number asked for, from 0.
        index: usize,
        /// The number of the last push.
        last: usize,
    },
}

/// A tool path over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Time since the start (s, strictly increasing from 0) and tool point in the world (m); never empty.
    samples: Vec<(f64, Vec2)>,
    /// How long it stood still.
    waited: Duration,
}

impl Trace {
    /// The way of these samples: time since the start and tool point (world, m). None if there is none, or if time does
    /// not increase.
    pub fn of_samples(samples: impl IntoIterator<Item = (Duration, Vec2)>) -> Option<Self> {
        let samples = samples.into_iter();
        let samples: Vec<_> = samples.map(|(t, at)| (t.as_secs_f64(), at)).collect();
        let increases = samples.is_sorted_by(|(before, _), (t_s, _)| before < t_s);
        (increases && !samples.is_empty()).then(|| Self::of(samples))
    }

    fn of(samples: Vec<(f64, Vec2)>) -> Self {
        let waited = Duration::ZERO;
        Self { samples, waited }
    }

    /// Reads a path from CSV: the header `t_s,x_m,y_m`, then one sample a line, t strictly increasing.
    /// Time is counted from the first sample; blank lines at the end are ignored.
    ///
    /// # Errors
    /// Names the first line that is wrong and why.
    pub fn from_csv(text: &str) -> Result<Self, TraceError> {
        let mut lines = text.trim_end().lines().enumerate();
        let header = lines.next().map_or("", |(_, line)| line);
        if header != CSV_HEADER {
            return Err(TraceError::Header {
                found: shown(header),
            });
        }
        let mut samples: Vec<(f64, Vec2)> = Vec::new();
        for (index, text) in lines {
            let line = index + 1;
            let (t_s, point) = csv_sample(line, text)?;
            if let Some((before, _)) = samples.last().filter(|(before, _)| t_s <= *before) {
                return Err(TraceError::Time {
                    line,
                    t_s: t_s.to_string(),
                    before: before.to_string(),
                });
            }
            if samples.len() == SAMPLES_MAX {
                return Err(TraceError::TooLong { line });
            }
            samples.push((t_s, point));
        }
        let Some((start_s, _)) = samples.first().copied() else {
            return Err(TraceError::Empty);
        };
        samples.iter_mut().for_each(|(t_s, _)| *t_s -= start_s);
        Ok(Self::of(samples))
    }

    /// The finger's path in a text of recorded pushes, as [`Trace::from_recording`].
    ///
    /// # Errors
    /// As [`Recording::parse`] and [`Trace::from_recording`].
    pub fn from_cmu(text: &str, push: Option<usize>) -> Result<Self, TraceError> {
        Self::from_recording(&Recording::parse(text)?, push)
    }

    /// The finger's path in recorded pushes: of the push of that number (from 0), or of all.
    ///
    /// Each push keeps its own timing and shape (about 33 samples a second at 2.7 mm/s) and is turned so
    /// that it leads towards +x on the whole; it begins where the last one ended, for the finger's way
    /// between them was not recorded. A straight approach of [`APPROACH_M`] comes first.
    ///
    /// # Errors
    /// There is no push of that number.
    pub fn from_recording(recording: &Recording, push: Option<usize>) -> Result<Self, TraceError> {
        let pushes = match push {
            None => recording.pushes.as_slice(),
            Some(index) => recording
                .pushes
                .get(index..=index)
                .ok_or(TraceError::NoSuchPush {
                    index,
                    last: recording.pushes.len().saturating_sub(1),
                })?,
        };
        let approached = (APPROACH_M / APPROACH_M_PER_S, Vec2::new(APPROACH_M, 0.0));
        let mut samples = vec![(0.0, Vec2::zeros()), approached];
        pushes.iter().for_each(|push| append(&mut samples, push));
        Ok(Self::of(samples))
    }

    /// This path carried, unturned and unscaled, to start at `start` (world, m).
    #[must_use]
    pub fn starting_at(mut self, start: Vec2) -> Self {
        let shift = start - self.at(Duration::ZERO);
        self.samples
            .iter_mut()
            .for_each(|(_, point)| *point += shift);
        self
    }

    /// This path after a straight way (world, m) from `from` over `points`, the last of which is where it begins.
    #[must_use]
    pub(super) fn led_along(&self, from: Vec2, points: &[Vec2]) -> Self {
        let mut way = vec![(0.0, from)];
        let (mut at, mut led_s) = (from, 0.0);
        for point in points {
            led_s += (point - at).norm() / LEAD_M_PER_S;
            at = *point;
            way.push((led_s, at));
        }
        // its last point is the path's first
        way.pop();
        way.extend(
            self.samples
                .iter()
                .map(|(t_s, point)| (led_s + t_s, *point)),
        );
        Self::of(way)
    }

    /// The tool point (world, m) at a time since the start: linear between samples, held after the last.
    pub fn at(&self, elapsed: Duration) -> Vec2 {
        let t_s = elapsed.saturating_sub(self.waited).as_secs_f64();
        let next = self
            .samples
            .partition_point(|(sample_s, _)| *sample_s <= t_s);
        let before = next
            .checked_sub(1)
            .and_then(|index| self.samples.get(index));
        match (before, self.samples.get(next)) {
            (Some((from_s, from)), Some((to_s, to))) => {
                from + (to - from) * ((t_s - from_s) / (to_s - from_s))
            }
            (Some((_, point)), None) | (None, Some((_, point))) => *point,
            (None, None) => Vec2::zeros(),
        }
    }

    /// Stands still for so long, from wherever it is.
    pub(super) fn wait(&mut self, period: Duration) {
        self.waited += period;
    }

    /// Time from the first to the last sample, and for how long it stood still.
    pub fn duration(&self) -> Duration {
        let last_s = self.samples.last().map_or(0.0, |(t_s, _)| *t_s);
        Duration::try_from_secs_f64(last_s).unwrap_or(Duration::ZERO) + self.waited
    }

    /// The samples: time since the start (s, strictly increasing from 0) and tool point (world, m).
    pub fn samples(&self) -> &[(f64, Vec2)] {
        &self.samples
    }
}

fn shown(text: &str) -> String {
    text.chars().take(48).collect()
}

fn csv_sample(line: usize, text: &str) -> Result<(f64, Vec2), TraceError> {
    let mut fields = text.split(',');
    let (Some(t), Some(x), Some(y), None) =
        (fields.next(), fields.next(), fields.next(), fields.next())
    else {
        let found = text.split(',').count();
        return Err(TraceError::Fields { line, found });
    };
    let number = |field, text: &str, limit: f64| match text.trim().parse::<f64>() {
        // A NaN fails this comparison.
        Ok(value) if value.abs() <= limit => Ok(value),
        _ => Err(TraceError::Number {
            line,
            field,
            found: shown(text),
            least: -(limit as i64),
            most: limit as i64,
        }),
    };
    let t_s = number("t_s", t, TIME_MAX_S)?;
    let x = number("x_m", x, COORDINATE_MAX_M)?;
    let y = number("y_m", y, COORDINATE_MAX_M)?;
    Ok((t_s, Vec2::new(x, y)))
}

/// Appends a push's finger path, turned towards +x, from where the path has come to.
fn append(samples: &mut Vec<(f64, Vec2)>, push: &Push) {
    let (Some(first), Some(end)) = (push.finger.first(), push.finger.last()) else {
        return;
    };
    let Some((last_s, last)) = samples.last().copied() else {
        return;
    };
    let way = end.pose.position - first.pose.position;
    let direction = if way.norm() > DIRECTION_MIN_M {
        libm::atan2(way.y, way.x)
    } else {
        0.0
    };
    samples.extend(push.finger.iter().map(|sample| {
        let moved = sample.pose.position - first.pose.position;
        (
            last_s + BETWEEN_S + (sample.t_s - first.t_s),
            last + rotate(-direction, moved),
        )
    }));
}

#[cfg(test)]
mod tests;
