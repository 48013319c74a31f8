//! What a target made of an input.

use std::fmt::{self, Display, Write as _};

/// What a target made of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// Whether the decoder took it.
    pub accepted: bool,
    /// What sort of thing it was, or why it was refused: an input with a mark that no other had is mutated further.
    pub mark: u64,
}

impl Outcome {
    /// It was taken; `sort` tells sorts of inputs apart.
    #[must_use]
    pub fn taken(sort: u64) -> Self {
        Self {
            accepted: true,
            mark: sort.wrapping_mul(2),
        }
    }

    /// It was refused for this reason; what stands between quotes in it does not count.
    #[must_use]
    pub fn refused(why: &dyn Display) -> Self {
        Self {
            accepted: false,
            mark: mark(why) | 1,
        }
    }

    /// What becomes of a result whose value was judged already.
    pub(super) fn of<T>(result: Result<T, impl Display>) -> Self {
        match result {
            Ok(_) => Self::taken(0),
            Err(why) => Self::refused(&why),
        }
    }
}

/// Hashes the letters of a text outside of quotes, the first 64 of them, without memory.
pub(super) struct Letters {
    hash: u64,
    pub(super) left: u32,
    quoted: bool,
}

impl fmt::Write for Letters {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            if matches!(byte, b'"' | b'`' | b'\'') {
                self.quoted = !self.quoted;
            }
            if !self.quoted && byte.is_ascii_alphabetic() {
                if self.left == 0 {
                    return Ok(());
                }
                self.left -= 1;
                // FNV-1a
                self.hash = (self.hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        }
        Ok(())
    }
}

pub(super) fn mark(why: &dyn Display) -> u64 {
    let mut letters = Letters {
        hash: 0xcbf2_9ce4_8422_2325,
        left: 64,
        quoted: false,
    };
    // hashing cannot fail, and what fails to show itself has no letters
    let _ = write!(letters, "{why}");
    letters.hash
}
