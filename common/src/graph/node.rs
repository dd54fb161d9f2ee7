//! What a node is: its description, its place and the ways it can fail.

use std::fmt;

use thiserror::Error;

use super::BlobHash;

/// The longest `kind` and `label`, in bytes.
pub const MAX_NAME_BYTES: usize = 256;

/// The largest `parameters` of a node, in bytes (1 MiB): an assignment has to fit into one frame of the wire.
pub const MAX_PARAMETER_BYTES: usize = 1 << 20;

/// The most inputs of one node.
pub const MAX_INPUTS: usize = 4096;

/// A node of a graph, numbered from 0 in the order of addition, which is also its priority: earlier nodes run first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u64);

impl fmt::Display for NodeId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "node {}", self.0)
    }
}

/// One connection of one worker process; a worker that reconnects gets a new one. Never used twice in a run.
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

/// The description of a node, as a planner gives it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeSpec {
    /// The name of its [`NodeType`](super::NodeType), at most [`MAX_NAME_BYTES`].
    pub kind: String,
    /// What people read, such as `search gamma 1.3`; at most [`MAX_NAME_BYTES`]; reaches no result.
    pub label: String,
    /// Small parameters, encoded as the node type wants them; at most [`MAX_PARAMETER_BYTES`].
    pub parameters: Vec<u8>,
    /// Input blobs in the order in which the node type gets them; at most [`MAX_INPUTS`].
    pub inputs: Vec<Input>,
    /// Where it runs.
    pub placement: Placement,
}

/// Why a node gave no output. Nodes are pure functions, so it is never retried.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum NodeFailure {
    /// The node cannot compute its output: its inputs do not allow one.
    #[error("{message}")]
    Application {
        /// What is wrong and what to do about it: lower case, no full stop.
        message: String,
    },
    /// The node panicked: a mistake in the program, whatever its inputs are.
    #[error("it panicked: {message}; this is a bug in lookalike, please report it")]
    Panicked {
        /// What the panic said.
        message: String,
    },
    /// The process that should run the node has no node type of its kind: a mistake in the program, or another build.
    #[error(
        "{message}; this is a bug in lookalike, please report it, unless coordinator and worker are not of one build"
    )]
    UnknownKind {
        /// Which kind, and which there are.
        message: String,
    },
    /// The node noticed that nobody wants its output any more and gave up. Not a failure of the run.
    #[error("cancelled: its output is not wanted any more")]
    Cancelled,
}

impl NodeFailure {
    /// An application error with this message.
    #[must_use]
    pub fn new(message: impl Into<String>) -> Self {
        Self::Application { message: message.into() }
    }
}

/// Why a node has no output and never will.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FailureReason {
    /// Its execution ended without an output.
    #[error("{0}")]
    Node(NodeFailure),
    /// Worker processes died while they executed it.
    #[error(
        "{crashes} worker processes died while they executed it and nothing else; see their last lines on stderr, \
         and whether memory ran out"
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
