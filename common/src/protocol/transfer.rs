//! Transfers of blobs: a message announces hash and length, part frames follow directly, and the receiver verifies the hash at the end.

use thiserror::Error;

use crate::graph::{Blob, BlobHash, HashMismatch, MAX_BLOB_BYTES};

/// How many bytes of a blob go into one frame (1 MiB): large enough to make the overhead of frames negligible, small enough that memory
/// grows with the received bytes.
pub const PART_BYTES: usize = 1 << 20;

/// Why a transfer failed. The connection cannot be used any more.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum TransferError {
    /// The announced length is out of range.
    #[error("expected a blob of at most {MAX_BLOB_BYTES} bytes, found one of {found}")]
    TooLong {
        /// The announced length.
        found: u64,
    },
    /// More bytes than announced, or an empty part.
    #[error("expected a part of 1 to {expected} bytes, found {found}")]
    Part {
        /// Number of missing bytes.
        expected: usize,
        /// The length of the part.
        found: usize,
    },
    /// The bytes are not the announced ones.
    #[error(transparent)]
    Hash(#[from] HashMismatch),
}

/// The parts in which a blob is sent; an empty blob has no parts.
pub fn parts(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    bytes.chunks(PART_BYTES)
}

/// A blob that is being received. Memory grows with the received bytes, not with the announced length.
#[derive(Debug)]
pub struct IncomingBlob {
    hash: BlobHash,
    length: usize,
    bytes: Vec<u8>,
}

impl IncomingBlob {
    /// Begin to receive an announced blob.
    ///
    /// # Errors
    /// If it is longer than [`MAX_BLOB_BYTES`].
    pub fn begin(hash: BlobHash, length: u64) -> Result<Self, TransferError> {
        let within_limit = usize::try_from(length).ok().filter(|length| *length <= MAX_BLOB_BYTES);
        let length = within_limit.ok_or(TransferError::TooLong { found: length })?;
        Ok(Self { hash, length, bytes: Vec::with_capacity(length.min(PART_BYTES)) })
    }

    /// Take the next part.
    ///
    /// # Errors
    /// If it is empty or longer than the missing bytes.
    pub fn push(&mut self, part: &[u8]) -> Result<(), TransferError> {
        let expected = self.length - self.bytes.len();
        if part.is_empty() || part.len() > expected {
            return Err(TransferError::Part { expected, found: part.len() });
        }
        // `Vec` would double its capacity and leave up to half of it unused. Grow at most by doubling, and never beyond the announced
        // length.
        if self.bytes.capacity() < self.bytes.len() + part.len() {
            let wanted = self.length.min(self.bytes.len() * 2).max(self.bytes.len() + part.len());
            self.bytes.reserve_exact(wanted - self.bytes.len());
        }
        self.bytes.extend_from_slice(part);
        Ok(())
    }

    /// Whether all bytes have been received.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.bytes.len() == self.length
    }

    /// The blob, verified.
    ///
    /// # Errors
    /// If bytes are missing, or their hash is not the announced one.
    pub fn finish(self) -> Result<Blob, TransferError> {
        if !self.is_complete() {
            return Err(TransferError::Part { expected: self.length - self.bytes.len(), found: 0 });
        }
        Ok(Blob::verified(self.hash, self.bytes)?)
    }
}
