//! The pin: how an access file names the coordinator's certificate.

use std::fmt;

use subtle::ConstantTimeEq;

use super::hex::{from_hex, to_hex};

/// Names a certificate: the BLAKE3 hash of its DER form. As text `blake3:` and 64 hexadecimal digits.
///
/// A hash and not the certificate itself: it is all that a worker needs to recognise its coordinator, and it fits on a line. It
/// is public: who knows it can recognise the coordinator, too, but neither join nor stand in for it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct CertificatePin([u8; 32]);

const SCHEME: &str = "blake3:";

impl CertificatePin {
    /// The pin of a certificate in DER form.
    #[must_use]
    pub fn of(certificate_der: &[u8]) -> Self {
        Self(*blake3::hash(certificate_der).as_bytes())
    }

    /// Whether this is the pin of that certificate (DER). Takes the same time whether or not.
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
