//! The blobs of a graph, each with a reference count; a blob is dropped when its count reaches 0.

use std::collections::BTreeMap;

use super::{Blob, BlobHash};

/// Blobs by hash. Equal bytes are stored once.
#[derive(Debug, Default)]
pub(super) struct BlobStore {
    held: BTreeMap<BlobHash, Held>,
}

#[derive(Debug)]
struct Held {
    blob: Blob,
    /// One for every time it was added, one for every held node whose output it is, and one for every time it is an input of an open
    /// node.
    uses: usize,
}

impl BlobStore {
    /// Add `uses` to the count of a blob, and store the blob if it is new.
    pub(super) fn add(&mut self, blob: Blob, uses: usize) {
        if uses > 0 {
            self.held.entry(blob.hash()).or_insert(Held { blob, uses: 0 }).uses += uses;
        }
    }

    /// Add 1 to the count of a stored blob; no effect on an unknown one.
    pub(super) fn retain(&mut self, hash: BlobHash) {
        if let Some(held) = self.held.get_mut(&hash) {
            held.uses += 1;
        }
    }

    /// Subtract 1 from the count of a blob.
    pub(super) fn release(&mut self, hash: BlobHash) {
        if let Some(held) = self.held.get_mut(&hash) {
            held.uses -= 1;
            if held.uses == 0 {
                self.held.remove(&hash);
            }
        }
    }

    /// A blob by its hash.
    pub(super) fn get(&self, hash: BlobHash) -> Option<&Blob> {
        self.held.get(&hash).map(|held| &held.blob)
    }

    /// The size of all blobs together, in bytes.
    pub(super) fn bytes(&self) -> usize {
        self.held.values().map(|held| held.blob.len()).sum()
    }
}
