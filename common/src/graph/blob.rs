//! Blobs: immutable byte strings named by their BLAKE3 hash.

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use thiserror::Error;

/// The largest blob that may exist, in bytes (256 MiB).
///
/// The largest output in the design is a full-resolution transport table of about 64 MB. Four times that leaves room, and a peer still
/// cannot make another allocate unbounded memory. Blobs are sent in parts, so this limits the assembled blob, not a single frame.
pub const MAX_BLOB_BYTES: usize = 256 << 20;

/// The name of a blob: the BLAKE3 hash of its bytes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlobHash(pub [u8; 32]);

impl BlobHash {
    /// The hash of `bytes`.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }
}

/// All 64 hexadecimal digits.
impl fmt::Display for BlobHash {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(formatter, "{byte:02x}"))
    }
}

/// The first eight hexadecimal digits: enough to tell blobs apart in a log.
impl fmt::Debug for BlobHash {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0[..4].iter().try_for_each(|byte| write!(formatter, "{byte:02x}"))
    }
}

/// Bytes whose hash is not the announced one.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("blob of {bytes} bytes: expected hash {expected}, found {found}; the sender or the transfer is faulty")]
pub struct HashMismatch {
    /// The name under which the bytes were announced.
    pub expected: BlobHash,
    /// The hash of the received bytes.
    pub found: BlobHash,
    /// Number of received bytes.
    pub bytes: usize,
}

/// Immutable bytes with their hash; a clone shares the bytes.
#[derive(Clone)]
pub struct Blob {
    hash: BlobHash,
    // Not `Arc<[u8]>`, which would need a copy of every output, and outputs reach 64 MB.
    bytes: Arc<Vec<u8>>,
}

impl Blob {
    /// The blob of these bytes; computes the hash.
    #[must_use]
    pub fn new(bytes: Vec<u8>) -> Self {
        Self { hash: BlobHash::of(&bytes), bytes: Arc::new(bytes) }
    }

    /// The blob of these bytes, which a peer announced as `expected`.
    ///
    /// # Errors
    /// If the bytes have another hash.
    pub fn verified(expected: BlobHash, bytes: Vec<u8>) -> Result<Self, HashMismatch> {
        let blob = Self::new(bytes);
        if blob.hash == expected {
            Ok(blob)
        } else {
            Err(HashMismatch { expected, found: blob.hash, bytes: blob.len() })
        }
    }

    /// The name of the blob.
    #[must_use]
    pub fn hash(&self) -> BlobHash {
        self.hash
    }
}

impl Deref for Blob {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes
    }
}

impl fmt::Debug for Blob {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Blob({:?}, {} bytes)", self.hash, self.len())
    }
}

/// Blobs of equal hash have equal bytes.
impl PartialEq for Blob {
    fn eq(&self, other: &Self) -> bool {
        self.hash == other.hash
    }
}

impl Eq for Blob {}
