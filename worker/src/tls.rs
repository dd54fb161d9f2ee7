//! TLS on a connection: the worker's side, and what both sides have in common.
//!
//! TLS 1.3 with ring and nothing else. The coordinator shows a self-signed certificate; the worker knows it by the hash in its
//! access file ([`CertificatePin`]) and trusts no other, whatever names or issuers it has. Workers have no certificates: that
//! they may join, they prove with the secret in the preamble, whose proofs hold on this one connection only
//! ([`channel_binding`]). No session is ever resumed and nothing is sent before the handshake is over, so there is nothing to
//! replay.
//!
//! [RFC 8446] TLS 1.3, [RFC 9266] channel bindings for it.
//!
//! [RFC 8446]: https://www.rfc-editor.org/rfc/rfc8446
//! [RFC 9266]: https://www.rfc-editor.org/rfc/rfc9266

use std::io;
use std::sync::Arc;

use lookalike::protocol::{CertificatePin, ChannelBinding};
use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::client::{Resumption, verify_server_cert_signed_by_trust_anchor};
use rustls::crypto::ring::cipher_suite::{
    TLS13_AES_128_GCM_SHA256, TLS13_AES_256_GCM_SHA384, TLS13_CHACHA20_POLY1305_SHA256,
};
use rustls::crypto::{CryptoProvider, ring, verify_tls13_signature};
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::server::ParsedCertificate;
use rustls::{
    CertificateError, ClientConfig, ConnectionCommon, DigitallySignedStruct, Error, PeerIncompatible, RootCertStore,
    SignatureScheme,
};
use thiserror::Error as ThisError;
use tokio::io::{AsyncRead, AsyncWrite, BufReader};
use tokio_rustls::{TlsConnector, client};

/// The name that every coordinator's certificate is for, whatever its host is called.
pub const SERVER_NAME: &str = "lookalike-coordinator";

/// A stream that is read in large pieces: rustls asks for 4 KiB at a time.
pub type Transport<S> = BufReader<S>;

/// How much is read from the system at a time.
const READ_BYTES: usize = 32 << 10;

/// A TLS handshake that failed because of what the other side is. Trying again does not help.
#[derive(Clone, Debug, PartialEq, Eq, ThisError)]
#[non_exhaustive]
pub enum TlsError {
    /// The certificate is another one than the access file names.
    #[error(
        "wrong certificate: it is not the one that the access file names, so this is another coordinator, or somebody in between; copy the access file again from the run that is to be joined"
    )]
    ForeignCertificate,
    /// The certificate is not valid any more.
    #[error(
        "the coordinator's certificate has expired; check this machine's clock, or make a new access file with `lookalike access new`"
    )]
    ExpiredCertificate,
    /// The certificate is not valid yet.
    #[error("the coordinator's certificate is not valid yet; set this machine's clock")]
    EarlyCertificate,
    /// The other side shows our coordinator's certificate but does not have its key.
    #[error(
        "the other side shows the coordinator's certificate without having its key: it is an impostor; see who answers at the address"
    )]
    Impostor,
    /// The other side does not speak TLS 1.3 as we do.
    #[error(
        "expected TLS 1.3, found something else ({found}); is the address right, and the coordinator of the same build?"
    )]
    NotTls13 {
        /// What rustls says.
        found: String,
    },
}

impl TlsError {
    /// What a failed handshake says about the other side; the stream's own error if it says nothing.
    ///
    /// # Errors
    /// The stream's error.
    pub fn of_handshake(error: io::Error) -> Result<Self, io::Error> {
        let Some(fault) = error.get_ref().and_then(|inner| inner.downcast_ref::<Error>()) else {
            return Err(error);
        };
        Ok(match fault {
            Error::InvalidCertificate(fault) => Self::of_certificate(fault),
            fault => Self::NotTls13 { found: fault.to_string() },
        })
    }

    /// What is wrong with a certificate.
    #[must_use]
    pub fn of_certificate(fault: &CertificateError) -> Self {
        match fault {
            CertificateError::Expired | CertificateError::ExpiredContext { .. } => Self::ExpiredCertificate,
            CertificateError::NotValidYet | CertificateError::NotValidYetContext { .. } => Self::EarlyCertificate,
            CertificateError::BadSignature => Self::Impostor,
            _ => Self::ForeignCertificate,
        }
    }
}

/// Speak TLS as the worker with the coordinator at the other end of `stream`.
///
/// # Errors
/// When the stream fails, or the other side is not the coordinator whose certificate `pin` names: see
/// [`TlsError::of_handshake`].
pub async fn connect<S>(stream: S, pin: CertificatePin) -> io::Result<client::TlsStream<Transport<S>>>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let config = client_config(pin).map_err(io::Error::other)?;
    let name = ServerName::try_from(SERVER_NAME).map_err(io::Error::other)?;
    TlsConnector::from(Arc::new(config)).connect(name, transport(stream)).await
}

/// The stream as TLS reads it.
#[must_use]
pub fn transport<S: AsyncRead>(stream: S) -> Transport<S> {
    BufReader::with_capacity(READ_BYTES, stream)
}

/// How a worker speaks TLS with the coordinator whose certificate `pin` names.
///
/// # Errors
/// When rustls and its provider do not fit together.
pub fn client_config(pin: CertificatePin) -> Result<ClientConfig, Error> {
    let verifier = Arc::new(PinVerifier { pin });
    let mut config = ClientConfig::builder_with_provider(provider())
        .with_protocol_versions(&[&rustls::version::TLS13])?
        .dangerous()
        .with_custom_certificate_verifier(verifier)
        .with_no_client_auth();
    config.resumption = Resumption::disabled();
    config.enable_early_data = false;
    // The name says nothing that the coordinator needs; it need not be read on the way.
    config.enable_sni = false;
    Ok(config)
}

/// The cryptography of both sides: ring, with AES-128 before AES-256. It is as far out of reach, and blobs travel faster.
#[must_use]
pub fn provider() -> Arc<CryptoProvider> {
    let cipher_suites = vec![TLS13_AES_128_GCM_SHA256, TLS13_AES_256_GCM_SHA384, TLS13_CHACHA20_POLY1305_SHA256];
    Arc::new(CryptoProvider { cipher_suites, ..ring::default_provider() })
}

/// What names this connection to its two ends alone: see [`ChannelBinding`].
///
/// # Errors
/// When the handshake is not over.
pub fn channel_binding<Side>(connection: &ConnectionCommon<Side>) -> Result<ChannelBinding, Error> {
    let value = connection.export_keying_material([0; 32], b"EXPORTER-Channel-Binding", Some(b""))?;
    Ok(ChannelBinding::from_exporter(value))
}

/// Check that a self-signed certificate is one, for a server, and valid at `now`. Its name does not matter.
///
/// # Errors
/// What is wrong with it: [`TlsError::of_certificate`] has words for it.
pub fn check_certificate(certificate: &CertificateDer<'_>, now: UnixTime) -> Result<(), CertificateError> {
    let itself = || {
        let mut roots = RootCertStore::empty();
        roots.add(certificate.clone())?;
        let parsed = ParsedCertificate::try_from(certificate)?;
        verify_server_cert_signed_by_trust_anchor(
            &parsed,
            &roots,
            &[],
            now,
            provider().signature_verification_algorithms.all,
        )
    };
    itself().map_err(|error| match error {
        Error::InvalidCertificate(fault) => fault,
        _ => CertificateError::BadEncoding,
    })
}

/// Trusts the one certificate that the pin names.
#[derive(Debug)]
struct PinVerifier {
    pin: CertificatePin,
}

impl ServerCertVerifier for PinVerifier {
    fn verify_server_cert(
        &self,
        end_entity: &CertificateDer<'_>,
        _intermediates: &[CertificateDer<'_>],
        _server_name: &ServerName<'_>,
        _ocsp_response: &[u8],
        now: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        if !self.pin.names(end_entity) {
            return Err(CertificateError::ApplicationVerificationFailure.into());
        }
        check_certificate(end_entity, now)?;
        Ok(ServerCertVerified::assertion())
    }

    fn verify_tls12_signature(
        &self,
        _message: &[u8],
        _certificate: &CertificateDer<'_>,
        _signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        Err(PeerIncompatible::Tls12NotOffered.into())
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        verify_tls13_signature(message, certificate, signature, &provider().signature_verification_algorithms)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        provider().signature_verification_algorithms.supported_schemes()
    }
}
