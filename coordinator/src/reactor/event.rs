//! The reactor's events.

use lookalike::graph::{Blob, BlobHash, NodeFailure, NodeId, WorkerId};

use crate::actions::WorkerProcess;
use crate::events::{Departure, Site};

/// An event.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A worker was accepted.
    WorkerJoined {
        /// Its number, which is never reused.
        worker: WorkerId,
        /// How many nodes it executes at a time.
        threads: usize,
        /// Its process, which may have been connected before under another number.
        process: WorkerProcess,
    },
    /// A worker's connection has ended.
    WorkerLeft {
        /// The worker.
        worker: WorkerId,
        /// Why.
        departure: Departure,
    },
    /// A worker drains: it finishes the nodes that it executes and begins no others.
    WorkerDrains {
        /// The worker.
        worker: WorkerId,
    },
    /// Bytes have arrived from a worker that do not form a complete message yet.
    Alive {
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
    /// A node has failed with an error of its own.
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
    /// A worker requests a blob.
    BlobRequested {
        /// The worker.
        worker: WorkerId,
        /// The hash of the blob.
        hash: BlobHash,
    },
    /// The last local worker will not be restarted, and no other worker can join.
    LocalWorkersGivenUp {
        /// How the last one ended.
        last_status: String,
    },
    /// The time [`Core::next_deadline`](crate::state::Core::next_deadline) has been reached.
    DeadlinePassed,
    /// The planner may have nodes to add although no node has ended.
    LookAgain,
}

/// A node that a worker reports as executing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Executing {
    /// The node.
    pub node: NodeId,
    /// The attempt under which it was assigned, perhaps on an earlier connection.
    pub attempt: u32,
    /// The completed share, in thousandths.
    pub permille: u16,
}
