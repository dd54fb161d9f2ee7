//! What earlier coordinators of a run have left for this one: asked for by key, because node numbers may differ.

use std::fmt;

use lookalike::graph::{Blob, NodeKey};

use super::deaths::Deaths;

/// What is known of a node from earlier.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// Its output, if it has one: the node need not run again.
    pub output: Option<Blob>,
    /// The workers that have died while they executed it.
    pub deaths: Deaths,
}

/// Remembers the nodes of earlier coordinators of a run: the journal, or a test.
pub trait Recall: fmt::Debug + Send {
    /// What is known of the nodes with this key.
    fn recall(&mut self, key: NodeKey) -> Memory;
}
