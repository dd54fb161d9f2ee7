//! Node types by name. A new kind of node needs one implementation of [`NodeType`] and one call of [`Registry::with`].

use std::any::Any;
use std::collections::BTreeMap;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use super::{Blob, MAX_BLOB_BYTES, NodeFailure, RunContext};

/// One kind of node: a pure function from parameters and input blobs to output bytes.
///
/// Pure means that the same parameters and inputs give the same bytes on any machine, with any number of threads, in any order. Results
/// of two workers are compared, and a difference ends the run.
pub trait NodeType: Send + Sync {
    /// The name of this type in specifications; at most [`MAX_NAME_BYTES`](super::MAX_NAME_BYTES).
    fn kind(&self) -> &'static str;

    /// Compute the output, at most [`MAX_BLOB_BYTES`] long. Runs on a rayon pool, so parallel iterators use its threads.
    ///
    /// # Errors
    /// If there is no output for these inputs. The error is shown to the user; the node is not retried.
    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure>;
}

/// The node types that a process can run. Coordinator and workers of a run must have the same ones.
#[derive(Clone, Default)]
pub struct Registry {
    types: BTreeMap<&'static str, Arc<dyn NodeType>>,
}

impl Registry {
    /// This registry with one more node type.
    ///
    /// # Panics
    /// If its kind is already registered, which is a bug in the program.
    #[must_use]
    pub fn with(mut self, node_type: impl NodeType + 'static) -> Self {
        let kind = node_type.kind();
        let replaced = self.types.insert(kind, Arc::new(node_type));
        assert!(replaced.is_none(), "two node types are named {kind:?}");
        self
    }

    /// The known kinds, in alphabetical order.
    pub fn kinds(&self) -> impl Iterator<Item = &'static str> {
        self.types.keys().copied()
    }

    /// Run one node and hash its output. A panic of the node is caught and becomes a failure.
    ///
    /// # Errors
    /// The failure of the node; an unknown kind; a panic; an output longer than [`MAX_BLOB_BYTES`].
    pub fn run(
        &self,
        kind: &str,
        parameters: &[u8],
        inputs: &[Blob],
        context: &RunContext,
    ) -> Result<Blob, NodeFailure> {
        let Some(node_type) = self.types.get(kind) else {
            let known: Vec<_> = self.kinds().collect();
            let message = format!("unknown node kind {kind:?}, this process knows {known:?}");
            return Err(NodeFailure::UnknownKind { message });
        };
        // Unwind safety: a node only reads its arguments; the context has atomics and a cache that tolerates panics.
        let output = catch_unwind(AssertUnwindSafe(|| node_type.run(parameters, inputs, context)))
            .unwrap_or_else(|panic| Err(NodeFailure::Panicked { message: panic_text(&*panic).to_owned() }))?;
        if output.len() > MAX_BLOB_BYTES {
            let found = output.len();
            return Err(NodeFailure::new(format!(
                "expected an output of at most {MAX_BLOB_BYTES} bytes, found {found}; split the node into shards"
            )));
        }
        Ok(Blob::new(output))
    }
}

impl fmt::Debug for Registry {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_set().entries(self.kinds()).finish()
    }
}

fn panic_text(panic: &(dyn Any + Send)) -> &str {
    let literal = panic.downcast_ref::<&str>().copied();
    literal.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}
