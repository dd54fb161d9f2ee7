//! Which worker processes have executed something: the death of such a one may be a node's doing, which is judged elsewhere.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

/// The processes of local workers that have executed a node.
#[derive(Clone, Debug, Default)]
pub(crate) struct Worked(Arc<Mutex<BTreeSet<u32>>>);

impl Worked {
    /// This process executes a node.
    pub(crate) fn note(&self, process: u32) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(process);
    }

    /// Whether this process, which has ended, has executed a node. Its number may come again.
    pub(super) fn take(&self, process: u32) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).remove(&process)
    }
}
