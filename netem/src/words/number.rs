//! Numbers with their units: times, shares, rates, sizes, counts.

use std::time::Duration;

use super::word::Word;
use super::{ParseError, Reason};
use crate::config::{DELAY_MAX, Probability, RATE_MAX_BIT_S};

const A_TIME: &str = "a time with its unit, such as 50ms (h, min, s, ms, us, ns)";
const A_TIME_HAS_A_UNIT: &str =
    "a unit after the number, such as 50ms: tc reads a bare number as us or as ns, by its version";
const A_PERCENTAGE: &str = "a percentage, such as 1%";
const A_RATE: &str = "a rate, such as 1mbit (bit, kbit, mbit, gbit; bps and so on are bytes)";

/// Digits with at most one point: no sign, no exponent, no `inf`.
fn decimal(text: &str) -> Option<f64> {
    let plain = text.chars().all(|c| c.is_ascii_digit() || c == '.');
    plain.then(|| text.parse().ok()).flatten()
}

/// A number and its unit in small letters.
fn with_unit(text: &str) -> (Option<f64>, String) {
    let unit_at = text.find(|c: char| c.is_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(unit_at);
    (decimal(number), unit.to_ascii_lowercase())
}

fn out_of_range(word: Word<'_>, range: String) -> ParseError {
    word.wrong(Reason::OutOfRange { range })
}

pub(super) fn time(word: Word<'_>) -> Result<Duration, ParseError> {
    let (number, unit) = with_unit(word.text);
    let number = number.ok_or_else(|| word.expected(A_TIME))?;
    let nanos_per_unit = match unit.as_str() {
        // tc has neither
        "h" => 3600e9,
        "min" => 60e9,
        "s" | "sec" | "secs" => 1e9,
        "ms" | "msec" | "msecs" => 1e6,
        "us" | "usec" | "usecs" => 1e3,
        "ns" | "nsec" | "nsecs" => 1.0,
        "" if number == 0.0 => 1.0,
        "" => return Err(word.expected(A_TIME_HAS_A_UNIT)),
        _ => return Err(word.expected(A_TIME)),
    };
    // The cast saturates.
    let time = Duration::from_nanos((number * nanos_per_unit + 0.5) as u64);
    if time > DELAY_MAX {
        return Err(out_of_range(word, format!("{DELAY_MAX:?} at most")));
    }
    Ok(time)
}

/// A time that is not shorter than `least`.
pub(super) fn time_from(word: Word<'_>, least: Duration) -> Result<Duration, ParseError> {
    let time = time(word)?;
    if time < least {
        return Err(out_of_range(word, format!("{least:?} to {DELAY_MAX:?}")));
    }
    Ok(time)
}

pub(super) fn percentage(word: Word<'_>) -> Result<Probability, ParseError> {
    let number = word.text.strip_suffix('%').unwrap_or(word.text);
    let percent = decimal(number).ok_or_else(|| word.expected(A_PERCENTAGE))?;
    match Probability::from_percent(percent) {
        Some(probability) if percent == 0.0 || probability > Probability::ZERO => Ok(probability),
        _ => Err(out_of_range(word, "0%, or 0.0000001% to 100%".to_owned())),
    }
}

/// A unit of a rate in bits per second. As in tc, those in `bps` are bytes, and `i` is a power of 1024.
fn bits_of(unit: &str) -> Option<f64> {
    let (size, prefix) = match (unit.strip_suffix("bit"), unit.strip_suffix("bps")) {
        (Some(prefix), _) => (1.0, prefix),
        (_, Some(prefix)) => (8.0, prefix),
        _ => return unit.is_empty().then_some(1.0),
    };
    let (base, letter) = prefix
        .strip_suffix('i')
        .map_or((1e3, prefix), |k| (1024.0, k));
    let power = ["", "k", "m", "g", "t"].iter().position(|k| *k == letter)?;
    (power > 0 || base < 1024.0).then(|| size * libm::pow(base, power as f64))
}

pub(super) fn bits_per_second(word: Word<'_>) -> Result<u64, ParseError> {
    let (number, unit) = with_unit(word.text);
    let number = number.ok_or_else(|| word.expected(A_RATE))?;
    let factor = bits_of(&unit).ok_or_else(|| word.expected(A_RATE))?;
    let rate = (number * factor + 0.5) as u64;
    if !(1..=RATE_MAX_BIT_S).contains(&rate) {
        return Err(out_of_range(word, "1bit to 1tbit".to_owned()));
    }
    Ok(rate)
}

/// A limit of a queue.
pub(super) enum QueueLimit {
    Bytes(u64),
    Packets(u32),
    Wait(Duration),
}

pub(super) fn queue_limit(word: Word<'_>) -> Result<QueueLimit, ParseError> {
    let (number, unit) = with_unit(word.text);
    let factor = match unit.as_str() {
        "p" => {
            let digits = word.text.strip_suffix(['p', 'P']).unwrap_or_default();
            let shortened = Word {
                text: digits,
                ..word
            };
            return whole(shortened, 1, u32::MAX.into(), "packets")
                .map(|packets| QueueLimit::Packets(u32::try_from(packets).unwrap_or(u32::MAX)))
                .map_err(|_| word.expected("a number of packets, such as 100p"));
        }
        "b" => 1.0,
        "kb" => 1024.0,
        "mb" => 1024.0 * 1024.0,
        _ => return time(word).map(QueueLimit::Wait),
    };
    let number = number.ok_or_else(|| word.expected("a size such as 64kb"))?;
    let bytes = (number * factor + 0.5) as u64;
    if !(1..=1 << 40).contains(&bytes) {
        return Err(out_of_range(word, "1b to 1048576mb".to_owned()));
    }
    Ok(QueueLimit::Bytes(bytes))
}

/// A whole number without a unit; `what` names its unit in the message.
pub(super) fn whole(
    word: Word<'_>,
    least: u64,
    most: u64,
    what: &'static str,
) -> Result<u64, ParseError> {
    let digits = !word.text.is_empty() && word.text.chars().all(|c| c.is_ascii_digit());
    if !digits {
        return Err(word.expected(match what {
            "packets" => "a number of packets, such as 10000",
            "bytes" => "a number of bytes, such as 1500",
            _ => "a whole number, such as 42",
        }));
    }
    match word.text.parse() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        _ => Err(out_of_range(word, format!("{least} to {most} {what}"))),
    }
}

/// A number of bytes with a sign.
pub(super) fn signed_bytes(word: Word<'_>) -> Result<i32, ParseError> {
    let bytes = word.text.parse().ok();
    let in_range = bytes.filter(|bytes: &i32| (-65_535..=65_535).contains(bytes));
    in_range.ok_or_else(|| word.expected("a number of bytes from -65535 to 65535, such as 28"))
}
