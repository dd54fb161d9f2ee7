//! TLS on a connection: the worker's side, and the common parts of both sides.
//!
//! Only TLS 1.3 with ring. The coordinator presents a self-signed certificate; the worker compares its hash with the access file
//! ([`CertificatePin`]) and trusts no other certificate, regardless of name and issuer. Workers have no certificates: in the preamble
//! they prove that they know the secret, with proofs that are valid on this connection only ([`channel_binding`]). Sessions are never
//! resumed and there is no early data, so nothing can be replayed.
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

/// The name in every coordinator's certificate, independent of its host.
pub const SERVER_NAME: &str = "lookalike-coordinator";

/// A buffered stream, because rustls reads only 4 KiB at a time.
pub type Transport<S> = BufReader<S>;

/// How many bytes are read from the system at a time.
const READ_BYTES: usize = 32 << 10;

/// Why a TLS handshake with this peer fails. A retry would fail again.
#[derive(Clone, Debug, PartialEq, Eq, ThisError)]
#[non_exhaustive]
pub enum TlsError {
    /// The certificate is not the one in the access file.
    #[error(
        "wrong certificate: it is not the one that the access file names, so this is another coordinator or a man in the middle; copy the access file again from the run to join"
    )]
    ForeignCertificate,
    /// The certificate has expired.
    #[error(
        "the coordinator's certificate has expired; check this machine's clock, or make a new access file with `lookalike access new`"
    )]
    ExpiredCertificate,
    /// The certificate is not valid yet.
    #[error("the coordinator's certificate is not valid yet; set this machine's clock")]
    EarlyCertificate,
    /// The peer presents the coordinator's certificate but does not have its key.
    #[error(
        "the other side presents the coordinator's certificate but does not have its key, so it is an impostor; check which host answers at the address"
    )]
    Impostor,
    /// The peer does not speak TLS 1.3, or has no common cipher suite.
    #[error(
        "expected TLS 1.3, but the handshake failed ({found}); check the address, and that the coordinator is of the same build"
    )]
    NotTls13 {
        /// The error of rustls.
        found: String,
    },
}

impl TlsError {
    /// The fault of the peer in a failed handshake; otherwise the error of the stream.
    ///
    /// # Errors
    /// The error of the stream.
    pub fn of_handshake(error: io::Error) -> Result<Self, io::Error> {
        let Some(fault) = error.get_ref().and_then(|inner| inner.downcast_ref::<Error>()) else {
            return Err(error);
        };
        Ok(match fault {
            Error::InvalidCertificate(fault) => Self::of_certificate(fault),
            fault => Self::NotTls13 { found: fault.to_string() },
        })
    }

    /// The error for a fault of a certificate.
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

/// Start TLS as a worker with the coordinator at the other end of `stream`.
///
/// # Errors
/// If the stream fails, or the peer is not the coordinator whose certificate `pin` identifies: see
/// [`TlsError::of_handshake`].
pub async fn connect<S>(stream: S, pin: CertificatePin) -> io::Result<client::TlsStream<Transport<S>>>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let config = client_config(pin).map_err(io::Error::other)?;
    let name = ServerName::try_from(SERVER_NAME).map_err(io::Error::other)?;
    TlsConnector::from(Arc::new(config)).connect(name, transport(stream)).await
}

/// The stream with the read buffer for TLS.
#[must_use]
pub fn transport<S: AsyncRead>(stream: S) -> Transport<S> {
    BufReader::with_capacity(READ_BYTES, stream)
}

/// The TLS configuration of a worker for the coordinator whose certificate `pin` identifies.
///
/// # Errors
/// If rustls and its provider are incompatible.
pub fn client_config(pin: CertificatePin) -> Result<ClientConfig, Error> {
    let verifier = Arc::new(PinVerifier { pin });
    let mut config = ClientConfig::builder_with_provider(provider())
        .with_protocol_versions(&[&rustls::version::TLS13])?
        .dangerous()
        .with_custom_certificate_verifier(verifier)
        .with_no_client_auth();
    config.resumption = Resumption::disabled();
    config.enable_early_data = false;
    // The coordinator does not need the name, and without it the name is not visible on the network.
    config.enable_sni = false;
    Ok(config)
}

/// The cryptography of both sides: ring, with AES-128 preferred to AES-256, because it is strong enough and faster.
#[must_use]
pub fn provider() -> Arc<CryptoProvider> {
    let cipher_suites = vec![TLS13_AES_128_GCM_SHA256, TLS13_AES_256_GCM_SHA384, TLS13_CHACHA20_POLY1305_SHA256];
    Arc::new(CryptoProvider { cipher_suites, ..ring::default_provider() })
}

/// The value that identifies this connection to its two ends: see [`ChannelBinding`].
///
/// # Errors
/// If the handshake is not complete.
pub fn channel_binding<Side>(connection: &ConnectionCommon<Side>) -> Result<ChannelBinding, Error> {
    let value = connection.export_keying_material([0; 32], b"EXPORTER-Channel-Binding", Some(b""))?;
    Ok(ChannelBinding::from_exporter(value))
}

/// Check that a certificate is self-signed, for a server, and valid at `now`. Its name is not checked.
///
/// # Errors
/// The fault of the certificate; [`TlsError::of_certificate`] turns it into a message.
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

/// Trusts only the certificate that the pin identifies.
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
