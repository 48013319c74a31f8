//! The two 32-byte values of a pairing: the pin, which everybody may know, and the token, which nobody
//! else may.
//!
//! Both are written as 64 lower-case hexadecimal digits. The token must never appear in `Debug` or in an
//! error, and is compared in constant time.

use std::fmt;
use std::hint::black_box;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Length of pin and token, bytes.
pub const SECRET_BYTES: usize = 32;

/// Why a text is no pin and no token. It names the place, never the text, which could be a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HexError {
    /// Too short or too long.
    #[error("has {found} characters instead of 64: copy it whole")]
    WrongLength {
        /// How many characters there are.
        found: usize,
    },
    /// A character that is no hexadecimal digit.
    #[error(
        "has something else than 0-9 and a-f as hexadecimal character {position}: copy it again"
    )]
    NotHex {
        /// Which character, counted from 1.
        position: usize,
    },
}

/// SHA-256 of a `SubjectPublicKeyInfo` in DER (RFC 5280, section 4.1): names a key, whatever certificate
/// carries it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Pin([u8; SECRET_BYTES]);

impl Pin {
    /// A pin of these bytes.
    pub const fn new(bytes: [u8; SECRET_BYTES]) -> Self {
        Self(bytes)
    }
}

impl fmt::Display for Pin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&hex::encode(self.0))
    }
}

impl fmt::Debug for Pin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Pin({self})")
    }
}

impl FromStr for Pin {
    type Err = HexError;

    fn from_str(text: &str) -> Result<Self, HexError> {
        parse(text).map(Self)
    }
}

/// The secret that lets a master in. Compared in a time that does not depend on its bytes.
#[derive(Clone, Copy, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Token([u8; SECRET_BYTES]);

impl Token {
    /// A token of these bytes; they must come from the system's source of randomness.
    pub const fn new(bytes: [u8; SECRET_BYTES]) -> Self {
        Self(bytes)
    }

    /// The 64 hexadecimal digits: for the pairing string and the identity file only.
    pub fn reveal(&self) -> impl fmt::Display {
        hex::encode(self.0)
    }
}

impl PartialEq for Token {
    fn eq(&self, other: &Self) -> bool {
        let pairs = self.0.iter().zip(&other.0);
        let differing = pairs.fold(0, |bits, (a, b)| black_box(bits | (a ^ b)));
        black_box(differing) == 0
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(secret)")
    }
}

impl FromStr for Token {
    type Err = HexError;

    fn from_str(text: &str) -> Result<Self, HexError> {
        parse(text).map(Self)
    }
}

fn parse(digits: &str) -> Result<[u8; SECRET_BYTES], HexError> {
    let found = digits.chars().count();
    if found != 2 * SECRET_BYTES {
        return Err(HexError::WrongLength { found });
    }
    if let Some(before) = digits.chars().position(|c| !c.is_ascii_hexdigit()) {
        let position = before + 1;
        return Err(HexError::NotHex { position });
    }
    let mut bytes = [0; SECRET_BYTES];
    hex::decode_to_slice(digits, &mut bytes).map_err(|_| HexError::WrongLength { found })?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_are_equal_only_if_every_bit_is() {
        let token = Token::new([7; 32]);
        assert_eq!(token, Token::new([7; 32]));
        for byte in 0..32 {
            for bit in 0..8 {
                let mut other = [7; 32];
                other[byte] ^= 1 << bit;
                assert_ne!(token, Token::new(other));
            }
        }
    }

    #[test]
    fn text_that_is_no_pin_is_refused_with_what_is_wrong() {
        let refused = |text: &str| text.parse::<Pin>().unwrap_err();
        assert_eq!(refused(""), HexError::WrongLength { found: 0 });
        let long = "a".repeat(65);
        assert_eq!(refused(&long), HexError::WrongLength { found: 65 });
        assert_eq!(refused(&"g".repeat(64)), HexError::NotHex { position: 1 });
        assert_eq!(refused(&"ä".repeat(64)), HexError::NotHex { position: 1 });
        assert_eq!(
            refused(&"ä".repeat(32)),
            HexError::WrongLength { found: 32 }
        );
        let late = format!("{}x", "0".repeat(63));
        assert_eq!(refused(&late), HexError::NotHex { position: 64 });
    }
}
