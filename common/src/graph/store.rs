//! The blobs of a graph, each with a count of who needs it: the last one to let go of it frees it.

use std::collections::BTreeMap;

use super::{Blob, BlobHash};

/// Blobs by name. Equal bytes are kept once.
#[derive(Debug, Default)]
pub(super) struct BlobStore {
    held: BTreeMap<BlobHash, Held>,
}

#[derive(Debug)]
struct Held {
    blob: Blob,
    /// One for every time it was added or is an output that is held, and one for every open node that reads it, as often as it
    /// does.
    uses: usize,
}

impl BlobStore {
    /// Need a blob once more.
    pub(super) fn add(&mut self, blob: Blob, uses: usize) {
        if uses > 0 {
            self.held.entry(blob.hash()).or_insert(Held { blob, uses: 0 }).uses += uses;
        }
    }

    /// Need a blob that is here once more; nothing happens if it is not.
    pub(super) fn retain(&mut self, hash: BlobHash) {
        if let Some(held) = self.held.get_mut(&hash) {
            held.uses += 1;
        }
    }

    /// Need a blob once less.
    pub(super) fn release(&mut self, hash: BlobHash) {
        if let Some(held) = self.held.get_mut(&hash) {
            held.uses -= 1;
            if held.uses == 0 {
                self.held.remove(&hash);
            }
        }
    }

    /// A blob by its name.
    pub(super) fn get(&self, hash: BlobHash) -> Option<&Blob> {
        self.held.get(&hash).map(|held| &held.blob)
    }

    /// The size of all blobs together.
    pub(super) fn bytes(&self) -> usize {
        self.held.values().map(|held| held.blob.len()).sum()
    }
}
