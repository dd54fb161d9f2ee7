//! The planner: decides which nodes there are.

use std::error::Error as StdError;

use thiserror::Error;

use super::{Blob, BlobHash, FailureReason, Graph, NodeId, NodeSpec};

/// Decides which nodes a run has. The run ends when no node is open.
///
/// Nodes finish in any order, so the planner is told in any order: what it makes of the outputs must depend on the
/// outputs alone, never on their order or on the numbers of the nodes.
pub trait Planner {
    /// Add the first nodes.
    ///
    /// # Errors
    /// What makes the run impossible; it ends the run.
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError>;

    /// A node has this output; more nodes may follow from it. Called once per completed node.
    ///
    /// # Errors
    /// When the output is not what it should be; it ends the run.
    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError>;

    /// A node failed. Called once per failed node, also for those that only lack its output. A planner of several fits
    /// overrides this to give up only the fit that the node belongs to.
    ///
    /// # Errors
    /// Unless overridden, an error that names the node: it ends the run.
    fn failed(&mut self, node: NodeId, reason: &FailureReason, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let (kind, label) = graph.spec(node).map(|spec| (spec.kind.clone(), spec.label.clone())).unwrap_or_default();
        Err(PlanError::NodeFailed { kind, label, reason: reason.clone() })
    }

    /// Whether a second run of this node would tell whether its output is right, for the share of nodes that a run verifies.
    /// Not worth it where [`completed`](Self::completed) computes the output's claims again. By default every node.
    fn is_verified_by_repetition(&self, spec: &NodeSpec) -> bool {
        let _ = spec;
        true
    }
}

/// What a planner may do to a graph: add to it and read from it.
#[derive(Debug)]
pub struct GraphEdit<'graph> {
    graph: &'graph mut Graph,
}

impl<'graph> GraphEdit<'graph> {
    /// Let a planner edit `graph`.
    pub fn new(graph: &'graph mut Graph) -> Self {
        Self { graph }
    }

    /// Keep a blob, so that nodes can name it as an input.
    ///
    /// # Errors
    /// When it is longer than [`MAX_BLOB_BYTES`](super::MAX_BLOB_BYTES).
    pub fn add_blob(&mut self, bytes: Vec<u8>) -> Result<BlobHash, PlanError> {
        self.graph.add_blob(bytes)
    }

    /// Add a node; nodes that are added earlier run earlier.
    ///
    /// # Errors
    /// When an input is unknown or a size limit is passed.
    pub fn add_node(&mut self, spec: NodeSpec) -> Result<NodeId, PlanError> {
        self.graph.add_node(spec)
    }

    /// The description of a node.
    #[must_use]
    pub fn spec(&self, node: NodeId) -> Option<&NodeSpec> {
        self.graph.spec(node)
    }

    /// The output of a completed node.
    #[must_use]
    pub fn output(&self, node: NodeId) -> Option<&Blob> {
        self.graph.output(node)
    }

    /// A blob by its name.
    #[must_use]
    pub fn blob(&self, hash: BlobHash) -> Option<&Blob> {
        self.graph.blob(hash)
    }
}

/// Why a plan cannot go on.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A node failed, and the planner cannot do without it.
    #[error("{kind} {label:?} failed: {reason}")]
    NodeFailed {
        /// The kind of the node.
        kind: String,
        /// Its label.
        label: String,
        /// Why it failed.
        reason: FailureReason,
    },
    /// A node names a blob that the graph does not hold.
    #[error("{label:?} wants blob {hash}, which was not added; add it before the node")]
    UnknownBlob {
        /// The label of the new node.
        label: String,
        /// The missing blob.
        hash: BlobHash,
    },
    /// A node names an input node that does not exist.
    #[error("{label:?} wants the output of {node}, which does not exist; add it before the node")]
    UnknownInput {
        /// The label of the new node.
        label: String,
        /// The missing node.
        node: NodeId,
    },
    /// Something is too large to be sent.
    #[error("{what}: expected at most {limit}, found {found}; pass large data as blobs, and split the largest")]
    TooLarge {
        /// What is too large.
        what: &'static str,
        /// Its size, in bytes or entries.
        found: usize,
        /// The largest size allowed.
        limit: usize,
    },
    /// A number in an output is not what its recomputation gives: the output is wrong, or was made for another input.
    #[error("{what} is said to be {claimed:?}, but is {recomputed:?}")]
    NotVerified {
        /// Which number, such as `the cost of gamma 1.3`.
        what: String,
        /// The number in the output.
        claimed: f64,
        /// The number that was computed again.
        recomputed: f64,
    },
    /// An output is not one of its node: it does not decode, or is of another shape, or holds values that cannot be.
    #[error("expected {expected}, found {found}")]
    WrongOutput {
        /// What the node was asked for.
        expected: String,
        /// What its output is.
        found: String,
    },
    /// The planner's own error: an output is not what it should be.
    #[error("{message}")]
    Unusable {
        /// What is wrong and what to do about it: lower case, no full stop.
        message: String,
    },
    /// The planner's own error, with its cause.
    #[error(transparent)]
    Other(Box<dyn StdError + Send + Sync>),
}

impl PlanError {
    /// An error of the planner's own with this message.
    #[must_use]
    pub fn new(message: impl Into<String>) -> Self {
        Self::Unusable { message: message.into() }
    }
}
