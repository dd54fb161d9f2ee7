//! The worker processes that have executed something. A node may have caused the death of such a worker, which the reactor
//! judges.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

/// The local worker processes that have executed a node.
#[derive(Clone, Debug, Default)]
pub(crate) struct Worked(Arc<Mutex<BTreeSet<u32>>>);

impl Worked {
    /// Record that this process executes a node.
    pub(crate) fn note(&self, process: u32) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(process);
    }

    /// Whether this process, which has ended, executed a node. Forgets it, because the system may reuse its number.
    pub(super) fn take(&self, process: u32) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).remove(&process)
    }
}
