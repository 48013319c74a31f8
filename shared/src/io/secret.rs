//! The two 32-byte values of a pairing: the pin, which everybody may know, and the token, which nobody
//! else may.
//!
//! Both are written as 64 lower-case hexadecimal digits. The token never appears in `Debug` and is compared
//! in constant time.

use std::fmt;
use std::str::FromStr;

use ring::rand::{SecureRandom, SystemRandom};
use sha2::{Digest, Sha256};
use subtle::ConstantTimeEq;

/// Why a text is no pin and no token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HexError {
    /// Too short or too long.
    #[error("has {got} characters, but 64 hexadecimal digits are needed: copy it whole")]
    Length {
        /// Characters that the text has.
        got: usize,
    },
    /// A character that is no hexadecimal digit.
    #[error("has {got:?} where a hexadecimal digit is needed: copy it unchanged")]
    Digit {
        /// The first such character.
        got: char,
    },
}

/// The operating system gave no random bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the operating system gave no random bytes: see whether getrandom(2) is forbidden here")]
pub struct NoRandomness;

/// SHA-256 of a `SubjectPublicKeyInfo` in DER (RFC 5280, section 4.1): names a key, whatever certificate
/// carries it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Pin([u8; 32]);

impl Pin {
    /// The pin of a public key, given as `SubjectPublicKeyInfo` in DER.
    #[must_use]
    pub fn of_public_key(spki_der: &[u8]) -> Self {
        Self(Sha256::digest(spki_der).into())
    }

    /// A pin from its bytes, as a pairing string carries it.
    #[must_use]
    pub const fn from_bytes(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    /// The bytes.
    #[must_use]
    pub const fn bytes(&self) -> [u8; 32] {
        self.0
    }
}

impl fmt::Display for Pin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_hex(f, &self.0)
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
        parse_hex(text).map(Self)
    }
}

/// The secret by which a master proves to a slave that it may operate it.
#[derive(Clone)]
pub struct Token([u8; 32]);

impl Token {
    /// A fresh token from the operating system's generator.
    ///
    /// # Errors
    /// The operating system gave no random bytes.
    pub fn generate() -> Result<Self, NoRandomness> {
        let mut bytes = [0; 32];
        let filled = SystemRandom::new().fill(&mut bytes);
        filled.map(|()| Self(bytes)).map_err(|_| NoRandomness)
    }

    /// A token from its bytes, as a hello carries it.
    #[must_use]
    pub fn from_bytes(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    /// The bytes, for the hello.
    #[must_use]
    pub fn bytes(&self) -> [u8; 32] {
        self.0
    }

    /// Whether `offered` is this token, in a time that does not tell where they differ.
    #[must_use]
    pub fn matches(&self, offered: &[u8; 32]) -> bool {
        self.0.ct_eq(offered).into()
    }

    /// The 64 hexadecimal digits. It is a secret: for the pairing string and the identity file only.
    #[must_use]
    pub fn reveal(&self) -> String {
        Hex(&self.0).to_string()
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(hidden)")
    }
}

impl FromStr for Token {
    type Err = HexError;
    fn from_str(text: &str) -> Result<Self, HexError> {
        parse_hex(text).map(Self)
    }
}

struct Hex<'a>(&'a [u8; 32]);

impl fmt::Display for Hex<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_hex(f, self.0)
    }
}

fn write_hex(f: &mut fmt::Formatter<'_>, bytes: &[u8; 32]) -> fmt::Result {
    bytes.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
}

fn parse_hex(text: &str) -> Result<[u8; 32], HexError> {
    let got = text.chars().count();
    if got != 64 {
        return Err(HexError::Length { got });
    }
    let mut bytes = [0u8; 32];
    for (index, character) in text.chars().enumerate() {
        let digit = character
            .to_digit(16)
            .ok_or(HexError::Digit { got: character })?;
        if let Some(byte) = bytes.get_mut(index / 2) {
            // a digit is below 16
            *byte = (*byte << 4) | digit as u8;
        }
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pin_and_token_survive_the_round_trip_through_text() {
        let pin = Pin::of_public_key(b"a key");
        assert_eq!(pin.to_string().parse::<Pin>(), Ok(pin));
        let token = Token::generate().unwrap();
        let back: Token = token.reveal().parse().unwrap();
        assert!(token.matches(&back.bytes()));
    }

    #[test]
    fn the_pin_is_sha_256() {
        // FIPS 180-2, appendix B.1: SHA-256("abc")
        assert_eq!(
            Pin::of_public_key(b"abc").to_string(),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
    }

    #[test]
    fn a_token_matches_itself_alone() {
        let token = Token::generate().unwrap();
        let mut other = token.bytes();
        assert!(token.matches(&other));
        for index in 0..32 {
            other[index] ^= 1;
            assert!(!token.matches(&other));
            other[index] ^= 1;
        }
        assert!(!token.matches(&Token::generate().unwrap().bytes()));
    }

    #[test]
    fn debug_does_not_show_the_token() {
        let token = Token::generate().unwrap();
        assert!(!format!("{token:?}").contains(&token.reveal()[..8]));
    }

    #[test]
    fn text_that_is_no_pin_is_refused_with_what_is_wrong() {
        let refused = |text: &str| text.parse::<Pin>().unwrap_err();
        assert_eq!(refused(""), HexError::Length { got: 0 });
        assert_eq!(refused(&"a".repeat(63)), HexError::Length { got: 63 });
        assert_eq!(refused(&"a".repeat(65)), HexError::Length { got: 65 });
        assert_eq!(refused(&"g".repeat(64)), HexError::Digit { got: 'g' });
        assert_eq!(refused(&"ä".repeat(64)), HexError::Digit { got: 'ä' });
        assert_eq!(refused(&"ä".repeat(32)), HexError::Length { got: 32 });
    }
}
