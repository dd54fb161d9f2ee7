//! Events of a run for display: [`RunEvent`] and the names in them.

use std::fmt;
use std::time::Duration;

use lookalike::graph::{FailureReason, Label, NodeId, WorkerId};

/// Why a worker has left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Departure {
    /// Its connection ended without a goodbye: the process died, or the network broke.
    Lost,
    /// It was silent for too long.
    Silent,
    /// It did not read what was sent to it.
    TooSlow,
    /// Its process reconnected before this connection was found to be broken.
    Replaced,
    /// It was asked to end, and said goodbye.
    Goodbye,
    /// It broke the protocol.
    Violation(String),
}

impl Departure {
    /// Whether the nodes that the worker executed may have caused it. The exit status of a local process does not help: a
    /// node that exhausts the memory and a `kill -9` from outside leave the same status.
    #[must_use]
    pub fn is_suspicious(&self) -> bool {
        match self {
            Self::Lost | Self::Violation(_) => true,
            Self::Silent | Self::TooSlow | Self::Replaced | Self::Goodbye => false,
        }
    }
}

impl Departure {
    /// The departure as one word of a closed list, for programs.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match self {
            Self::Lost => "lost",
            Self::Silent => "silent",
            Self::TooSlow => "too-slow",
            Self::Replaced => "replaced",
            Self::Goodbye => "goodbye",
            Self::Violation(_) => "violation",
        }
    }
}

impl fmt::Display for Departure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lost => formatter.write_str("its connection ended"),
            Self::Silent => formatter.write_str("it was silent for too long"),
            Self::TooSlow => formatter.write_str("it did not read what was sent to it"),
            Self::Replaced => formatter.write_str("it reconnected"),
            Self::Goodbye => formatter.write_str("it was asked to end"),
            Self::Violation(what) => write!(formatter, "it broke the protocol: {what}"),
        }
    }
}

/// Where a node runs or ran.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Site {
    /// On a worker.
    Worker(WorkerId),
    /// In the coordinator's own process.
    Coordinator,
}

impl fmt::Display for Site {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Worker(worker) => worker.fmt(formatter),
            Self::Coordinator => formatter.write_str("the coordinator"),
        }
    }
}

/// The name of a node in events.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeName {
    /// Its number.
    pub node: NodeId,
    /// Its kind.
    pub kind: String,
    /// Its label.
    pub label: Label,
    /// The number of the part that it belongs to, in a run of [`Many`](lookalike::graph::Many) planners; otherwise 0.
    pub part: u32,
}

impl fmt::Display for NodeName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} {:?}", self.kind, self.label)
    }
}

/// An event of a run that a display may show.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum RunEvent {
    /// The coordinator listens.
    Listening {
        /// The address in the access file.
        address: String,
        /// How many local workers the coordinator starts.
        local_workers: usize,
    },
    /// The run of an earlier coordinator is resumed.
    Resumed {
        /// Counts the coordinator processes of the run, from 1.
        epoch: u64,
        /// How many nodes have their output in the journal.
        results: usize,
    },
    /// A local worker process was started.
    LocalWorkerStarted {
        /// Its process id.
        process: u32,
    },
    /// A worker has joined.
    WorkerJoined {
        /// Its number.
        worker: WorkerId,
        /// How many nodes it executes at a time.
        threads: usize,
        /// Its process id on its own machine.
        process: u32,
    },
    /// A worker has left.
    WorkerLeft {
        /// Its number.
        worker: WorkerId,
        /// Why.
        departure: Departure,
    },
    /// A worker was asked to end: it finishes the nodes that it executes and gets no others.
    WorkerDraining {
        /// Its number.
        worker: WorkerId,
    },
    /// A local worker process ended by itself.
    LocalWorkerEnded {
        /// Its process id.
        process: u32,
        /// How it ended.
        status: String,
        /// The pause before it is restarted; `None` if it is not restarted.
        restart_after: Option<Duration>,
    },
    /// There is work but no worker.
    WaitingForWorkers {
        /// How long there has been no worker.
        waited: Duration,
        /// The limit.
        limit: Duration,
    },
    /// The planner has added a node.
    NodeAdded {
        /// The node.
        name: NodeName,
    },
    /// All inputs of a node are available. Only reported for runs with a journal.
    NodeReady {
        /// The node.
        node: NodeId,
    },
    /// A node was given to a worker.
    NodeAssigned {
        /// The node.
        node: NodeId,
        /// The worker.
        worker: WorkerId,
    },
    /// A node was completed with the output that an earlier coordinator of this run recorded.
    NodeRecalled {
        /// The node.
        name: NodeName,
        /// The size of the output in bytes.
        bytes: usize,
    },
    /// The output of a node is not needed any more, not even to resume the run: only its hash is kept.
    NodeReleased {
        /// The node.
        name: NodeName,
    },
    /// A node begins to run.
    NodeStarted {
        /// The node.
        name: NodeName,
        /// Where it runs.
        site: Site,
    },
    /// The progress that a running node reports, at most a few times a second.
    NodeProgress {
        /// The node.
        node: NodeId,
        /// The completed share, in thousandths.
        permille: u16,
    },
    /// A node has its output.
    NodeFinished {
        /// The node.
        name: NodeName,
        /// Where it ran.
        site: Site,
        /// The size of the output in bytes.
        bytes: usize,
        /// The time from its start to the arrival of the output.
        elapsed: Duration,
    },
    /// A second output of a node has arrived, and is equal to the first one bit for bit.
    DuplicateResult {
        /// The node.
        node: NodeId,
        /// Where it ran.
        site: Site,
    },
    /// A node has failed, or was cancelled.
    NodeFailed {
        /// The node.
        name: NodeName,
        /// Why.
        reason: FailureReason,
    },
    /// A node has lost its worker and waits for another one.
    NodeRequeued {
        /// The node.
        name: NodeName,
        /// The worker it has lost.
        worker: WorkerId,
        /// How many workers have died while they executed it.
        crashes: u32,
    },
    /// A death was counted against this node, or was subtracted because the process reconnected.
    DeathsCounted {
        /// The node.
        name: NodeName,
        /// How many workers have died while they executed it.
        deaths: u32,
    },
    /// A node has an output from one site and an error from another, so one of the two is wrong. The first answer is used.
    AnswersDiffer {
        /// The node.
        name: NodeName,
        /// The site of the first answer.
        first: Site,
        /// The site of the second answer.
        second: Site,
        /// The error of one of them.
        error: String,
    },
    /// Workers have died while they executed this node, so from now on it runs alone.
    NodeSuspected {
        /// The node.
        name: NodeName,
        /// How many workers have died while they executed it.
        deaths: u32,
    },
    /// A slow node runs on a second worker as well.
    NodeSpeculated {
        /// The node.
        name: NodeName,
        /// The second worker.
        worker: WorkerId,
    },
    /// A blob is sent to a worker.
    BlobSent {
        /// The worker.
        worker: WorkerId,
        /// Its size in bytes.
        bytes: usize,
    },
}
