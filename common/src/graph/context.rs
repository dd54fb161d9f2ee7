//! The context of a running node: cancellation, progress, and the cache of decoded inputs.

use std::any::Any;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use super::{Blob, BlobHash, DecodedCache, NodeFailure};

/// The context of one execution of one node. Nothing in it may change the output.
#[derive(Clone, Debug)]
pub struct RunContext {
    cancelled: Arc<AtomicBool>,
    progress_permille: Arc<AtomicU32>,
    decoded: Arc<DecodedCache>,
}

impl RunContext {
    /// A context for one execution, which shares `decoded` with the other nodes of this process.
    #[must_use]
    pub fn new(decoded: Arc<DecodedCache>) -> Self {
        Self { cancelled: Arc::default(), progress_permille: Arc::default(), decoded }
    }

    /// Ask the node to stop because its output is no longer needed.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether the output is no longer needed.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// For use with `?` between the steps of a long node.
    ///
    /// # Errors
    /// [`NodeFailure::Cancelled`] once the output is no longer needed.
    pub fn check(&self) -> Result<(), NodeFailure> {
        if self.is_cancelled() { Err(NodeFailure::Cancelled) } else { Ok(()) }
    }

    /// Report progress as `done` of `total` steps; it is shown to the user about once a second.
    pub fn report(&self, done: u64, total: u64) {
        let permille = done.saturating_mul(1000).checked_div(total).unwrap_or(1000).min(1000);
        self.progress_permille.store(u32::try_from(permille).unwrap_or(1000), Ordering::Relaxed);
    }

    /// The last reported progress in thousandths; 0 before the first [`report`](Self::report).
    #[must_use]
    pub fn progress_permille(&self) -> u32 {
        self.progress_permille.load(Ordering::Relaxed)
    }

    /// The decoded form of an input, shared with the other nodes of this process that read the same blob as a `T`.
    ///
    /// # Errors
    /// Those of `decode`.
    pub fn decoded<T: Any + Send + Sync>(
        &self,
        input: &Blob,
        decode: impl FnOnce(&[u8]) -> Result<T, NodeFailure>,
    ) -> Result<Arc<T>, NodeFailure> {
        self.decoded.get_or_decode(input, decode)
    }

    /// A value that follows from inputs alone, shared with the other nodes of this process that make a `T` from the same ones. `key` is a hash
    /// of all that it depends on, `bytes` about its size in memory. Nodes that start together may each make it.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn derived<T: Any + Send + Sync>(
        &self,
        key: BlobHash,
        bytes: usize,
        make: impl FnOnce() -> Result<T, NodeFailure>,
    ) -> Result<Arc<T>, NodeFailure> {
        self.decoded.get_or_make(key, bytes, make)
    }
}
