//! What the reactor is told.

use lookalike::graph::{Blob, BlobHash, NodeFailure, NodeId, WorkerId};

use crate::actions::WorkerProcess;
use crate::events::{Departure, Site};

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A worker has said hello and was welcomed.
    WorkerJoined {
        /// Its number, never used before.
        worker: WorkerId,
        /// How many nodes it executes at a time.
        threads: usize,
        /// Its process, which may have been here before under another number.
        process: WorkerProcess,
    },
    /// A worker's connection is gone.
    WorkerLeft {
        /// The worker.
        worker: WorkerId,
        /// Why.
        departure: Departure,
    },
    /// A worker drains: it finishes what it executes and begins nothing more.
    WorkerDrains {
        /// The worker.
        worker: WorkerId,
    },
    /// A heartbeat of a worker, with the nodes that it executes.
    Heartbeat {
        /// The worker.
        worker: WorkerId,
        /// The nodes it executes.
        executing: Vec<Executing>,
    },
    /// A worker begins to execute a node.
    Started {
        /// The worker.
        worker: WorkerId,
        /// The node.
        node: NodeId,
        /// The attempt under which it was assigned.
        attempt: u32,
    },
    /// A node has an output; its hash was verified.
    Finished {
        /// Where it ran.
        site: Site,
        /// The node.
        node: NodeId,
        /// The attempt under which it was assigned.
        attempt: u32,
        /// The output.
        output: Blob,
    },
    /// A node has no output and never will: its own error.
    Failed {
        /// Where it ran.
        site: Site,
        /// The node.
        node: NodeId,
        /// The attempt under which it was assigned.
        attempt: u32,
        /// The error.
        failure: NodeFailure,
    },
    /// A worker wants a blob.
    BlobRequested {
        /// The worker.
        worker: WorkerId,
        /// The name of the blob.
        hash: BlobHash,
    },
    /// The last local worker will not be restarted, and no other worker can join.
    LocalWorkersGivenUp {
        /// How the last one ended.
        last_status: String,
    },
    /// The time of [`Core::next_deadline`] has come.
    DeadlinePassed,
    /// The planner may have more to add, though no node has ended.
    LookAgain,
}

/// A node that a worker reports as executing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Executing {
    /// The node.
    pub node: NodeId,
    /// The attempt under which it was assigned, perhaps on an earlier connection.
    pub attempt: u32,
    /// How much of it is done, in thousandths.
    pub permille: u16,
}
