//! The pin that identifies the coordinator's certificate in an access file.

use std::fmt;

use subtle::ConstantTimeEq;

use super::hex::{from_hex, to_hex};

/// Identifies a certificate: the BLAKE3 hash of its DER form. As text, `blake3:` and 64 hexadecimal digits.
///
/// A hash is enough for a worker to recognise its coordinator, and fits on a line. It is not a secret: it allows neither to join nor to
/// impersonate the coordinator.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct CertificatePin([u8; 32]);

const SCHEME: &str = "blake3:";

impl CertificatePin {
    /// The pin of a certificate in DER form.
    #[must_use]
    pub fn of(certificate_der: &[u8]) -> Self {
        Self(*blake3::hash(certificate_der).as_bytes())
    }

    /// Whether this is the pin of a certificate in DER form, compared in constant time.
    #[must_use]
    pub fn names(&self, certificate_der: &[u8]) -> bool {
        self.0.ct_eq(&Self::of(certificate_der).0).into()
    }

    pub(super) fn parse(text: &str) -> Option<Self> {
        from_hex(text.strip_prefix(SCHEME)?).map(Self)
    }
}

impl fmt::Display for CertificatePin {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{SCHEME}{}", to_hex(&self.0))
    }
}

impl fmt::Debug for CertificatePin {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, formatter)
    }
}
