//! The access of a planner to a graph: add nodes and blobs, read outputs, release what is no longer needed.

use super::{Blob, BlobHash, Graph, NodeId, NodeSpec, PlanError, sharing::PartEdit};

/// The access of a planner to a graph.
///
/// Every node and blob that a planner adds is held for it until it is released. A node that is not held and that no open node waits for
/// is cancelled; a blob that is not held and that no open node reads is dropped. A planner that never releases anything is correct, but
/// uses more memory.
#[derive(Debug)]
pub struct GraphEdit<'graph> {
    graph: &'graph mut Graph,
    /// The part of a run of many planners on whose behalf the graph is edited.
    part: Option<PartEdit<'graph>>,
}

impl<'graph> GraphEdit<'graph> {
    /// The access of the only planner of `graph`.
    pub fn new(graph: &'graph mut Graph) -> Self {
        Self { graph, part: None }
    }

    /// The access of one of several planners of the same graph.
    pub(super) fn on_behalf<'part>(&'part mut self, part: PartEdit<'part>) -> GraphEdit<'part> {
        GraphEdit { graph: self.graph, part: Some(part) }
    }

    /// Hold a blob, so that nodes can name it as an input.
    ///
    /// # Errors
    /// When it is longer than [`MAX_BLOB_BYTES`](super::MAX_BLOB_BYTES).
    pub fn add_blob(&mut self, bytes: Vec<u8>) -> Result<BlobHash, PlanError> {
        self.keep(Blob::new(bytes))
    }

    /// As [`add_blob`](Self::add_blob), for a blob that is already hashed, because hashing a large one takes time and several planners
    /// may share it.
    ///
    /// # Errors
    /// When it is longer than [`MAX_BLOB_BYTES`](super::MAX_BLOB_BYTES).
    pub fn keep(&mut self, blob: Blob) -> Result<BlobHash, PlanError> {
        match &mut self.part {
            Some(part) => part.keep(self.graph, blob),
            None => self.graph.add(blob),
        }
    }

    /// Add a node. Ready nodes run in ascending order of [`priority`](NodeSpec::priority), then in the order in which they were added.
    /// With several planners, the returned node may be one that another planner has added: with the same kind, parameters, inputs and
    /// placement it has the same output.
    ///
    /// # Errors
    /// If an input is unknown or was released, or a size limit is exceeded.
    pub fn add_node(&mut self, spec: NodeSpec) -> Result<NodeId, PlanError> {
        match &mut self.part {
            Some(part) => part.add_node(self.graph, spec),
            None => self.graph.add_node(spec),
        }
    }

    /// Release a node. Afterwards the planner must neither read its output nor add a node that reads it.
    pub fn release(&mut self, node: NodeId) {
        match &mut self.part {
            Some(part) => part.release(self.graph, node),
            None => self.graph.release(node),
        }
    }

    /// Release a blob that was added.
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

    /// A blob by its hash.
    #[must_use]
    pub fn blob(&self, hash: BlobHash) -> Option<&Blob> {
        self.graph.blob(hash)
    }

    /// How many nodes placed on workers are ready or running.
    #[must_use]
    pub fn ready_for_workers(&self) -> usize {
        self.graph.ready_for_workers()
    }

    pub(super) fn graph(&mut self) -> &mut Graph {
        self.graph
    }
}
