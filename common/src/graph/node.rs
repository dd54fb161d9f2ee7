//! Nodes: their description, their placement and their failures.

use std::fmt;

use thiserror::Error;

use super::{BlobHash, Label};

/// The longest `kind` and `label`, in bytes.
pub const MAX_NAME_BYTES: usize = 256;

/// The largest `parameters` of a node, in bytes (1 MiB): an assignment must fit into one frame of the protocol.
pub const MAX_PARAMETER_BYTES: usize = 1 << 20;

/// The most inputs of one node.
pub const MAX_INPUTS: usize = 4096;

/// A node of a graph, numbered from 0 in the order of addition. Of nodes of one priority, earlier ones run first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u64);

impl fmt::Display for NodeId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "node {}", self.0)
    }
}

/// One connection of one worker process; a worker that reconnects gets a new number. Numbers are not reused within a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WorkerId(pub u64);

impl fmt::Display for WorkerId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "worker {}", self.0)
    }
}

/// Where a node runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// On any worker process.
    Worker,
    /// In the coordinator's own process.
    Coordinator,
}

/// One input of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// A blob that the graph already holds.
    Blob(BlobHash),
    /// The output of an earlier node; the node waits for it.
    OutputOf(NodeId),
}

impl Input {
    /// The node whose output this input is.
    #[must_use]
    pub fn node(&self) -> Option<NodeId> {
        match *self {
            Self::OutputOf(node) => Some(node),
            Self::Blob(_) => None,
        }
    }
}

/// The description of a node, as a planner gives it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeSpec {
    /// The name of its [`NodeType`](super::NodeType), at most [`MAX_NAME_BYTES`].
    pub kind: String,
    /// What it is called; at most [`MAX_NAME_BYTES`].
    pub label: Label,
    /// Small parameters in the encoding of the node type; at most [`MAX_PARAMETER_BYTES`].
    pub parameters: Vec<u8>,
    /// Inputs in the order in which the node type receives them; at most [`MAX_INPUTS`].
    pub inputs: Vec<Input>,
    /// Where it runs.
    pub placement: Placement,
    /// Ready nodes run in ascending order of priority, then in the order in which they were added. Does not affect any result. In a run
    /// of [`Many`](super::Many) planners it is the number of the part, by which events assign the node to it.
    pub priority: u32,
}

/// Why an execution of a node has no output. It is not retried, because nodes are pure functions.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum NodeFailure {
    /// The node cannot compute an output from its inputs.
    #[error("{message}")]
    Application {
        /// What is wrong and what to do about it: lower case, no full stop.
        message: String,
    },
    /// The node panicked: a bug in the program, regardless of the inputs.
    #[error("it panicked: {message}; this is a bug in lookalike, please report it")]
    Panicked {
        /// The message of the panic.
        message: String,
    },
    /// The process that should run the node has no node type of its kind: a bug in the program, or a different build.
    #[error(
        "{message}; this is a bug in lookalike, please report it, unless coordinator and worker are different builds"
    )]
    UnknownKind {
        /// The unknown kind, and the known ones.
        message: String,
    },
    /// The node stopped because its output is no longer needed. Not a failure of the run.
    #[error("cancelled: its output is no longer needed")]
    Cancelled,
}

impl FailureReason {
    /// Whether this is a cancellation and not an error.
    #[must_use]
    pub fn is_cancellation(&self) -> bool {
        matches!(self, Self::Node(NodeFailure::Cancelled))
    }
}

impl NodeFailure {
    /// An application error with this message.
    #[must_use]
    pub fn new(message: impl Into<String>) -> Self {
        Self::Application { message: message.into() }
    }
}

/// Why a node will never have an output.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FailureReason {
    /// Its execution ended without an output.
    #[error("{0}")]
    Node(NodeFailure),
    /// Worker processes died while they executed it.
    #[error(
        "{crashes} worker processes died while they executed it alone; see their last lines on stderr, \
         and check whether memory ran out"
    )]
    Crashed {
        /// How many deaths were counted.
        crashes: u32,
    },
    /// A node whose output it needs has failed.
    #[error("it needs the output of {label:?} ({node}), which failed")]
    InputFailed {
        /// The input that failed.
        node: NodeId,
        /// Its label.
        label: String,
    },
}
