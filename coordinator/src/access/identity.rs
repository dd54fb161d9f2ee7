//! The coordinator's certificate and its private key.

use std::fmt;
use std::time::{Duration, SystemTime};

use lookalike::protocol::CertificatePin;
use lookalike_worker::tls::{SERVER_NAME, check_certificate};
use rcgen::{CertificateParams, DnType, ExtendedKeyUsagePurpose, KeyPair, PKCS_ED25519};
use rustls::CertificateError;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, UnixTime};

/// A new certificate is accepted by workers whose clocks are slow by up to this.
const CLOCK_SKEW: Duration = Duration::from_hours(48);
/// How long a certificate is valid: longer than any run, so that an access file can be made once for a cluster.
const VALIDITY: Duration = Duration::from_hours(24 * 365 * 2);

/// A self-signed certificate with its Ed25519 key, by which workers recognise the coordinator. A process with a copy of the key
/// passes TLS as the coordinator, so it stays with the coordinator.
pub struct Identity {
    certificate: CertificateDer<'static>,
    key: PrivateKeyDer<'static>,
    pem: String,
}

impl Identity {
    /// A new identity, valid from two days before `now` for two years.
    ///
    /// # Errors
    /// When the system provides no random bytes.
    pub fn new(now: SystemTime) -> Result<Self, rcgen::Error> {
        let key = KeyPair::generate_for(&PKCS_ED25519)?;
        let mut parameters = CertificateParams::new([SERVER_NAME.to_owned()])?;
        parameters.distinguished_name.push(DnType::CommonName, SERVER_NAME);
        parameters.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
        parameters.not_before = (now - CLOCK_SKEW).into();
        parameters.not_after = (now + VALIDITY).into();
        let certificate = parameters.self_signed(&key)?;
        Ok(Self {
            pem: certificate.pem() + &key.serialize_pem(),
            certificate: certificate.der().clone(),
            key: PrivateKeyDer::Pkcs8(key.serialize_der().into()),
        })
    }

    /// Parse a certificate and a key in PEM.
    ///
    /// # Errors
    /// What is missing. The message contains nothing of the text.
    pub fn from_pem(pem: &str) -> Result<Self, &'static str> {
        let certificate =
            CertificateDer::from_pem_slice(pem.as_bytes()).map_err(|_| "expected a CERTIFICATE in PEM, found none")?;
        let key =
            PrivateKeyDer::from_pem_slice(pem.as_bytes()).map_err(|_| "expected a PRIVATE KEY in PEM, found none")?;
        Ok(Self { certificate, key, pem: pem.to_owned() })
    }

    /// Certificate and key in PEM.
    #[must_use]
    pub fn to_pem(&self) -> &str {
        &self.pem
    }

    /// The certificate, in DER form.
    #[must_use]
    pub fn certificate(&self) -> &CertificateDer<'static> {
        &self.certificate
    }

    /// The pin by which workers recognise the certificate.
    #[must_use]
    pub fn pin(&self) -> CertificatePin {
        CertificatePin::of(&self.certificate)
    }

    /// Check that workers whose clock says `now` accept the certificate.
    ///
    /// # Errors
    /// Why workers reject it.
    pub fn check(&self, now: SystemTime) -> Result<(), CertificateError> {
        let since_1970 = now.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        check_certificate(&self.certificate, UnixTime::since_unix_epoch(since_1970))
    }

    /// The private key.
    pub(crate) fn key(&self) -> PrivateKeyDer<'static> {
        self.key.clone_key()
    }
}

/// Omits the key.
impl fmt::Debug for Identity {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Identity({})", self.pin())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DAY: Duration = Duration::from_hours(24);

    #[test]
    fn certificate_is_valid_for_clocks_that_are_behind_and_for_long_runs() {
        let now = SystemTime::now();
        let identity = Identity::new(now).unwrap();
        for clock in [now - DAY, now, now + 600 * DAY] {
            assert_eq!(identity.check(clock), Ok(()));
        }
        let early = identity.check(now - 3 * DAY).unwrap_err();
        assert!(matches!(early, CertificateError::NotValidYetContext { .. }), "{early}");
        let late = identity.check(now + 731 * DAY).unwrap_err();
        assert!(matches!(late, CertificateError::ExpiredContext { .. }), "{late}");
    }

    #[test]
    fn identity_survives_its_file_and_hides_its_key() {
        let identity = Identity::new(SystemTime::now()).unwrap();
        let read = Identity::from_pem(identity.to_pem()).unwrap();
        assert_eq!((read.pin(), read.key()), (identity.pin(), identity.key()));
        let key_line = identity.to_pem().lines().rev().nth(1).unwrap();
        assert!(key_line.len() > 20 && !format!("{identity:?}").contains(key_line));
        let (certificate, key) = identity.to_pem().split_once("-----BEGIN PRIVATE").unwrap();
        assert!(Identity::from_pem(certificate).unwrap_err().contains("PRIVATE KEY"));
        assert!(Identity::from_pem(&format!("-----BEGIN PRIVATE{key}")).unwrap_err().contains("CERTIFICATE"));
    }

    #[test]
    fn two_identities_differ() {
        let [first, second] = [0, 1].map(|_| Identity::new(SystemTime::now()).unwrap());
        assert_ne!(first.pin(), second.pin());
    }
}
