//! The output of `ping -D`: a stamp, a sequence number and a round trip in each line.

use std::time::Duration;

use super::{Sample, TraceError, lost_between};

/// Reads it. Half of each round trip is taken for one way: ping does not show more. A sequence number that
/// is missing was lost, at the time at which it would have been sent.
///
/// # Errors
/// Line and reason; lines that are no answers (the heading, the summary) are passed over.
pub(super) fn parse(text: &str) -> Result<Vec<Sample>, TraceError> {
    let mut answers: Vec<(u64, Sample)> = Vec::new();
    for (at, line) in text.lines().enumerate() {
        if !line.contains("icmp_seq=") || !line.contains("time=") {
            continue;
        }
        let wrong = |what| TraceError::at(at + 1, what);
        let stamp = line.trim_start().strip_prefix('[');
        let stamp = stamp.and_then(|rest| rest.split(']').next());
        let seconds: f64 = stamp
            .and_then(|stamp| stamp.parse().ok())
            .filter(|stamp| (0.0..1e10).contains(stamp))
            .ok_or_else(|| wrong("expected a stamp such as [1700182800.410606]: use ping -D"))?;
        let number = field(line, "icmp_seq=").and_then(|number| number.parse().ok());
        let number = number.ok_or_else(|| wrong("expected a number after icmp_seq="))?;
        let ms: f64 = field(line, "time=")
            .and_then(|ms| ms.parse().ok())
            .filter(|ms| (0.0..=7.2e6).contains(ms))
            .ok_or_else(|| wrong("expected a round trip in ms after time="))?;
        let sample = Sample {
            // the stamp is that of the answer
            at: Duration::from_secs_f64((seconds - ms * 1e-3).max(0.0)),
            delay: Some(Duration::from_secs_f64(ms * 0.5e-3)),
        };
        answers.push((number, sample));
    }
    let lines = text.lines().count();
    with_the_lost(answers).ok_or_else(|| {
        let why = "more probes are missing than a hundred for each answer and a day of them";
        TraceError::at(lines, why)
    })
}

fn field<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = line.split_once(name)?;
    rest.split_whitespace().next()
}

/// The probes whose numbers are missing, evenly between their neighbours. A jump beyond a day of pings is
/// taken for a counter that began again. None if so many are missing that a short text would become a long path.
fn with_the_lost(mut answers: Vec<(u64, Sample)>) -> Option<Vec<Sample>> {
    const GAP_MAX: u64 = 100_000;
    const LOST_PER_ANSWER: u64 = 100;
    let mut room = GAP_MAX + LOST_PER_ANSWER * answers.len() as u64;
    answers.sort_by_key(|(_, sample)| sample.at);
    let mut samples: Vec<Sample> = Vec::with_capacity(answers.len());
    let mut before: Option<(u64, Duration)> = None;
    for (number, sample) in answers {
        if let Some((last, since)) = before {
            let steps = number.saturating_sub(last);
            if (2..=GAP_MAX).contains(&steps) {
                room = room.checked_sub(steps)?;
                samples.extend(lost_between(since, sample.at, steps - 1));
            }
        }
        before = Some((number, sample.at));
        samples.push(sample);
    }
    Some(samples)
}
