//! Decoded inputs, shared by the nodes of one process: a table that 21 searches read is decoded once.

use std::any::{Any, TypeId};
use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{Blob, BlobHash};

/// A bounded cache of decoded blobs, keyed by blob and type; the least recently used entries are dropped first.
pub struct DecodedCache {
    bound_bytes: usize,
    entries: Mutex<Entries>,
}

#[derive(Default)]
struct Entries {
    by_key: BTreeMap<(BlobHash, TypeId), Entry>,
    total_bytes: usize,
    clock: u64,
}

struct Entry {
    value: Arc<dyn Any + Send + Sync>,
    bytes: usize,
    last_use: u64,
}

impl DecodedCache {
    /// An empty cache. `bound_bytes` limits the sum of the *encoded* sizes, as an estimate of the decoded ones.
    #[must_use]
    pub fn new(bound_bytes: usize) -> Self {
        Self { bound_bytes, entries: Mutex::default() }
    }

    /// The decoded form of `blob`: from the cache, otherwise from `decode`, and then cached.
    ///
    /// No lock is held while `decode` runs. Inside a decoder that uses rayon, the same thread may start another node that reads the
    /// same blob, which would deadlock. So two nodes that start together may both decode; the first result is cached, and both get it.
    ///
    /// # Errors
    /// Those of `decode`; an error is not cached.
    pub fn get_or_decode<T: Any + Send + Sync, E>(
        &self,
        blob: &Blob,
        decode: impl FnOnce(&[u8]) -> Result<T, E>,
    ) -> Result<Arc<T>, E> {
        self.get_or_make(blob.hash(), blob.len(), || decode(blob))
    }

    /// The value of a key: from the cache, otherwise from `make`, and then cached as `bytes` bytes. As [`DecodedCache::get_or_decode`] in
    /// everything else.
    ///
    /// # Errors
    /// Those of `make`; an error is not cached.
    pub fn get_or_make<T: Any + Send + Sync, E>(
        &self,
        key: BlobHash,
        bytes: usize,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Arc<T>, E> {
        let key = (key, TypeId::of::<T>());
        if let Some(kept) = self.lock().find(key) {
            return Ok(kept);
        }
        let fresh = Arc::new(make()?);
        let mut entries = self.lock();
        if let Some(kept) = entries.find(key) {
            return Ok(kept);
        }
        entries.insert(key, Arc::clone(&fresh) as _, bytes);
        entries.shrink_to(self.bound_bytes);
        Ok(fresh)
    }

    fn lock(&self) -> MutexGuard<'_, Entries> {
        // A panic while the lock is held leaves the entries usable: at worst one is missing.
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Entries {
    fn find<T: Any + Send + Sync>(&mut self, key: (BlobHash, TypeId)) -> Option<Arc<T>> {
        self.clock += 1;
        let entry = self.by_key.get_mut(&key)?;
        entry.last_use = self.clock;
        Arc::clone(&entry.value).downcast().ok()
    }

    fn insert(&mut self, key: (BlobHash, TypeId), value: Arc<dyn Any + Send + Sync>, bytes: usize) {
        self.total_bytes += bytes;
        self.by_key.insert(key, Entry { value, bytes, last_use: self.clock });
    }

    fn shrink_to(&mut self, bound_bytes: usize) {
        while self.total_bytes > bound_bytes {
            let Some(oldest) = self.by_key.iter().min_by_key(|(_, entry)| entry.last_use).map(|(key, _)| *key) else {
                return;
            };
            if let Some(entry) = self.by_key.remove(&oldest) {
                self.total_bytes -= entry.bytes;
            }
        }
    }
}

impl fmt::Debug for DecodedCache {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let entries = self.lock();
        formatter
            .debug_struct("DecodedCache")
            .field("entries", &entries.by_key.len())
            .field("total_bytes", &entries.total_bytes)
            .field("bound_bytes", &self.bound_bytes)
            .finish()
    }
}
