//! The messages of the protocol. Any change here, even of the order of variants, requires a new
//! [`PROTOCOL_VERSION`](super::PROTOCOL_VERSION).

use serde::{Deserialize, Serialize};

/// The longest text in a message, in bytes (16 KiB); the sender truncates longer ones.
pub const MAX_MESSAGE_TEXT_BYTES: usize = 16 << 10;

/// Identifies a run. It is random, so that a reconnecting worker notices if another run uses its coordinator's address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunName(pub [u8; 16]);

/// Identifies a worker process. It is drawn at random when the process starts, so that the coordinator recognises the process when it
/// reconnects. A process id is not enough, because in containers every worker may have the same one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ProcessName(pub [u8; 16]);

/// Identifies a lease. The answer of a worker has the name of the lease under which the node was assigned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeaseName {
    /// The node's number in the job graph.
    pub node: u64,
    /// Counts the assignments of this node, from 1.
    pub attempt: u32,
    /// Counts the coordinator processes of this run, from 1: a resumed run has a new one.
    pub epoch: u64,
}

/// The first message of a worker.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// The program's version, for display only; the preamble checks compatibility.
    pub build: String,
    /// How many nodes the worker executes at a time; at least 1.
    pub threads: u32,
    /// Its process id, for display; the coordinator also uses it to recognise its local workers.
    pub process: u32,
    /// The name of the process, the same on all its connections.
    pub name: ProcessName,
    /// Whether the coordinator started it on its own machine.
    pub is_local: bool,
}

/// The coordinator's answer to [`Hello`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Welcome {
    /// The number of this connection in this run, for display.
    pub worker: u64,
    /// The run. A worker that comes from another run, or from an earlier epoch of this one, drops its work.
    pub run: RunName,
    /// See [`LeaseName::epoch`].
    pub epoch: u64,
    /// Interval of the worker's heartbeats, in milliseconds.
    pub heartbeat_ms: u32,
    /// After this time without a received byte, in milliseconds, the worker must treat the connection as broken.
    pub silence_ms: u32,
    /// How long the worker may take to finish its running nodes when it is asked to end, in milliseconds, unless its own options give
    /// another time.
    pub drain_ms: u32,
}

/// A node to execute.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Assignment {
    /// The lease to name in the answer.
    pub lease: LeaseName,
    /// The node type.
    pub kind: String,
    /// The node's label, for display.
    pub label: String,
    /// The node's parameters.
    pub parameters: Vec<u8>,
    /// The hashes of its input blobs, in order. The worker fetches those that it does not have.
    pub inputs: Vec<[u8; 32]>,
}

/// A node in execution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Executing {
    /// Its lease.
    pub lease: LeaseName,
    /// Its last reported progress, in thousandths.
    pub permille: u16,
}

/// A message from the coordinator to a worker.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ToWorker {
    /// The worker is accepted. The first message.
    Welcome(Welcome),
    /// Execute this node.
    Assign(Assignment),
    /// The output of this node is no longer needed; do not answer.
    Cancel(LeaseName),
    /// A blob that the worker has requested; its parts follow.
    Blob {
        /// Its hash.
        hash: [u8; 32],
        /// Its length in bytes.
        length: u64,
    },
    /// The answer for this lease has been received; the worker can drop it.
    Acknowledge(LeaseName),
    /// A heartbeat, at the same interval as the worker's.
    Heartbeat,
    /// The run is over; the worker must end.
    Stop {
        /// The reason, for display.
        reason: String,
    },
}

/// The way in which a node failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FailureKind {
    /// It has no output for its inputs.
    Application,
    /// It panicked.
    Panic,
    /// The worker does not know its kind.
    UnknownKind,
}

/// A message from a worker to the coordinator.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ToCoordinator {
    /// The identity of the worker. The first message.
    Hello(Hello),
    /// A heartbeat.
    Heartbeat {
        /// The nodes in execution.
        executing: Vec<Executing>,
    },
    /// The worker starts to execute this node.
    Started(LeaseName),
    /// A request for a blob.
    Fetch {
        /// Its hash.
        hash: [u8; 32],
    },
    /// The output of this node; its parts follow.
    Finished {
        /// The lease.
        lease: LeaseName,
        /// The hash of the output.
        hash: [u8; 32],
        /// Its length in bytes.
        length: u64,
    },
    /// This node has failed, and would fail on any worker.
    Failed {
        /// The lease.
        lease: LeaseName,
        /// In which way it failed.
        kind: FailureKind,
        /// The error.
        message: String,
    },
    /// The worker disconnects because it was asked to, not because of a node that it executed.
    Goodbye,
    /// The worker was asked to end: it finishes its running nodes if there is time, and starts no more. Nodes that it has not reported as
    /// started can be assigned to other workers.
    Draining,
}

/// `text`, truncated to [`MAX_MESSAGE_TEXT_BYTES`] at a character boundary.
#[must_use]
pub fn bounded_text(text: &str) -> String {
    text[..text.floor_char_boundary(MAX_MESSAGE_TEXT_BYTES)].to_owned()
}
