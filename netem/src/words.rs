//! The words in which people write a link down: those of `tc netem`, and some of our own beside them.
//!
//! The arithmetic behind the words is our own; `docs/netem.md` lists where it differs from tc's. What tc
//! knows and this crate does not is an error of its own, never ignored. No file is read here:
//! whoever may read files hands over a function that does.

use std::iter::Peekable;
use std::str::FromStr;
use std::time::Duration;

mod draft;
mod error;
mod loss;
mod number;
mod print;
mod sentence;
#[cfg(test)]
mod tests;
mod word;

pub use error::{ParseError, Reason};

use crate::config::{LINKS_MAX, LinkConfig, Profile, STEPS_MAX, Shape, Step};
use draft::Draft;
use number::time;
use word::Word;

const A_WORD: &str = "delay, loss, outage, order, reorder, duplicate, corrupt, mtu, rate, queue, codel, \
                      cross, slot, ecn, limit, trace, seed, preset or none";

/// The distributions by name, but for tables.
const SHAPES: [(&str, Shape); 6] = [
    ("uniform", Shape::Uniform),
    ("normal", Shape::Normal),
    ("pareto", Shape::Pareto),
    ("paretonormal", Shape::ParetoNormal),
    ("lognormal", Shape::LogNormal),
    ("gamma", Shape::Gamma),
];

/// Reads the text of a file by the name that the words give it, or returns why it cannot.
pub type ReadFile<'a> = dyn FnMut(&str) -> Result<String, String> + 'a;

/// Settings from words that may name files.
///
/// # Errors
/// The first word that is wrong, or a file that is.
pub fn parse<'r>(text: &str, read: &'r mut ReadFile<'r>) -> Result<LinkConfig, ParseError> {
    Parser::new(text, read).link()
}

impl FromStr for LinkConfig {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        parse(text, &mut |_| {
            Err("files can be named on the command line only".to_owned())
        })
    }
}

impl TryFrom<String> for LinkConfig {
    type Error = ParseError;

    fn try_from(text: String) -> Result<Self, ParseError> {
        text.parse()
    }
}

struct Parser<'a, 'r> {
    words: Peekable<std::vec::IntoIter<Word<'a>>>,
    end: Word<'a>,
    /// The links of the chain begun so far.
    links: usize,
    read: &'r mut ReadFile<'r>,
}

impl<'a, 'r> Parser<'a, 'r> {
    fn new(text: &'a str, read: &'r mut ReadFile<'r>) -> Self {
        let end = Word {
            text: "",
            column: text.chars().count().saturating_add(1),
        };
        Self {
            words: split(text).into_iter().peekable(),
            end,
            links: 0,
            read,
        }
    }

    /// The next word, or the end of the text as an empty one.
    fn argument(&mut self) -> Word<'a> {
        self.words.next().unwrap_or(self.end)
    }

    /// The next word if it is a number.
    fn number(&mut self) -> Option<Word<'a>> {
        self.words.next_if(|word| word.starts_a_number())
    }

    /// Whether the next word is this one; then it is taken.
    fn takes(&mut self, text: &str) -> bool {
        self.words.next_if(|word| word.text == text).is_some()
    }

    /// Everything: settings, what changes later, and the links behind.
    fn link(&mut self) -> Result<LinkConfig, ParseError> {
        self.links += 1;
        let mut config = self.settings()?;
        let mut profile = Profile::default();
        while let Some(semicolon) = self.words.next() {
            let word = self.argument();
            match word.text {
                "then" if self.links < LINKS_MAX => config.then = Some(Box::new(self.link()?)),
                "then" => return Err(word.expected("8 links in a chain at most")),
                "at" if profile.repeat.is_none() && profile.steps.len() < STEPS_MAX => {
                    self.step(&mut profile)?;
                }
                "loop" if profile.repeat.is_none() && !profile.steps.is_empty() => {
                    profile.repeat = Some(self.loop_time(&profile)?);
                }
                _ if profile.repeat.is_some() => {
                    return Err(semicolon.expected("nothing after the loop but `then`"));
                }
                "loop" => return Err(word.expected("at TIME before a loop")),
                _ => {
                    return Err(
                        word.expected("at TIME and settings, loop TIME, or then and a link")
                    );
                }
            }
        }
        config.profile = profile;
        Ok(config)
    }

    fn step(&mut self, profile: &mut Profile) -> Result<(), ParseError> {
        let word = self.argument();
        let at = time(word)?;
        if profile
            .steps
            .last()
            .is_some_and(|last| at < last.at + last.ramp)
        {
            return Err(word.expected("a time after the step before it and its ramp"));
        }
        let ramp = if self.takes("over") {
            time(self.argument())?
        } else {
            Duration::ZERO
        };
        let settings = self.settings()?;
        if settings.seed.is_some() {
            return Err(word.expected("steps without a seed: the first settings have it"));
        }
        profile.steps.push(Step { at, ramp, settings });
        Ok(())
    }

    fn loop_time(&mut self, profile: &Profile) -> Result<Duration, ParseError> {
        let word = self.argument();
        let repeat = time(word)?;
        match profile.steps.last() {
            Some(last) if repeat > last.at + last.ramp => Ok(repeat),
            _ => Err(word.expected("a time after the last step and its ramp")),
        }
    }

    /// The settings up to a semicolon or the end.
    fn settings(&mut self) -> Result<LinkConfig, ParseError> {
        let mut draft = Draft::default();
        while let Some(word) = self.words.next_if(|word| word.text != ";") {
            self.sentence(&mut draft, word)?;
        }
        draft.finish()
    }
}

/// Words with their columns; a semicolon is a word of its own.
fn split(text: &str) -> Vec<Word<'_>> {
    let mut column = 1;
    let mut words = Vec::new();
    for piece in text.split_inclusive(|c: char| c.is_whitespace() || c == ';') {
        let ends_in_semicolon = piece.ends_with(';');
        let plain = piece.trim_end_matches(|c: char| c.is_whitespace() || c == ';');
        let length = plain.chars().count();
        if !plain.is_empty() {
            words.push(Word {
                text: plain,
                column,
            });
        }
        if ends_in_semicolon {
            words.push(Word {
                text: ";",
                column: column + length,
            });
        }
        column += piece.chars().count();
    }
    words
}
