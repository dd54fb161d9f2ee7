//! The outputs of earlier coordinators of a run, by key, because node numbers may differ.

use std::fmt;

use lookalike::graph::{Blob, NodeKey};

use super::deaths::Deaths;

/// The data of earlier coordinators about a node.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// Its output. If it has one, the node need not run again.
    pub output: Option<Blob>,
    /// The deaths of workers that executed it.
    pub deaths: Deaths,
}

/// A source of the outputs of earlier coordinators: the journal, or a test.
pub trait PastOutputs: fmt::Debug + Send {
    /// The data about the nodes with this key.
    fn of(&mut self, key: NodeKey) -> Memory;
}
