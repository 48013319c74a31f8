//! What is wrong with a plan and where: line, column and a caret below the place.

use std::fmt;
use std::ops::Range;

/// Why a plan cannot be carried out.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct PlanError {
    what: String,
    place: Option<Place>,
}

/// A place in the plan's text.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Place {
    /// From 1.
    line: usize,
    /// Characters of the line before the place.
    before: usize,
    /// Characters marked, at least 1.
    marked: usize,
    content: String,
}

impl PlanError {
    /// What is wrong at the bytes `span` of the plan's text. A span beyond the text is no place of the plan.
    pub(super) fn at(text: &str, span: Option<Range<usize>>, what: impl fmt::Display) -> Self {
        Self {
            what: what.to_string().trim_end().to_owned(),
            place: span.and_then(|span| Place::of(text, &span)),
        }
    }

    /// The same, of the reader of TOML.
    pub(super) fn of(text: &str, error: &toml::de::Error) -> Self {
        Self::at(text, error.span(), error.message())
    }

    /// Adds what was being looked at.
    #[must_use]
    pub(super) fn context(mut self, context: &str) -> Self {
        if !context.is_empty() {
            self.what += &format!(" ({context})");
        }
        self
    }
}

impl Place {
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

impl fmt::Display for PlanError {
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
