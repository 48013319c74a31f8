//! A word and where it stands.

use super::error::{ParseError, Reason};

/// A word of a text.
#[derive(Clone, Copy, Debug)]
pub(super) struct Word<'a> {
    pub(super) text: &'a str,
    pub(super) column: usize,
}

impl Word<'_> {
    pub(super) fn wrong(self, reason: Reason) -> ParseError {
        ParseError {
            word: self.text.to_owned(),
            column: self.column,
            reason,
        }
    }

    pub(super) fn expected(self, expected: &'static str) -> ParseError {
        self.wrong(Reason::Expected { expected })
    }

    pub(super) fn not_yet(self, feature: &'static str) -> ParseError {
        self.wrong(Reason::NotSupportedYet { feature })
    }

    pub(super) fn starts_a_number(self) -> bool {
        self.text
            .starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
    }
}
