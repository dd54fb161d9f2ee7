//! Errors of planners and of the graphs that they edit.

use std::error::Error as StdError;

use thiserror::Error;

use super::{BlobHash, FailureReason, NodeId};

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
    /// A node names an input node whose output was released.
    #[error(
        "{label:?} wants the output of {node}, which was released; release a node after the last one that reads it was added"
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
