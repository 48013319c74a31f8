//! Emulated networks: their words, recorded paths, distributions, captures and records of packets.

use std::time::Duration;

use mmt_netem::capture::{self, Match};
use mmt_netem::distribution::{Cdf, Table};
use mmt_netem::link::LinkId;
use mmt_netem::record::summary::Summary;
use mmt_netem::record::{self, Entry, Heading, binary, csv};
use mmt_netem::trace::mahimahi::Opportunities;
use mmt_netem::trace::mmt::path_text;
use mmt_netem::trace::path::PathTrace;
use mmt_netem::words::parse;
use mmt_netem::{Direction, Link, LinkConfig, Packet};
use mmt_shared::time::Time;

use super::inputs;
use super::outcome::Outcome;

const HOUR: Duration = Duration::from_secs(3600);
/// A path has no more samples.
const SAMPLES_MAX: usize = 10_000_000;

/// What the words may name as files.
fn file(name: &str) -> Result<String, String> {
    match name {
        "path" => Ok(inputs::PATH.to_owned()),
        "cdf" => Ok(inputs::CDF.to_owned()),
        "table" => Ok(inputs::TABLE.to_owned()),
        "opportunities" => Ok("3\n7\n7\n20\n".to_owned()),
        _ => Err("there is no such file".to_owned()),
    }
}

pub(super) fn words(input: &[u8]) -> Outcome {
    let Ok(text) = std::str::from_utf8(input) else {
        return Outcome::refused(&"no text");
    };
    match parse(text, &mut file) {
        Ok(config) => {
            let printed = config.to_string();
            let again = parse(&printed, &mut file).map_err(|why| format!("{why} in {printed}"));
            assert_eq!(again.as_ref(), Ok(&config), "{printed}");
            carries(config);
            Outcome::taken(
                printed
                    .bytes()
                    .filter(u8::is_ascii_alphabetic)
                    .map(u64::from)
                    .sum(),
            )
        }
        Err(why) => {
            // what is shown of it is one line and a caret
            assert!(why.to_string().len() < 1000);
            assert!(why.pointer(text).lines().count() <= 2);
            Outcome::refused(&why.reason)
        }
    }
}

/// Twenty packets: whatever the words, none is lost without a count, and none leaves before it came.
fn carries(config: LinkConfig) {
    let Ok(mut link) = Link::try_new(config, 1, LinkId::UP) else {
        return;
    };
    for number in 0..20_u64 {
        let now = Time::from_millis(number * number);
        polled(&mut link, now);
        link.offer(now, Packet::new(40 + number as usize * 80, number));
        conserves(&link);
    }
    for more in [1_u64, 1000, 10_000_000] {
        polled(&mut link, Time::from_millis(400 + more));
        conserves(&link);
    }
}

fn polled(link: &mut Link<u64>, now: Time) {
    let mut last = Time::ZERO;
    for _ in 0..1000 {
        let Some(left) = link.poll(now) else {
            return;
        };
        assert!(
            left.due <= now && left.due >= left.offered_at && left.due >= last,
            "{left:?}"
        );
        last = left.due;
    }
    panic!("twenty packets leave a thousand times");
}

fn conserves(link: &Link<u64>) {
    let of = link.counters();
    let gone = of.delivered.packets + of.dropped.total().packets + link.in_flight() as u64;
    assert_eq!(of.offered.packets + of.duplicated.packets, gone, "{of:?}");
}

/// The first byte asks for a direction.
pub(super) fn trace(input: &[u8]) -> Outcome {
    let (wanted, text) = input.split_first().unwrap_or((&0, &[]));
    let wanted = [None, Some(Direction::Up), Some(Direction::Down)][usize::from(wanted % 3)];
    let Ok(text) = std::str::from_utf8(text) else {
        return Outcome::refused(&"no text");
    };
    match PathTrace::parse(text, wanted) {
        Ok(path) => {
            judge_path(&path);
            let again = PathTrace::parse(&path_text(path.samples()), None).unwrap();
            assert_eq!(again.samples(), path.samples());
            let kind = text.trim_start().bytes().next().unwrap_or_default();
            Outcome::taken(u64::from(kind) + 256 * u64::from(path.loss() > 0.0))
        }
        Err(why) => {
            assert!(
                why.line >= 1 && why.line <= text.lines().count() + 1,
                "{why}"
            );
            Outcome::refused(&why.reason)
        }
    }
}

fn judge_path(path: &PathTrace) {
    let samples = path.samples();
    assert!(!samples.is_empty() && samples.len() <= SAMPLES_MAX);
    assert!(samples.is_sorted_by_key(|sample| sample.at) && samples[0].at.is_zero());
    assert!(path.period() > samples.last().unwrap().at);
    assert!(
        samples
            .iter()
            .filter_map(|sample| sample.delay)
            .all(|delay| delay <= HOUR)
    );
    assert!((0.0..1.0).contains(&path.loss()));
    for at in [
        Duration::ZERO,
        path.period(),
        path.period() * 2,
        Duration::MAX,
    ] {
        assert!(path.at(at).is_none_or(|delay| delay <= HOUR));
    }
}

pub(super) fn opportunities(input: &[u8]) -> Outcome {
    let Ok(text) = std::str::from_utf8(input) else {
        return Outcome::refused(&"no text");
    };
    let read = Opportunities::parse("opportunities", text);
    if let Ok(trace) = &read {
        let rate = trace.mean_bit_s();
        assert!(rate.is_finite() && rate > 0.0, "{rate}");
        // the bottleneck that it is for: what waits for its opportunity leaves by then
        let mut text_of = |_: &str| Ok(text.to_owned());
        carries(parse("rate trace opportunities queue 100p", &mut text_of).unwrap());
    }
    Outcome::of(read)
}

/// The same text as a table, as a measured distribution, and as the delay of a link.
pub(super) fn distribution(input: &[u8]) -> Outcome {
    let Ok(text) = std::str::from_utf8(input) else {
        return Outcome::refused(&"no text");
    };
    let (table, cdf) = (Table::parse("t", text), Cdf::parse("c", text));
    let mut text_of = |_: &str| Ok(text.to_owned());
    let sort = u64::from(table.is_ok()) + 2 * u64::from(cdf.is_ok());
    if table.is_ok() {
        carries(parse("delay 50ms 10ms distribution table t", &mut text_of).unwrap());
    }
    match cdf {
        Ok(cdf) => {
            let points: Vec<_> = cdf.points().collect();
            assert!(
                points.is_sorted_by(|a, b| a.0 <= b.0 && a.1 <= b.1),
                "{points:?}"
            );
            assert!(
                points
                    .iter()
                    .all(|(nanos, share)| Duration::from_nanos(*nanos) <= HOUR
                        && (0.0..=1.0).contains(share))
            );
            carries(parse("delay cdf c", &mut text_of).unwrap());
            Outcome::taken(sort)
        }
        Err(why) if table.is_err() => Outcome::refused(&why.reason),
        Err(_) => Outcome::taken(sort),
    }
}

/// One capture, or two behind each other, the length of the first in the last two bytes.
pub(super) fn capture(input: &[u8]) -> Outcome {
    let Some((both, length)) = input.split_last_chunk::<2>() else {
        return Outcome::refused(&"two bytes");
    };
    let (first, second) = both.split_at(usize::from(u16::from_le_bytes(*length)).min(both.len()));
    let (one, other) = (capture::read(first), capture::read(second));
    for frames in [&one, &other].into_iter().flatten() {
        assert!(frames.len() <= both.len() / 12, "{} packets", frames.len());
        let bytes: usize = frames.iter().map(|frame| frame.bytes.len()).sum();
        assert!(bytes <= both.len());
    }
    let (from, to) = match (&one, &other) {
        (Ok(from), Ok(to)) => (from, to),
        (Ok(from), Err(_)) => (from, from),
        (Err(why), _) => return Outcome::refused(&why.reason),
    };
    for same_clock in [false, true] {
        match (Match { same_clock }).paths(from, to) {
            Ok(matched) => {
                let delays = matched.entries.iter().filter_map(|entry| match entry.end {
                    record::End::Sent { sent, .. } => Some(sent.saturating_since(entry.offered)),
                    _ => None,
                });
                assert!(delays.max().unwrap_or_default() <= HOUR);
                summarised(&matched.entries);
            }
            Err(why) if !same_clock => return Outcome::refused(&why),
            Err(_) => {}
        }
    }
    Outcome::taken(1)
}

fn summarised(entries: &[Entry]) {
    for direction in [Direction::Up, Direction::Down] {
        let summary = Summary::of(entries, direction);
        let numbers = [
            summary.rate_hz,
            summary.mean_ms,
            summary.sd_ms,
            summary.p99_ms,
            summary.loss,
            summary.burst_packets,
            summary.reordered,
        ];
        assert!(
            numbers
                .iter()
                .all(|number| number.is_finite() && *number >= 0.0),
            "{summary:?}"
        );
        assert!(summary.queue.len() <= 202 && summary.delay_histogram.len() <= 40);
    }
}

fn in_csv(heading: &Heading, entries: &[Entry]) -> String {
    let mut text = csv::heading(heading);
    entries.iter().for_each(|entry| csv::push(&mut text, entry));
    text
}

pub(super) fn packet_record(input: &[u8]) -> Outcome {
    let (heading, entries) = match record::read(input) {
        Ok(read) => read,
        Err(why) => return Outcome::refused(&why.reason),
    };
    assert!(entries.len() <= input.len());
    summarised(&entries);
    let text = in_csv(&heading, &entries);
    assert_eq!(
        csv::read(&text).as_ref(),
        Ok(&(heading.clone(), entries.clone())),
        "{text}"
    );
    let (mut writer, mut bytes) = (binary::Writer::default(), Vec::new());
    writer.heading(&mut bytes, &heading);
    entries
        .iter()
        .for_each(|entry| writer.push(&mut bytes, entry));
    assert_eq!(
        record::read(&bytes).as_ref(),
        Ok(&(heading, entries.clone()))
    );
    assert_eq!(record::as_text(bytes).unwrap(), text);
    if let Ok(path) = PathTrace::parse(&text, Some(Direction::Up)) {
        judge_path(&path);
    }
    Outcome::taken(u64::from(input.starts_with(binary::MAGIC)) + 2 * (entries.len().min(4) as u64))
}
