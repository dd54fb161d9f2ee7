//! The preamble: exchanges protocol versions and proofs that both sides know the secret.
//!
//! ```text
//!   coordinator -> worker   Challenge   magic 8, version 2, zero 2, nonce 32                       44 bytes
//!   worker -> coordinator   Response    magic 8, version 2, zero 2, nonce 32, proof 32             76 bytes
//!   coordinator -> worker   Verdict     magic 8, version 2, refusal 1, zero 1, proof 32            44 bytes
//! ```
//! Integers are little-endian. A proof is BLAKE3 over the role's label and both nonces, keyed with a [`ProofKey`], which is derived from
//! the secret and the TLS connection. Neither side reveals the secret. A proof cannot be replayed, reflected to its sender, or relayed
//! from one connection to another, and a worker does not accept an impostor as its coordinator. Proofs are compared in constant time.
//! All lengths are fixed, and the bytes are parsed by hand.

use std::fmt;

use subtle::ConstantTimeEq;
use thiserror::Error;

use super::access::Secret;
use super::version::{MAGIC, PROTOCOL_VERSION};

/// The length of a [`Challenge`].
pub const CHALLENGE_BYTES: usize = 44;
/// The length of a [`Response`].
pub const RESPONSE_BYTES: usize = 76;
/// The length of a [`Verdict`].
pub const VERDICT_BYTES: usize = 44;

/// 32 bytes from the operating system's random source, used once.
pub type Nonce = [u8; 32];

/// A value that is unique to a TLS connection and known only to its two ends: the exporter value `tls-exporter` of RFC 9266.
#[derive(Clone, Copy)]
pub struct ChannelBinding([u8; 32]);

impl ChannelBinding {
    /// The binding from the exporter's value for the label `EXPORTER-Channel-Binding` with an empty context.
    #[must_use]
    pub fn from_exporter(value: [u8; 32]) -> Self {
        Self(value)
    }
}

/// Does not show the value.
impl fmt::Debug for ChannelBinding {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("ChannelBinding(..)")
    }
}

/// The key of the proofs on one connection: the BLAKE3 keyed hash, under the secret, of the connection's binding. Different connections
/// have different keys, so a man in the middle with one connection to each side cannot relay proofs.
#[derive(Clone, Debug)]
pub struct ProofKey(Secret);

impl ProofKey {
    /// The key for `secret` on the connection that `channel` identifies.
    #[must_use]
    pub fn new(secret: &Secret, channel: &ChannelBinding) -> Self {
        Self(Secret::from_bytes(secret.keyed_hash(&[CHANNEL_LABEL, channel.0.as_slice()].concat())))
    }
}

const CHANNEL_LABEL: &[u8] = b"lookalike channel key";
const WORKER_LABEL: &[u8] = b"lookalike worker proof";
const COORDINATOR_LABEL: &[u8] = b"lookalike coordinator proof";

/// Why a handshake failed. A retry would fail again.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum HandshakeError {
    /// The peer does not speak this protocol.
    #[error("expected the greeting of a lookalike coordinator or worker, found other bytes; check the address")]
    Magic,
    /// The peer speaks another version.
    #[error("expected protocol version {expected}, found {found}; use the same build of coordinator and worker")]
    Version {
        /// Our version.
        expected: u16,
        /// The version of the peer.
        found: u16,
    },
    /// The coordinator refuses this worker.
    #[error("the coordinator refuses this worker: {0}")]
    Refused(Refusal),
    /// The coordinator does not know the secret, so it is not the one that wrote the access file.
    #[error("the coordinator does not know the secret of the access file; copy the file again from the run to join")]
    Impostor,
    /// An unknown refusal.
    #[error("expected a verdict of 0 to 2, found {found}")]
    Verdict {
        /// The received byte.
        found: u8,
    },
}

/// Why a coordinator refuses a worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum Refusal {
    /// The worker's proof is wrong.
    #[error("wrong secret; copy the access file again from the run to join")]
    WrongSecret,
    /// The worker speaks another version.
    #[error("it speaks another protocol version; use the same build of coordinator and worker")]
    WrongVersion,
}

/// The first bytes from the coordinator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Challenge {
    /// The protocol version of the coordinator.
    pub version: u16,
    /// The nonce for the worker's proof.
    pub nonce: Nonce,
}

/// The worker's answer to a [`Challenge`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Response {
    /// The protocol version of the worker.
    pub version: u16,
    /// The nonce for the coordinator's proof.
    pub nonce: Nonce,
    /// The proof that the worker knows the secret.
    pub proof: [u8; 32],
}

/// The coordinator's answer to a [`Response`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Verdict {
    /// The protocol version of the coordinator.
    pub version: u16,
    /// Why the worker is refused; `None` if it is accepted.
    pub refusal: Option<Refusal>,
    /// The proof that the coordinator knows the secret; all zero in a refusal, so that a refused peer learns nothing about the secret.
    pub proof: [u8; 32],
}

impl Challenge {
    /// The challenge of this build.
    #[must_use]
    pub fn new(nonce: Nonce) -> Self {
        Self { version: PROTOCOL_VERSION, nonce }
    }

    /// The wire form.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; CHALLENGE_BYTES] {
        let mut bytes = [0; CHALLENGE_BYTES];
        put(&mut bytes, &[&MAGIC, &self.version.to_le_bytes(), &[0; 2], &self.nonce]);
        bytes
    }

    /// Parses the wire form.
    ///
    /// # Errors
    /// If they are not from this protocol. Another version is not an error here.
    pub fn from_bytes(bytes: &[u8; CHALLENGE_BYTES]) -> Result<Self, HandshakeError> {
        Ok(Self { version: version_of(bytes)?, nonce: take(bytes, 12) })
    }

    /// The worker's answer.
    ///
    /// # Errors
    /// If the coordinator speaks another version.
    pub fn answer(&self, key: &ProofKey, nonce: Nonce) -> Result<Response, HandshakeError> {
        check_version(self.version)?;
        Ok(Response { version: PROTOCOL_VERSION, nonce, proof: proof(key, WORKER_LABEL, &self.nonce, &nonce) })
    }
}

impl Response {
    /// The wire form.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; RESPONSE_BYTES] {
        let mut bytes = [0; RESPONSE_BYTES];
        put(&mut bytes, &[&MAGIC, &self.version.to_le_bytes(), &[0; 2], &self.nonce, &self.proof]);
        bytes
    }

    /// Parses the wire form.
    ///
    /// # Errors
    /// If they are not from this protocol. Another version is not an error here.
    pub fn from_bytes(bytes: &[u8; RESPONSE_BYTES]) -> Result<Self, HandshakeError> {
        Ok(Self { version: version_of(bytes)?, nonce: take(bytes, 12), proof: take(bytes, 44) })
    }

    /// The coordinator's verdict on this answer to `challenge`.
    #[must_use]
    pub fn judge(&self, challenge: &Challenge, key: &ProofKey) -> Verdict {
        let expected = proof(key, WORKER_LABEL, &challenge.nonce, &self.nonce);
        let refusal = if self.version != PROTOCOL_VERSION {
            Some(Refusal::WrongVersion)
        } else if !bool::from(self.proof.ct_eq(&expected)) {
            Some(Refusal::WrongSecret)
        } else {
            None
        };
        let own_proof = proof(key, COORDINATOR_LABEL, &challenge.nonce, &self.nonce);
        let proof = if refusal.is_none() { own_proof } else { [0; 32] };
        Verdict { version: PROTOCOL_VERSION, refusal, proof }
    }
}

impl Verdict {
    /// The wire form.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; VERDICT_BYTES] {
        let refusal = match self.refusal {
            None => 0,
            Some(Refusal::WrongSecret) => 1,
            Some(Refusal::WrongVersion) => 2,
        };
        let mut bytes = [0; VERDICT_BYTES];
        put(&mut bytes, &[&MAGIC, &self.version.to_le_bytes(), &[refusal, 0], &self.proof]);
        bytes
    }

    /// Parses the wire form.
    ///
    /// # Errors
    /// If they are not from this protocol.
    pub fn from_bytes(bytes: &[u8; VERDICT_BYTES]) -> Result<Self, HandshakeError> {
        let version = version_of(bytes)?;
        let refusal = match bytes[10] {
            0 => None,
            1 => Some(Refusal::WrongSecret),
            2 => Some(Refusal::WrongVersion),
            found => return Err(HandshakeError::Verdict { found }),
        };
        Ok(Self { version, refusal, proof: take(bytes, 12) })
    }

    /// Checks that the worker is accepted, and that the coordinator is the one that wrote the access file.
    ///
    /// # Errors
    /// If either is not the case, or the version is wrong.
    pub fn check(&self, challenge: &Challenge, response: &Response, key: &ProofKey) -> Result<(), HandshakeError> {
        check_version(self.version)?;
        if let Some(refusal) = self.refusal {
            return Err(HandshakeError::Refused(refusal));
        }
        let expected = proof(key, COORDINATOR_LABEL, &challenge.nonce, &response.nonce);
        if bool::from(self.proof.ct_eq(&expected)) { Ok(()) } else { Err(HandshakeError::Impostor) }
    }
}

fn proof(key: &ProofKey, label: &[u8], challenge: &Nonce, response: &Nonce) -> [u8; 32] {
    // Unambiguous without separators, because the label is one of two constants and the nonces have fixed lengths.
    key.0.keyed_hash(&[label, challenge, response].concat())
}

fn check_version(found: u16) -> Result<(), HandshakeError> {
    let expected = PROTOCOL_VERSION;
    if found == expected { Ok(()) } else { Err(HandshakeError::Version { expected, found }) }
}

fn version_of(bytes: &[u8]) -> Result<u16, HandshakeError> {
    if bytes.starts_with(&MAGIC) { Ok(u16::from_le_bytes(take(bytes, 8))) } else { Err(HandshakeError::Magic) }
}

/// Fills `bytes` with the fields one after the other; the callers ensure that they fit.
fn put(bytes: &mut [u8], fields: &[&[u8]]) {
    let mut rest = bytes;
    for field in fields {
        let (place, behind) = rest.split_at_mut(field.len());
        place.copy_from_slice(field);
        rest = behind;
    }
}

/// The field of `N` bytes at `offset`; the callers ensure that it lies inside.
fn take<const N: usize>(bytes: &[u8], offset: usize) -> [u8; N] {
    std::array::from_fn(|index| bytes[offset + index])
}
