//! What is wrong with a text in TOML and where: line, column and a caret below the place.

use std::fmt;
use std::ops::Range;

use mmt_shared::spelling;

/// Why a plan or a configuration cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct TextError {
    what: String,
    place: Option<Location>,
    /// The option to blame, where it is not the text.
    option: Option<&'static str>,
}

/// A place in the text.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Location {
    /// From 1.
    line: usize,
    /// Characters of the line before the place.
    before: usize,
    /// Characters marked, at least 1.
    marked: usize,
    content: String,
}

impl TextError {
    /// What is wrong at the bytes `span` of the text. A span beyond the text is no place of it.
    pub(crate) fn at(text: &str, span: Option<Range<usize>>, what: impl fmt::Display) -> Self {
        Self {
            what: what.to_string().trim_end().to_owned(),
            place: span.and_then(|span| Location::of(text, &span)),
            option: None,
        }
    }

    /// The same, of the reader of TOML; where it is a wrong word, with the word that was meant.
    #[must_use]
    pub fn of(text: &str, error: &toml::de::Error) -> Self {
        let message = error.message();
        match meant(message) {
            Some(meant) => Self::at(
                text,
                error.span(),
                format_args!("{message}; did you mean `{meant}`?"),
            ),
            None => Self::at(text, error.span(), message),
        }
    }

    /// The same, where an option is to blame: the place, if there is one, is in the file that the option names.
    #[must_use]
    pub(crate) fn of_option(mut self, name: &'static str) -> Self {
        self.option = Some(name);
        self
    }

    /// The option to blame; none where it is the text itself.
    #[must_use]
    pub fn option(&self) -> Option<&'static str> {
        self.option
    }

    /// Adds what was being looked at.
    #[must_use]
    pub(crate) fn context(mut self, context: &str) -> Self {
        if !context.is_empty() {
            self.what += &format!(" ({context})");
        }
        self
    }
}

/// Of the words that the reader names the first one, which is wrong, is closest to.
fn meant(message: &str) -> Option<&str> {
    let mut words = message.split('`').skip(1).step_by(2);
    let wrong = words.next().filter(|_| message.starts_with("unknown "))?;
    spelling::meant(wrong, words)
}

impl Location {
    fn of(text: &str, span: &Range<usize>) -> Option<Self> {
        if span.start > text.len() {
            return None;
        }
        let head = text.get(..span.start)?;
        let begins = head.rfind('\n').map_or(0, |at| at + 1);
        let content = text.get(begins..)?.lines().next().unwrap_or_default();
        let before = text.get(begins..span.start)?.chars().count();
        let left = content.chars().count().saturating_sub(before);
        let marked = text
            .get(span.clone())
            .map_or(1, |marked| marked.chars().count());
        Some(Self {
            line: head.matches('\n').count() + 1,
            before,
            marked: marked.min(left).max(1),
            content: content.to_owned(),
        })
    }
}

impl fmt::Display for TextError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(place) = &self.place else {
            return f.write_str(&self.what);
        };
        let margin = " ".repeat(place.line.to_string().len());
        let (blank, caret) = (" ".repeat(place.before), "^".repeat(place.marked));
        writeln!(f, "line {}, column {}", place.line, place.before + 1)?;
        writeln!(f, "{margin} |")?;
        writeln!(f, "{} | {}", place.line, place.content)?;
        writeln!(f, "{margin} | {blank}{caret}")?;
        f.write_str(&self.what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_that_is_nearly_right_is_answered_with_the_one_that_was_meant() {
        let message = "unknown field `mas_kg`, expected one of `side_m`, `mass_kg`, `wall`";
        assert_eq!(meant(message), Some("mass_kg"));
        assert_eq!(
            meant("unknown variant `papr`, expected `paper` or `recommended`"),
            Some("paper")
        );
        assert_eq!(meant("unknown field `colour`, expected `mass_kg`"), None);
        assert_eq!(meant("invalid type: `a`, expected `b`"), None);
    }
}
