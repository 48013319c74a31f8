//! What is wrong with a text that is no link, and what would have been right.

use std::fmt;

use mmt_shared::spelling;

/// A text that is no link: which word, where, and what would have been right.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}, column {column}: {reason}{}", Shown(.word), Meant(.word, .reason))]
pub struct ParseError {
    /// The word; empty if the text ended too early.
    pub word: String,
    /// Where the word begins, in characters from 1; one past the text if it ended too early.
    pub column: usize,
    /// What is wrong with it.
    pub reason: Reason,
}

/// What is wrong with a word.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Reason {
    /// Something else belongs here.
    #[error("expected {expected}")]
    Expected {
        /// What belongs here.
        expected: &'static str,
    },
    /// The number is not in its range.
    #[error("out of range: it must be {range}")]
    OutOfRange {
        /// The range.
        range: String,
    },
    /// The word was given before.
    #[error("given twice; once is enough")]
    Repeated,
    /// A file that the words name is of no use.
    #[error("{reason}")]
    File {
        /// Why.
        reason: String,
    },
    /// tc has this, this emulator does not yet.
    #[error("{feature}: tc knows this, this emulator does not support it yet")]
    NotSupportedYet {
        /// What the word asks for.
        feature: &'static str,
    },
}

impl ParseError {
    /// Two lines for a terminal: the text, and a caret line under the word.
    ///
    /// `text` is what was parsed; its control characters are shown as spaces.
    #[must_use]
    pub fn pointer(&self, text: &str) -> String {
        let shown: String = text
            .chars()
            .map(|c| if c.is_control() { ' ' } else { c })
            .collect();
        let indent = " ".repeat(self.column.saturating_sub(1));
        let carets = "^".repeat(self.word.chars().count().max(1));
        format!("{shown}\n{indent}{carets}")
    }
}

/// A word in an error message: quoted, escaped, at most 40 characters.
struct Shown<'a>(&'a str);

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return f.write_str("end of the text");
        }
        let head: String = self.0.chars().take(40).collect();
        let more = if head.len() < self.0.len() { "…" } else { "" };
        write!(f, "{head:?}{more}")
    }
}

/// Of the words that would have been right the one that this one nearly is.
struct Meant<'a>(&'a str, &'a Reason);

impl fmt::Display for Meant<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(wrong, Reason::Expected { expected }) = self else {
            return Ok(());
        };
        let words = expected.split(", ").flat_map(|words| words.split(" or "));
        match spelling::meant(wrong, words) {
            Some(meant) => write!(f, "; did you mean {meant}?"),
            None => Ok(()),
        }
    }
}
