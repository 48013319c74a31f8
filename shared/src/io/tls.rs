//! TLS 1.3 for both sides: a pinned key in place of certificate authorities, no tickets, no 0-RTT.
//!
//! The cryptography provider is named in each configuration; no process-wide default is set or used.

use std::sync::{Arc, OnceLock};

use quinn::crypto::rustls::{NoInitialCipherSuite, QuicClientConfig, QuicServerConfig};
use rustls::client::Resumption;
use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::crypto::{CryptoProvider, WebPkiSupportedAlgorithms, ring, verify_tls13_signature};
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::server::NoServerSessionStorage;
use rustls::{
    CertificateError, DigitallySignedStruct, Error, PeerIncompatible, SignatureScheme, version,
};

use super::identity::{Identity, public_key_of};
use crate::pairing::Pin;
use crate::wire::ALPN;

/// Why a TLS configuration could not be made.
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// The certificate, the key or the protocol versions do not fit the provider.
    #[error("TLS refuses the identity: {0}; delete the identity file and pair again")]
    Identity(#[from] Error),
    /// The provider lacks the suite that QUIC needs.
    #[error("the cryptography provider lacks TLS13_AES_128_GCM_SHA256, which QUIC version 1 needs")]
    NoInitialSuite(#[from] NoInitialCipherSuite),
}

/// The slave's side: proves `identity`, asks no certificate of the master. It refuses a master that does not offer
/// [`ALPN`] with the TLS alert `no_application_protocol` (RFC 7301, section 3.2).
///
/// # Errors
/// The identity's key does not fit its certificate.
pub fn server(identity: &Identity) -> Result<QuicServerConfig, TlsError> {
    let mut config = rustls::ServerConfig::builder_with_provider(provider())
        .with_protocol_versions(&[&version::TLS13])?
        .with_no_client_auth()
        .with_single_cert(vec![identity.certificate()], identity.key())?;
    config.alpn_protocols = vec![ALPN.into()];
    config.max_early_data_size = 0;
    config.send_tls13_tickets = 0;
    config.session_storage = Arc::new(NoServerSessionStorage {});
    Ok(config.try_into()?)
}

/// The master's side: trusts the key of `verifier`'s pin and nothing else.
///
/// # Errors
/// The provider has no TLS 1.3.
pub fn client(verifier: Arc<PinVerifier>) -> Result<QuicClientConfig, TlsError> {
    client_as(verifier, ALPN)
}

pub(super) fn client_as(
    verifier: Arc<PinVerifier>,
    protocol: &str,
) -> Result<QuicClientConfig, TlsError> {
    let mut config = rustls::ClientConfig::builder_with_provider(provider())
        .with_protocol_versions(&[&version::TLS13])?
        .dangerous()
        .with_custom_certificate_verifier(verifier)
        .with_no_client_auth();
    config.alpn_protocols = vec![protocol.into()];
    config.enable_early_data = false;
    config.enable_sni = false;
    config.resumption = Resumption::disabled();
    Ok(config.try_into()?)
}

fn provider() -> Arc<CryptoProvider> {
    Arc::new(ring::default_provider())
}

/// Accepts a slave if and only if its key has the pin and it proves that it holds that key. Names, dates
/// and issuers in the certificate do not count.
#[derive(Debug)]
pub struct PinVerifier {
    pin: Pin,
    algorithms: WebPkiSupportedAlgorithms,
    /// The pin of the slave that answered, if it was another.
    refused: OnceLock<Pin>,
}

impl PinVerifier {
    /// A verifier for one connection attempt.
    pub fn new(pin: Pin) -> Self {
        Self {
            pin,
            algorithms: ring::default_provider().signature_verification_algorithms,
            refused: OnceLock::new(),
        }
    }

    /// The pin that was offered instead, if the attempt failed for that.
    pub fn refused(&self) -> Option<Pin> {
        self.refused.get().copied()
    }
}

impl ServerCertVerifier for PinVerifier {
    fn verify_server_cert(
        &self,
        end_entity: &CertificateDer<'_>,
        _intermediates: &[CertificateDer<'_>],
        _server_name: &ServerName<'_>,
        _ocsp_response: &[u8],
        _now: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        let offered = Pin::of_public_key(&public_key_of(end_entity)?);
        if offered == self.pin {
            return Ok(ServerCertVerified::assertion());
        }
        // Only the first counts; a verifier serves one attempt.
        let _ = self.refused.set(offered);
        Err(CertificateError::ApplicationVerificationFailure.into())
    }

    fn verify_tls12_signature(
        &self,
        _message: &[u8],
        _certificate: &CertificateDer<'_>,
        _signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        Err(PeerIncompatible::Tls13RequiredForQuic.into())
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        verify_tls13_signature(message, certificate, signature, &self.algorithms)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.algorithms.supported_schemes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(verifier: &PinVerifier, certificate: &CertificateDer<'_>) -> Result<(), Error> {
        verdict_in(0, verifier, certificate)
    }

    /// The same so many years after 1970.
    fn verdict_in(
        years: u64,
        verifier: &PinVerifier,
        certificate: &CertificateDer<'_>,
    ) -> Result<(), Error> {
        let name = ServerName::try_from("anything").unwrap();
        let year_s = 365 * 24 * 3600;
        let now = UnixTime::since_unix_epoch(std::time::Duration::from_secs(years * year_s));
        verifier
            .verify_server_cert(certificate, &[], &name, &[], now)
            .map(|_| ())
    }

    #[test]
    fn the_pinned_key_is_accepted_and_another_is_refused_by_its_pin() {
        let (mine, other) = (
            Identity::ephemeral().unwrap(),
            Identity::ephemeral().unwrap(),
        );
        let verifier = PinVerifier::new(mine.pin());
        assert_eq!(verdict(&verifier, &mine.certificate()), Ok(()));
        assert_eq!(verifier.refused(), None);
        assert!(verdict(&verifier, &other.certificate()).is_err());
        assert_eq!(verifier.refused(), Some(other.pin()));
    }

    #[test]
    fn the_dates_of_a_certificate_do_not_count() {
        let identity = Identity::ephemeral().unwrap();
        let verifier = PinVerifier::new(identity.pin());
        // it names 1975 to 4096
        for years in [0, 50, 3000] {
            let verdict = verdict_in(years, &verifier, &identity.certificate());
            assert_eq!(verdict, Ok(()), "{years}");
        }
    }

    #[test]
    fn no_mutation_of_a_certificate_panics_the_verifier() {
        let identity = Identity::ephemeral().unwrap();
        let verifier = PinVerifier::new(identity.pin());
        let certificate = identity.certificate().to_vec();
        for index in 0..certificate.len() {
            let mut mutated = certificate.clone();
            mutated[index] ^= 0xff;
            let _ = verdict(&verifier, &CertificateDer::from(mutated));
            let _ = verdict(
                &verifier,
                &CertificateDer::from(certificate[..index].to_vec()),
            );
        }
    }

    #[test]
    fn only_tls_13_is_spoken() {
        let identity = Identity::ephemeral().unwrap();
        assert!(server(&identity).is_ok());
        assert!(client(Arc::new(PinVerifier::new(identity.pin()))).is_ok());
    }
}
