//! Errors of planners and of the graphs that they edit.

use std::error::Error as StdError;

use thiserror::Error;

use super::{BlobHash, FailureReason, NodeId};

/// Why a plan cannot continue.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A node failed whose output the planner needs.
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
    #[error("{label:?} needs blob {hash}, which was not added; add it before the node")]
    UnknownBlob {
        /// The label of the new node.
        label: String,
        /// The missing blob.
        hash: BlobHash,
    },
    /// A node names an input node that does not exist.
    #[error("{label:?} needs the output of {node}, which does not exist; add it before this node")]
    UnknownInput {
        /// The label of the new node.
        label: String,
        /// The missing node.
        node: NodeId,
    },
    /// A node names an input node whose output was released.
    #[error(
        "{label:?} needs the output of {node}, which was released; release a node only after adding every node that reads it"
    )]
    Released {
        /// The label of the new node.
        label: String,
        /// The node without an output.
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
    /// A number in an output differs from its recomputation: the output is wrong, or was computed from another input.
    #[error("{what}: the output says {claimed:?}, recomputation gives {recomputed:?}")]
    NotVerified {
        /// Which number, such as `the cost of gamma 1.3`.
        what: String,
        /// The number in the output.
        claimed: f64,
        /// The number that was computed again.
        recomputed: f64,
    },
    /// An output that its node cannot have: it does not decode, has another shape, or has impossible values.
    #[error("expected {expected}, found {found}")]
    WrongOutput {
        /// The output that was requested.
        expected: String,
        /// The output that was received.
        found: String,
    },
    /// An error of the planner itself.
    #[error("{message}")]
    Unusable {
        /// What is wrong and what to do about it: lower case, no full stop.
        message: String,
    },
    /// An error of the planner itself, with its cause.
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
