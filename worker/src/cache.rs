//! A bounded cache of blobs by hash: a blob is fetched once and kept for later nodes.

use std::collections::BTreeMap;

use lookalike::graph::{Blob, BlobHash};

/// Blobs by hash; when the bound is exceeded, the least recently used ones are dropped.
#[derive(Debug)]
pub(crate) struct BlobCache {
    bound_bytes: usize,
    entries: BTreeMap<BlobHash, (Blob, u64)>,
    total_bytes: usize,
    clock: u64,
}

impl BlobCache {
    pub(crate) fn new(bound_bytes: usize) -> Self {
        Self { bound_bytes, entries: BTreeMap::new(), total_bytes: 0, clock: 0 }
    }

    /// The blob of this hash, if it is cached.
    pub(crate) fn get(&mut self, hash: BlobHash) -> Option<Blob> {
        self.clock += 1;
        let (blob, last_use) = self.entries.get_mut(&hash)?;
        *last_use = self.clock;
        Some(blob.clone())
    }

    /// Cache a blob, unless it is larger than the bound.
    pub(crate) fn insert(&mut self, blob: Blob) {
        self.clock += 1;
        let bytes = blob.len();
        if self.entries.insert(blob.hash(), (blob, self.clock)).is_none() {
            self.total_bytes += bytes;
        }
        while self.total_bytes > self.bound_bytes {
            let oldest = self.entries.iter().min_by_key(|(_, (_, last_use))| *last_use).map(|(hash, _)| *hash);
            let Some((blob, _)) = oldest.and_then(|hash| self.entries.remove(&hash)) else {
                return;
            };
            self.total_bytes -= blob.len();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn least_recently_used_blob_is_dropped_first() {
        let mut cache = BlobCache::new(10);
        let [first, second, third] = [1, 2, 3].map(|byte| Blob::new(vec![byte; 4]));
        cache.insert(first.clone());
        cache.insert(second.clone());
        cache.insert(second.clone());
        assert!(cache.get(first.hash()).is_some());
        cache.insert(third.clone());
        assert!(cache.get(second.hash()).is_none());
        assert!(cache.get(first.hash()).is_some() && cache.get(third.hash()).is_some());
        cache.insert(Blob::new(vec![9; 11]));
        assert_eq!((cache.entries.len(), cache.total_bytes), (0, 0));
    }
}
