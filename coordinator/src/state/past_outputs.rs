//! The outputs of earlier coordinators of a run, by key, because node numbers may differ.

use std::fmt;

use lookalike::graph::{Blob, NodeKey};

use super::deaths::Deaths;

/// What is known of a node from earlier coordinators.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// Its output, if it has one: the node need not run again.
    pub output: Option<Blob>,
    /// The workers that have died while they executed it.
    pub deaths: Deaths,
}

/// Knows the nodes of earlier coordinators of a run: the journal, or a test.
pub trait PastOutputs: fmt::Debug + Send {
    /// What is known of the nodes with this key.
    fn of(&mut self, key: NodeKey) -> Memory;
}
