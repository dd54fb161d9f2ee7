//! The job graph: typed nodes, the blobs that they read and write, and their dependencies.
//!
//! A run is a [`Graph`] of nodes. A node is a pure function of its parameters and its input blobs; its `kind` selects the [`NodeType`]
//! of the [`Registry`] that runs it. Its output becomes a blob named by its BLAKE3 hash, so equal bytes are stored and sent once, and
//! two computations of a node can be compared bit for bit. A [`Planner`] adds the nodes: it is called for each finished node
//! and may add more.
//!
//! ```text
//!   Planner --add_node--> Waiting --inputs there--> Ready --output--> Completed --> Planner::completed
//!                            |                        |
//!                            +---an input failed------+--failure--> Failed -------> Planner::failed
//! ```
//!
//! A planner holds the nodes and blobs that it adds until it releases them. Blobs that are neither held nor read by an open node are
//! dropped, so a run of hundreds of fits stores only those of the fits in progress. [`Many`] planners can share a graph.
//!
//! Payloads are opaque here, without rendering or parameters of a BRDF. This module has no workers, leases, sockets or time.
//! [`run_in_process`] runs a graph in one process: every distributed run must reproduce its result bit for bit.

mod blob;
mod context;
mod decoded;
mod edit;
mod error;
mod in_process;
mod key;
mod label;
mod many;
mod node;
mod planner;
mod registry;
mod sharing;
mod state;
mod store;

pub use blob::{Blob, BlobHash, HashMismatch, MAX_BLOB_BYTES};
pub use context::RunContext;
pub use decoded::DecodedCache;
pub use edit::GraphEdit;
pub use error::PlanError;
pub use in_process::{Execution, run_in_process};
pub use key::NodeKey;
pub use label::{Label, MAX_PART_NAME_BYTES};
pub use many::{Many, Next, Part, PartFailure, Parts};
pub use node::{
    FailureReason, Input, MAX_INPUTS, MAX_NAME_BYTES, MAX_PARAMETER_BYTES, NodeFailure, NodeId, NodeSpec, Placement,
    WorkerId,
};
pub use planner::Planner;
pub use registry::{NodeType, Registry};
pub use state::{Change, Completion, Graph, NodeState};

#[cfg(test)]
mod tests;
