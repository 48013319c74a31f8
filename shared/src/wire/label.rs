//! A short text that is safe to keep, to compare and to print.

use std::fmt;

use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::clean::clean;

/// The longest label, bytes of UTF-8.
pub const LABEL_MAX: usize = 64;

/// A text of at most [`LABEL_MAX`] bytes without control characters, [cleaned](clean) where it is shown, so that a peer's
/// name can neither fill a log nor steer a terminal.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Label {
    length: usize,
    bytes: [u8; LABEL_MAX],
}

impl Label {
    /// The longest label that `text` begins with; control characters become `?`.
    pub fn clipped(text: &str) -> Self {
        let mut label = Self {
            length: 0,
            bytes: [0; LABEL_MAX],
        };
        for c in text.chars() {
            if !label.push(if c.is_control() { '?' } else { c }) {
                break;
            }
        }
        label
    }

    /// `text` as it is, or none if it is too long or has control characters.
    pub fn exact(text: &str) -> Option<Self> {
        let label = Self::clipped(text);
        (label.as_str() == text).then_some(label)
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        let bytes = self.bytes.get(..self.length).unwrap_or_default();
        std::str::from_utf8(bytes).unwrap_or_default()
    }

    fn push(&mut self, c: char) -> bool {
        let end = self.length + c.len_utf8();
        let Some(room) = self.bytes.get_mut(self.length..end) else {
            return false;
        };
        c.encode_utf8(room);
        self.length = end;
        true
    }
}

impl fmt::Debug for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&clean(self.as_str()), f)
    }
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&clean(self.as_str()), f)
    }
}

impl Serialize for Label {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de> Deserialize<'de> for Label {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Text;
        impl Visitor<'_> for Text {
            type Value = Label;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "at most {LABEL_MAX} bytes without control characters")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Label, E> {
                Label::exact(text).ok_or_else(|| E::invalid_length(text.len(), &self))
            }
        }
        deserializer.deserialize_str(Text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_keeps_what_fits_and_never_splits_a_character() {
        assert_eq!(Label::clipped("mmt 0.1.0").as_str(), "mmt 0.1.0");
        let long = "é".repeat(40);
        assert_eq!(Label::clipped(&long).as_str(), "é".repeat(32));
        let odd = format!("a{long}");
        assert_eq!(Label::clipped(&odd).as_str().len(), 63);
        assert_eq!(Label::exact(&long), None);
    }

    #[test]
    fn a_label_never_steers_a_terminal() {
        assert_eq!(Label::clipped("a\x1b[2Jb\n").as_str(), "a?[2Jb?");
        assert_eq!(Label::exact("a\x1b[2J"), None);
        assert_eq!(Label::exact("a\u{9b}2J"), None);
        // on the wire it is a text like any other
        let turned = Label::exact("a\u{202e}b").unwrap();
        assert_eq!(format!("{turned} {turned:?}"), "a?b \"a?b\"");
    }
}
