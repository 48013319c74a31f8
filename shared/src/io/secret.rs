//! Where the two values of a pairing come from: the pin from a public key, the token from the system.

use ring::rand::{SecureRandom, SystemRandom};
use sha2::{Digest, Sha256};

use crate::pairing::{Pin, SECRET_BYTES, Token};
use crate::plug::PlugToken;

/// The operating system gave no random bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the operating system gave no random bytes: see whether getrandom(2) is forbidden here")]
pub struct NoRandomness;

impl Pin {
    /// The pin of a public key, given as `SubjectPublicKeyInfo` in DER.
    pub fn of_public_key(spki_der: &[u8]) -> Self {
        Self::new(Sha256::digest(spki_der).into())
    }
}

impl Token {
    /// A fresh token from the operating system's generator.
    ///
    /// # Errors
    /// The operating system gave no random bytes.
    pub fn generate() -> Result<Self, NoRandomness> {
        let mut bytes = [0; SECRET_BYTES];
        let filled = SystemRandom::new().fill(&mut bytes);
        filled.map(|()| Self::new(bytes)).map_err(|_| NoRandomness)
    }
}

impl PlugToken {
    /// A fresh token from the operating system's generator.
    ///
    /// # Errors
    /// The operating system gave no random bytes.
    pub fn generate() -> Result<Self, NoRandomness> {
        let mut bytes = [0; 16];
        let filled = SystemRandom::new().fill(&mut bytes);
        filled.map(|()| Self::new(bytes)).map_err(|_| NoRandomness)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pin_is_sha_256() {
        // FIPS 180-2, appendix B.1: SHA-256("abc")
        assert_eq!(
            Pin::of_public_key(b"abc").to_string(),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
    }

    #[test]
    fn a_token_is_never_given_twice_and_reads_back() {
        let token = Token::generate().unwrap();
        assert_ne!(token, Token::generate().unwrap());
        assert_eq!(token.reveal().to_string().parse(), Ok(token));
        let shown = token.reveal().to_string();
        assert!(!format!("{token:?}").contains(&shown[..8]));
    }
}
