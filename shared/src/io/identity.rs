//! The slave's identity: a self-signed Ed25519 certificate, its key and the tokens, and their text form.
//!
//! Ed25519 because its signatures have one size and are deterministic. The text holds secrets: only
//! `identity_file` writes it.

use std::time::SystemTime;

use ring::hmac;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{
    CertificateDer, PrivateKeyDer, PrivatePkcs8KeyDer, SubjectPublicKeyInfoDer,
};
use rustls::server::ParsedCertificate;

use super::identity_file::kept::Kept;
use super::secret::NoRandomness;
use crate::pairing::{Created, Pin, TOKEN_LINE, Token, Tokens, TokensError};

/// Name that the certificate carries; nobody checks it, the pin is what counts.
const CERTIFICATE_NAME: &str = "mmt-slave";
const PREAMBLE: &str =
    "The identity of an mmt slave: whoever can read this file can pose as it and operate it.";

/// Why no identity could be made.
#[derive(Debug, thiserror::Error)]
pub enum GenerateError {
    /// The key or the certificate could not be made.
    #[error("cannot make a key and a certificate: {0}")]
    Certificate(#[from] rcgen::Error),
    /// No random bytes.
    #[error(transparent)]
    NoRandomness(#[from] NoRandomness),
}

/// Why a text is no identity.
#[derive(Debug, thiserror::Error)]
pub enum ParseError {
    /// A part that cannot be read.
    #[error("its {part} is missing or unreadable ({why})")]
    Unreadable {
        /// Which part.
        part: &'static str,
        /// Why.
        why: String,
    },
    /// The tokens are none.
    #[error(transparent)]
    Tokens(#[from] TokensError),
    /// Certificate and key are not of one pair.
    #[error("its certificate belongs to another key")]
    Mismatch,
}

/// A key, the certificate that carries it, and the tokens.
#[derive(Debug)]
pub struct Identity {
    key: PrivatePkcs8KeyDer<'static>,
    certificate: CertificateDer<'static>,
    pin: Pin,
    tokens: Tokens,
    /// Where it is kept, if it is.
    kept: Option<Kept>,
}

impl Identity {
    /// A fresh identity that is kept nowhere: for demos and tests.
    ///
    /// # Errors
    /// The key could not be made, or there are no random bytes.
    pub fn ephemeral() -> Result<Self, GenerateError> {
        Self::generate().map(|(identity, _)| identity)
    }

    /// A fresh identity and its text.
    ///
    /// # Errors
    /// As [`Identity::ephemeral`].
    pub fn generate() -> Result<(Self, String), GenerateError> {
        let pair = rcgen::KeyPair::generate_for(&rcgen::PKCS_ED25519)?;
        let parameters = rcgen::CertificateParams::new(vec![CERTIFICATE_NAME.to_owned()])?;
        let certificate = parameters.self_signed(&pair)?;
        let tokens = Tokens::first(Token::generate()?, created_now());
        let text = format!(
            "{PREAMBLE}\n{}{}{}",
            tokens.reveal(),
            pair.serialize_pem(),
            certificate.pem(),
        );
        let identity = Self {
            pin: Pin::of_public_key(&rcgen::PublicKeyData::subject_public_key_info(&pair)),
            certificate: certificate.der().clone(),
            key: pair.into(),
            tokens,
            kept: None,
        };
        Ok((identity, text))
    }

    /// An identity from its text.
    ///
    /// # Errors
    /// Which part of it is missing, unreadable or another's.
    pub fn parse(text: &str) -> Result<Self, ParseError> {
        let unreadable = |part, why: String| ParseError::Unreadable { part, why };
        let tokens = Tokens::read(text)?;
        let key = PrivatePkcs8KeyDer::from_pem_slice(text.as_bytes())
            .map_err(|error| unreadable("private key", error.to_string()))?;
        let certificate = CertificateDer::from_pem_slice(text.as_bytes())
            .map_err(|error| unreadable("certificate", error.to_string()))?;
        let pair = rcgen::KeyPair::from_pkcs8_der_and_sign_algo(&key, &rcgen::PKCS_ED25519)
            .map_err(|error| unreadable("private key", error.to_string()))?;
        let public_key = public_key_of(&certificate)
            .map_err(|error| unreadable("certificate", error.to_string()))?;
        if *public_key != *rcgen::PublicKeyData::subject_public_key_info(&pair) {
            return Err(ParseError::Mismatch);
        }
        Ok(Self {
            pin: Pin::of_public_key(&public_key),
            tokens,
            key,
            certificate,
            kept: None,
        })
    }

    /// The same, kept there.
    pub(super) fn kept_in(mut self, kept: Kept) -> Self {
        self.kept = Some(kept);
        self
    }

    /// Where it is kept, if it is.
    pub(super) fn kept(&self) -> Option<&Kept> {
        self.kept.as_ref()
    }

    /// What a master pins.
    pub fn pin(&self) -> Pin {
        self.pin
    }

    /// What masters prove themselves with.
    pub fn tokens(&self) -> &Tokens {
        &self.tokens
    }

    /// The certificate, for the handshake.
    pub fn certificate(&self) -> CertificateDer<'static> {
        self.certificate.clone()
    }

    /// The private key, for the handshake.
    pub fn key(&self) -> PrivateKeyDer<'static> {
        PrivateKeyDer::Pkcs8(self.key.clone_key())
    }

    /// A key for `purpose`, the same in every process with this identity; it shows nothing of the
    /// private key that it comes from (HMAC-SHA-256, RFC 2104).
    pub fn derive(&self, purpose: &str) -> [u8; 32] {
        let key = hmac::Key::new(hmac::HMAC_SHA256, self.key.secret_pkcs8_der());
        let tag = hmac::sign(&key, purpose.as_bytes());
        let mut derived = [0; 32];
        for (to, from) in derived.iter_mut().zip(tag.as_ref()) {
            *to = *from;
        }
        derived
    }
}

/// This moment, for a token that is made now. A host whose clock stands before 1970 makes its tokens in 1970.
pub(super) fn created_now() -> Created {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    Created::at(since.unwrap_or_default().as_secs())
}

/// The text of an identity with these tokens in the place of its own; all else stays as it is.
pub(super) fn with_tokens(text: &str, tokens: &Tokens) -> String {
    let others = text.lines().filter(|line| !line.starts_with(TOKEN_LINE));
    let (mut all, mut lines) = (String::new(), tokens.reveal());
    for line in others {
        if line.starts_with("-----BEGIN") {
            all.push_str(&std::mem::take(&mut lines));
        }
        all.push_str(line);
        all.push('\n');
    }
    all
}

/// The public key in a certificate, as `SubjectPublicKeyInfo` in DER.
///
/// # Errors
/// The certificate is malformed.
pub fn public_key_of(
    certificate: &CertificateDer<'_>,
) -> Result<SubjectPublicKeyInfoDer<'static>, rustls::Error> {
    ParsedCertificate::try_from(certificate).map(|parsed| parsed.subject_public_key_info())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse_error(text: &str) -> String {
        Identity::parse(text).unwrap_err().to_string()
    }

    #[test]
    fn an_identity_survives_the_round_trip_through_text() {
        let (made, text) = Identity::generate().unwrap();
        let read = Identity::parse(&text).unwrap();
        assert_eq!(read.pin(), made.pin());
        assert_eq!(read.key(), made.key());
        assert_eq!(read.certificate(), made.certificate());
        assert_eq!(read.tokens(), made.tokens());
        assert_eq!(read.derive("a"), made.derive("a"));
    }

    #[test]
    fn the_pin_is_that_of_the_key_in_the_certificate() {
        let identity = Identity::ephemeral().unwrap();
        let public_key = public_key_of(&identity.certificate()).unwrap();
        assert_eq!(identity.pin(), Pin::of_public_key(&public_key));
        // RFC 8410: an Ed25519 SubjectPublicKeyInfo is 12 bytes of header and 32 of key
        assert_eq!(public_key.len(), 44);
    }

    #[test]
    fn two_identities_share_nothing() {
        let (a, b) = (
            Identity::ephemeral().unwrap(),
            Identity::ephemeral().unwrap(),
        );
        assert_ne!(a.pin(), b.pin());
        assert_ne!(a.tokens(), b.tokens());
        assert_ne!(a.derive("reset"), b.derive("reset"));
        assert_ne!(a.derive("reset"), a.derive("connection id"));
    }

    #[test]
    fn text_with_a_part_missing_or_foreign_is_refused_by_name_of_the_part() {
        let (_, text) = Identity::generate().unwrap();
        let (_, other) = Identity::generate().unwrap();
        assert!(parse_error("").contains("private key"));
        assert!(parse_error(&text.replace("PRIVATE", "PUBLIC")).contains("private key"));
        assert!(parse_error(&text.replace("CERTIFICATE", "SOMETHING")).contains("certificate"));
        let (mine, theirs) = (text.find("-----BEGIN CERT"), other.find("-----BEGIN CERT"));
        let mixed = format!("{}{}", &text[..mine.unwrap()], &other[theirs.unwrap()..]);
        assert!(parse_error(&mixed).contains("another key"));
        let (token, key) = (text.find("token: ").unwrap(), text.find("-----").unwrap());
        let mut bad_token = text.clone();
        bad_token.replace_range(token..key, &format!("token: {}\n", "z".repeat(64)));
        assert!(parse_error(&bad_token).contains("hexadecimal"));
    }

    #[test]
    fn other_tokens_leave_key_and_certificate_as_they_are() {
        let (made, text) = Identity::generate().unwrap();
        let nobody = Identity::parse(&with_tokens(&text, &Tokens::default())).unwrap();
        assert_eq!(nobody.tokens(), &Tokens::default());
        assert_eq!((nobody.pin(), nobody.key()), (made.pin(), made.key()));
        let theirs = Tokens::first(Token::new([5; 32]), Created::at(0));
        let again = Identity::parse(&with_tokens(&text, &theirs)).unwrap();
        assert_eq!(again.tokens(), &theirs);
        assert_eq!(with_tokens(&text, made.tokens()), text);
    }
}
