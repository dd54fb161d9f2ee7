//! The access file: everything that a worker needs to join a run. Only a process that can read it can join.
//!
//! ```json
//! { "address": "127.0.0.1:45123", "certificate": "blake3:64 hexadecimal digits", "secret": "64 hexadecimal digits" }
//! ```
//! It does not contain the private key of the certificate: the file is copied to workers, and a worker must not be able to impersonate
//! the coordinator.

use std::fmt;

use serde::{Deserialize, Serialize};
use subtle::ConstantTimeEq;
use thiserror::Error;

use super::certificate::CertificatePin;
use super::hex::{from_hex, to_hex};

/// The secret of a run: 32 random bytes. Compared in constant time, never printed.
#[derive(Clone)]
pub struct Secret([u8; 32]);

impl Secret {
    /// The secret of these bytes, which must come from the operating system's random source.
    #[must_use]
    pub fn from_bytes(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    /// The BLAKE3 keyed hash of `message` under this secret.
    pub(super) fn keyed_hash(&self, message: &[u8]) -> [u8; 32] {
        *blake3::keyed_hash(&self.0, message).as_bytes()
    }
}

/// Does not show the secret.
impl fmt::Debug for Secret {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Secret(..)")
    }
}

impl PartialEq for Secret {
    fn eq(&self, other: &Self) -> bool {
        self.0.ct_eq(&other.0).into()
    }
}

impl Eq for Secret {}

/// The content of an access file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Access {
    /// Where the coordinator listens, as `HOST:PORT`.
    pub address: String,
    /// The pin of the coordinator's certificate. A worker closes the connection if the peer presents another certificate.
    pub certificate: CertificatePin,
    /// The secret.
    pub secret: Secret,
}

/// Why a text is not an access file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum AccessError {
    /// The text is not the expected JSON.
    #[error("expected JSON with \"address\", \"certificate\" and \"secret\": {0}")]
    Json(String),
    /// The secret is not 32 bytes in hexadecimal. The message does not repeat it.
    #[error(
        "expected a \"secret\" of 64 hexadecimal digits, found {found} characters, or characters that are not hexadecimal digits; copy the file again"
    )]
    Secret {
        /// Number of characters found.
        found: usize,
    },
    /// The address has no port.
    #[error("expected an \"address\" of the form HOST:PORT, found {found:?}")]
    Address {
        /// The address found.
        found: String,
    },
    /// The certificate is not a pin. The message does not repeat it, because it may be the secret in the wrong field.
    #[error(
        "expected a \"certificate\" of the form blake3:HASH with 64 hexadecimal digits, found another text; check whether another version wrote the file"
    )]
    Certificate,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AccessFile {
    address: String,
    certificate: Option<String>,
    secret: String,
}

impl Access {
    /// Parse the text of an access file.
    ///
    /// # Errors
    /// If it is not an access file. The certificate is required, because every connection uses TLS.
    pub fn parse(text: &str) -> Result<Self, AccessError> {
        let file: AccessFile = serde_json::from_str(text).map_err(|error| AccessError::Json(without_values(&error)))?;
        let secret =
            from_hex(&file.secret).map(Secret).ok_or(AccessError::Secret { found: file.secret.chars().count() })?;
        let port = file.address.rsplit_once(':').and_then(|(_, port)| port.parse::<u16>().ok());
        if port.is_none() {
            return Err(AccessError::Address { found: file.address });
        }
        let certificate =
            file.certificate.as_deref().and_then(CertificatePin::parse).ok_or(AccessError::Certificate)?;
        Ok(Self { address: file.address, certificate, secret })
    }

    /// The text of the access file.
    #[must_use]
    pub fn to_json(&self) -> String {
        let file = AccessFile {
            address: self.address.clone(),
            certificate: Some(self.certificate.to_string()),
            secret: to_hex(&self.secret.0),
        };
        // Three strings always have a JSON form.
        serde_json::to_string_pretty(&file).unwrap_or_default() + "\n"
    }
}

/// Kind and place of an error, without serde's quotation of the text, which might be the secret.
fn without_values(error: &serde_json::Error) -> String {
    format!("{:?} error in line {}, column {}", error.classify(), error.line(), error.column()).to_lowercase()
}
