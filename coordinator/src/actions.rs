//! What the reactor asks for: an [`Outbox`] of [`Action`]s. The runner performs them with its sockets and processes; tests only read
//! them.

use lookalike::graph::{Blob, NodeId, WorkerId};
use lookalike::protocol::ProcessName;

use crate::events::RunEvent;

/// The assignment of a node to a worker. It ends with an answer, with a cancellation, or when the worker is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lease {
    /// The node.
    pub node: NodeId,
    /// Counts the assignments of this node, from 1.
    pub attempt: u32,
    /// Counts the coordinator processes of this run, from 1.
    pub epoch: u64,
}

/// A worker's process, as its hello describes it. It has one number per connection, and one name for all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorkerProcess {
    /// Its process id on its own machine, for display only: in containers every worker may have the same.
    pub id: u32,
    /// Its name, which is random, so that no other process has it.
    pub name: ProcessName,
    /// Whether a coordinator has started it, on its own machine.
    pub is_local: bool,
}

/// An action that the reactor asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Send the node of this lease to the worker.
    Assign {
        /// The worker.
        worker: WorkerId,
        /// The lease.
        lease: Lease,
    },
    /// Tell the worker that the output of this lease is not needed any more.
    Cancel {
        /// The worker.
        worker: WorkerId,
        /// The lease that has ended.
        lease: Lease,
    },
    /// Send a blob that the worker asked for.
    SendBlob {
        /// The worker.
        worker: WorkerId,
        /// The blob.
        blob: Blob,
    },
    /// A worker requested a blob that none of its leases reads any more: nothing is sent.
    ForgoBlob {
        /// The worker.
        worker: WorkerId,
    },
    /// Tell the worker that its answer has arrived.
    Acknowledge {
        /// The worker.
        worker: WorkerId,
        /// The node it answered for.
        node: NodeId,
        /// The attempt it answered for.
        attempt: u32,
    },
    /// Close the connection of this worker at once. The worker has left.
    Drop {
        /// The worker.
        worker: WorkerId,
    },
    /// Write the output of a node that has just been completed to the journal.
    Keep {
        /// The node.
        node: NodeId,
        /// Its output.
        output: Blob,
    },
    /// Stop a node that runs in the coordinator's own process, because its output is not needed any more.
    CancelHere {
        /// The node.
        node: NodeId,
    },
    /// Run this node in the coordinator's own process.
    RunHere {
        /// The node.
        node: NodeId,
        /// The attempt to answer for.
        attempt: u32,
    },
    /// Report an event to the user.
    Tell(RunEvent),
}

/// The actions to perform, in order.
#[derive(Debug, Default)]
pub struct Outbox {
    actions: Vec<Action>,
}

impl Outbox {
    /// Add an action.
    pub fn push(&mut self, action: Action) {
        self.actions.push(action);
    }

    /// Add an event to report to the user.
    pub fn tell(&mut self, event: RunEvent) {
        self.push(Action::Tell(event));
    }

    /// Take all actions, in order.
    pub fn take(&mut self) -> Vec<Action> {
        std::mem::take(&mut self.actions)
    }
}
