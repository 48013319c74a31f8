//! The words of a recording, one after the other, each with its place in the text.
//!
//! Every number is checked here: finite and in a range that keeps all later arithmetic finite.

/// Positions beyond this are not a table-top recording, mm.
const POSITION_MAX_MM: f64 = 1e5;
/// Forces beyond this are not a finger's, N.
const FORCE_MAX_N: f64 = 1e4;
/// Times beyond this are not seconds since 1970, s.
const TIME_MAX_S: f64 = 1e11;
/// How far the norm of a quaternion may be from 1.
const NORM_SLACK: f64 = 0.01;
/// How much of a wrong word is shown, characters.
const FOUND_MAX: usize = 24;

/// Why a text is not a recording of pushes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}, column {column}: {what} should be {expected}, found {found}")]
pub struct ParseError {
    /// Line, from 1.
    pub line: usize,
    /// Column, characters from 1.
    pub column: usize,
    /// What was being read.
    pub what: &'static str,
    /// What may stand there.
    pub expected: String,
    /// What stands there.
    pub found: String,
}

/// The words not yet read.
pub(super) struct Words<'a> {
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    line: &'a str,
    /// Bytes of `line` that have been read.
    read: usize,
    /// Location of the last word taken.
    place: Location<'a>,
    line_number: usize,
}

#[derive(Clone, Copy)]
struct Location<'a> {
    line: usize,
    column: usize,
    word: &'a str,
}

impl<'a> Words<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self {
            lines: text.lines().enumerate(),
            line: "",
            read: 0,
            place: Location {
                line: 1,
                column: 1,
                word: "",
            },
            line_number: 1,
        }
    }

    fn next(&mut self) -> Option<&'a str> {
        loop {
            let rest = self.line.get(self.read..).unwrap_or("");
            let gap = rest.len() - rest.trim_start().len();
            let start = self.read + gap;
            if let Some(word) = rest.split_whitespace().next() {
                self.read = start + word.len();
                let before = self.line.get(..start).unwrap_or("");
                self.place = Location {
                    line: self.line_number,
                    column: before.chars().count() + 1,
                    word,
                };
                return Some(word);
            }
            let Some((index, line)) = self.lines.next() else {
                self.place = Location {
                    line: self.line_number,
                    column: self.line.chars().count() + 1,
                    word: "",
                };
                return None;
            };
            (self.line, self.read, self.line_number) = (line, 0, index + 1);
        }
    }

    /// An error at the last word taken.
    fn error(&self, what: &'static str, expected: String) -> ParseError {
        let Location { line, column, word } = self.place;
        let found = if word.is_empty() {
            "the end of the text".to_owned()
        } else {
            let shown: String = word.chars().take(FOUND_MAX).collect();
            format!("{shown:?}")
        };
        ParseError {
            line,
            column,
            what,
            expected,
            found,
        }
    }

    fn number(&mut self, what: &'static str, unit: &str, limit: f64) -> Result<f64, ParseError> {
        let value = self.next().and_then(|word| word.parse::<f64>().ok());
        match value {
            // A NaN fails this comparison.
            Some(value) if value.abs() <= limit => Ok(value),
            _ => Err(self.error(what, format!("a number from {} to {limit} {unit}", -limit))),
        }
    }

    pub(super) fn count(
        &mut self,
        what: &'static str,
        least: usize,
        most: usize,
    ) -> Result<usize, ParseError> {
        let value = self.next().and_then(|word| word.parse::<usize>().ok());
        match value {
            Some(value) if (least..=most).contains(&value) => Ok(value),
            _ => Err(self.error(what, format!("a whole number from {least} to {most}"))),
        }
    }

    /// A length given in mm, in m.
    pub(super) fn millimetres(&mut self, what: &'static str) -> Result<f64, ParseError> {
        Ok(self.number(what, "mm", POSITION_MAX_MM)? * 1e-3)
    }

    pub(super) fn newtons(&mut self, what: &'static str) -> Result<f64, ParseError> {
        self.number(what, "N", FORCE_MAX_N)
    }

    /// A time in s, later than the one before.
    pub(super) fn time(&mut self, what: &'static str, last_s: f64) -> Result<f64, ParseError> {
        let t_s = self.number(what, "s", TIME_MAX_S)?;
        if t_s > last_s {
            Ok(t_s)
        } else {
            Err(self.error(what, format!("later than the sample before, {last_s} s")))
        }
    }

    /// A quaternion w x y z: its yaw, rad.
    pub(super) fn yaw(&mut self, what: &'static str) -> Result<f64, ParseError> {
        let mut part = || self.number(what, "(quaternion)", 1.0 + NORM_SLACK);
        let (w, x, y, z) = (part()?, part()?, part()?, part()?);
        let norm = (w * w + x * x + y * y + z * z).sqrt();
        if (norm - 1.0).abs() > NORM_SLACK {
            return Err(self.error(
                what,
                format!("the end of a quaternion of norm 1 (its norm is {norm:.3})"),
            ));
        }
        Ok(libm::atan2(
            2.0 * (w * z + x * y),
            1.0 - 2.0 * (y * y + z * z),
        ))
    }

    /// Nothing but white space may follow.
    pub(super) fn end(&mut self) -> Result<(), ParseError> {
        match self.next() {
            None => Ok(()),
            Some(_) => Err(self.error(
                "what follows the last push",
                "nothing (is the first number that of the pushes?)".to_owned(),
            )),
        }
    }
}
