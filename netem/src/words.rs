//! The words in which people write a link down: those of `tc netem`, and `order` beside them.
//!
//! The arithmetic behind the words is our own; `docs/netem.md` says where it differs from tc's. A word
//! that tc knows and this crate does not is an error of its own, never ignored.

use std::iter::Peekable;
use std::str::FromStr;
use std::time::Duration;

mod error;
mod print;
#[cfg(test)]
mod tests;

pub use error::{ParseError, Reason};

use crate::config::{
    DELAY_MAX, Delay, LIMIT_DEFAULT, LIMIT_MAX, LinkConfig, Loss, Order, Probability,
};

/// What tc knows and this crate does not, by its first word.
const NOT_YET: [(&str, &str); 8] = [
    ("corrupt", "corruption"),
    ("duplicate", "duplicates"),
    (
        "reorder",
        "reordering by share (`order free` lets jitter reorder)",
    ),
    ("gap", "reordering by gap"),
    ("rate", "a rate"),
    ("slot", "slots"),
    ("ecn", "marking instead of dropping"),
    (
        "seed",
        "a seed among the words (it is an option of its own)",
    ),
];

const A_WORD: &str = "delay, loss, order, limit or none";
const A_TIME: &str = "a time with its unit, such as 50ms (s, ms, us, ns)";
const A_TIME_HAS_A_UNIT: &str =
    "a unit after the number, such as 50ms: tc reads a bare number as us or as ns, by its version";
const A_PERCENTAGE: &str = "a percentage, such as 1%";

impl FromStr for LinkConfig {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        let mut parser = Parser::new(text);
        while let Some(word) = parser.next() {
            parser.sentence(word)?;
        }
        parser.finish()
    }
}

impl TryFrom<String> for LinkConfig {
    type Error = ParseError;

    fn try_from(text: String) -> Result<Self, ParseError> {
        text.parse()
    }
}

#[derive(Clone, Copy)]
struct Word<'a> {
    text: &'a str,
    column: usize,
}

impl Word<'_> {
    fn wrong(self, reason: Reason) -> ParseError {
        ParseError {
            word: self.text.to_owned(),
            column: self.column,
            reason,
        }
    }

    fn expected(self, expected: &'static str) -> ParseError {
        self.wrong(Reason::Expected { expected })
    }

    fn not_yet(self, feature: &'static str) -> ParseError {
        self.wrong(Reason::NotSupportedYet { feature })
    }

    fn starts_a_number(self) -> bool {
        self.text
            .starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
    }
}

/// What has been said so far.
struct Parser<'a> {
    words: Peekable<std::vec::IntoIter<Word<'a>>>,
    end: Word<'a>,
    none: Option<Word<'a>>,
    delay: Option<(Duration, Option<Duration>)>,
    distribution: Option<(Word<'a>, Shape)>,
    loss: Option<Loss>,
    order: Option<Order>,
    limit: Option<u32>,
}

#[derive(Clone, Copy)]
enum Shape {
    Uniform,
    Normal,
}

impl<'a> Parser<'a> {
    fn new(text: &'a str) -> Self {
        let end = Word {
            text: "",
            column: text.chars().count().saturating_add(1),
        };
        Self {
            words: split(text).into_iter().peekable(),
            end,
            none: None,
            delay: None,
            distribution: None,
            loss: None,
            order: None,
            limit: None,
        }
    }

    fn next(&mut self) -> Option<Word<'a>> {
        self.words.next()
    }

    /// The next word, or the end of the text as an empty one.
    fn argument(&mut self) -> Word<'a> {
        self.words.next().unwrap_or(self.end)
    }

    fn sentence(&mut self, word: Word<'a>) -> Result<(), ParseError> {
        if self.none.is_some() {
            return Err(word.expected("nothing beside none"));
        }
        match word.text {
            "none" if self.said_nothing() => self.none = Some(word),
            "none" => return Err(word.expected("nothing beside none")),
            "delay" | "latency" => {
                let delay = self.delay_arguments()?;
                once(&mut self.delay, delay, word)?;
            }
            "distribution" => {
                let shape = self.shape()?;
                once(&mut self.distribution, (word, shape), word)?;
            }
            "loss" | "drop" => {
                let loss = self.loss_arguments()?;
                once(&mut self.loss, loss, word)?;
            }
            "order" => {
                let order = self.order_argument()?;
                once(&mut self.order, order, word)?;
            }
            "limit" => {
                let limit = limit(self.argument())?;
                once(&mut self.limit, limit, word)?;
            }
            text => {
                let known = NOT_YET.iter().find(|(name, _)| *name == text);
                return Err(known.map_or_else(
                    || word.expected(A_WORD),
                    |(_, feature)| word.not_yet(feature),
                ));
            }
        }
        Ok(())
    }

    fn said_nothing(&self) -> bool {
        self.delay.is_none()
            && self.distribution.is_none()
            && self.loss.is_none()
            && self.order.is_none()
            && self.limit.is_none()
    }

    fn delay_arguments(&mut self) -> Result<(Duration, Option<Duration>), ParseError> {
        let delay = time(self.argument())?;
        let Some(word) = self.words.next_if(|word| word.starts_a_number()) else {
            return Ok((delay, None));
        };
        let jitter = time(word)?;
        match self.words.next_if(|word| word.starts_a_number()) {
            Some(word) => Err(word.not_yet("correlated delay")),
            None => Ok((delay, Some(jitter))),
        }
    }

    fn shape(&mut self) -> Result<Shape, ParseError> {
        let word = self.argument();
        match word.text {
            "uniform" => Ok(Shape::Uniform),
            "normal" => Ok(Shape::Normal),
            "pareto" | "paretonormal" | "experimental" => {
                Err(word.not_yet("this delay distribution"))
            }
            _ => Err(word.expected("uniform or normal")),
        }
    }

    fn loss_arguments(&mut self) -> Result<Loss, ParseError> {
        let mut word = self.argument();
        match word.text {
            "random" => word = self.argument(),
            "state" => return Err(word.not_yet("the four-state loss model")),
            "gemodel" => return Err(word.not_yet("the Gilbert-Elliott loss model")),
            _ => {}
        }
        let probability = percentage(word)?;
        match self.words.next_if(|word| word.starts_a_number()) {
            Some(word) => Err(word.not_yet("correlated loss")),
            None => Ok(Loss::Independent { probability }),
        }
    }

    fn order_argument(&mut self) -> Result<Order, ParseError> {
        let word = self.argument();
        match word.text {
            "fifo" => Ok(Order::Fifo),
            "free" => Ok(Order::Free),
            _ => Err(word.expected("fifo or free")),
        }
    }

    fn finish(self) -> Result<LinkConfig, ParseError> {
        let delay = match (self.delay, self.distribution) {
            (Some((mean, Some(jitter))), Some((_, Shape::Normal))) => Delay::Normal {
                mean,
                sigma: jitter,
            },
            (Some((mean, Some(jitter))), _) => Delay::Uniform {
                mean,
                half_width: jitter,
            },
            (_, Some((word, _))) => {
                return Err(word.expected("delay with a jitter beside a distribution"));
            }
            (Some((delay, None)), None) => Delay::Constant { delay },
            (None, None) => Delay::default(),
        };
        Ok(LinkConfig {
            delay,
            order: self.order.unwrap_or_default(),
            loss: self.loss.unwrap_or_default(),
            limit: self.limit.unwrap_or(LIMIT_DEFAULT),
        })
    }
}

fn split(text: &str) -> Vec<Word<'_>> {
    let mut column = 1;
    let mut words = Vec::new();
    for piece in text.split(char::is_whitespace) {
        if !piece.is_empty() {
            words.push(Word {
                text: piece,
                column,
            });
        }
        // the piece and the one white character that ends it
        column += piece.chars().count() + 1;
    }
    words
}

fn once<T>(slot: &mut Option<T>, value: T, word: Word<'_>) -> Result<(), ParseError> {
    match slot.replace(value) {
        Some(_) => Err(word.wrong(Reason::Repeated)),
        None => Ok(()),
    }
}

/// Digits with at most one point: no sign, no exponent, no `inf`.
fn decimal(text: &str) -> Option<f64> {
    let plain = text.chars().all(|c| c.is_ascii_digit() || c == '.');
    plain.then(|| text.parse().ok()).flatten()
}

fn time(word: Word<'_>) -> Result<Duration, ParseError> {
    let unit_at = word
        .text
        .find(|c: char| c.is_alphabetic())
        .unwrap_or(word.text.len());
    let (number, unit) = word.text.split_at(unit_at);
    let number = decimal(number).ok_or_else(|| word.expected(A_TIME))?;
    let nanos_per_unit = match unit.to_ascii_lowercase().as_str() {
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
        let range = format!("{DELAY_MAX:?} at most");
        return Err(word.wrong(Reason::OutOfRange { range }));
    }
    Ok(time)
}

fn percentage(word: Word<'_>) -> Result<Probability, ParseError> {
    let number = word.text.strip_suffix('%').unwrap_or(word.text);
    let percent = decimal(number).ok_or_else(|| word.expected(A_PERCENTAGE))?;
    match Probability::from_percent(percent) {
        Some(probability) if percent == 0.0 || probability > Probability::ZERO => Ok(probability),
        _ => Err(word.wrong(Reason::OutOfRange {
            range: "0%, or 0.0000001% to 100%".to_owned(),
        })),
    }
}

fn limit(word: Word<'_>) -> Result<u32, ParseError> {
    let digits = !word.text.is_empty() && word.text.chars().all(|c| c.is_ascii_digit());
    if !digits {
        return Err(word.expected("a number of packets, such as 10000"));
    }
    match word.text.parse() {
        Ok(limit) if (1..=LIMIT_MAX).contains(&limit) => Ok(limit),
        _ => Err(word.wrong(Reason::OutOfRange {
            range: format!("1 to {LIMIT_MAX} packets"),
        })),
    }
}
