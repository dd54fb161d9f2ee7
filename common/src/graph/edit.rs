//! What a planner may do to a graph: add to it, read from it, and let go of what it needs no more.

use super::{Blob, BlobHash, Graph, NodeId, NodeSpec, PlanError, sharing::PartEdit};

/// What a planner may do to a graph.
///
/// Everything that a planner adds is held for it until it is released. A node that nobody holds and that no open node waits for is
/// cancelled; a blob that nobody holds and that no open node reads is let go. A planner that never releases anything keeps
/// everything to the end of the run, which is a mistake only of memory.
#[derive(Debug)]
pub struct GraphEdit<'graph> {
    graph: &'graph mut Graph,
    /// The part of a run of many planners on whose behalf the graph is edited.
    part: Option<PartEdit<'graph>>,
}

impl<'graph> GraphEdit<'graph> {
    /// Let a planner edit `graph`.
    pub fn new(graph: &'graph mut Graph) -> Self {
        Self { graph, part: None }
    }

    /// The same graph on behalf of one of several planners.
    pub(super) fn on_behalf<'part>(&'part mut self, part: PartEdit<'part>) -> GraphEdit<'part> {
        GraphEdit { graph: self.graph, part: Some(part) }
    }

    /// Keep a blob, so that nodes can name it as an input.
    ///
    /// # Errors
    /// When it is longer than [`MAX_BLOB_BYTES`](super::MAX_BLOB_BYTES).
    pub fn add_blob(&mut self, bytes: Vec<u8>) -> Result<BlobHash, PlanError> {
        self.keep(Blob::new(bytes))
    }

    /// Keep a blob that was hashed before: large ones cost time, and several planners may share one.
    ///
    /// # Errors
    /// When it is longer than [`MAX_BLOB_BYTES`](super::MAX_BLOB_BYTES).
    pub fn keep(&mut self, blob: Blob) -> Result<BlobHash, PlanError> {
        match &mut self.part {
            Some(part) => part.keep(self.graph, blob),
            None => self.graph.add(blob),
        }
    }

    /// Add a node. Of the nodes that are ready, those of the lowest [`priority`](NodeSpec::priority) run first, then those that
    /// were added first. On behalf of one of several planners, a node that another one has added may be given back: with
    /// the same kind, parameters, inputs and place it has the same output.
    ///
    /// # Errors
    /// When an input is unknown or was released, or a size limit is passed.
    pub fn add_node(&mut self, spec: NodeSpec) -> Result<NodeId, PlanError> {
        match &mut self.part {
            Some(part) => part.add_node(self.graph, spec),
            None => self.graph.add_node(spec),
        }
    }

    /// Hold a node no more: neither read its output again nor add a node that reads it.
    pub fn release(&mut self, node: NodeId) {
        match &mut self.part {
            Some(part) => part.release(self.graph, node),
            None => self.graph.release(node),
        }
    }

    /// Hold a blob that was added no more.
    pub fn release_blob(&mut self, hash: BlobHash) {
        match &mut self.part {
            Some(part) => part.release_blob(self.graph, hash),
            None => self.graph.release_blob(hash),
        }
    }

    /// The description of a node.
    #[must_use]
    pub fn spec(&self, node: NodeId) -> Option<&NodeSpec> {
        self.graph.spec(node)
    }

    /// The output of a completed node, unless it was released.
    #[must_use]
    pub fn output(&self, node: NodeId) -> Option<&Blob> {
        self.graph.output(node)
    }

    /// A blob by its name.
    #[must_use]
    pub fn blob(&self, hash: BlobHash) -> Option<&Blob> {
        self.graph.blob(hash)
    }

    /// How many nodes are ready or running, of those that workers run.
    #[must_use]
    pub fn ready_for_workers(&self) -> usize {
        self.graph.ready_for_workers()
    }

    pub(super) fn graph(&mut self) -> &mut Graph {
        self.graph
    }
}
