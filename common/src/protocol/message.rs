//! The messages, as they go over the wire. Changing anything here, even an order of variants, is a new
//! [`PROTOCOL_VERSION`](super::PROTOCOL_VERSION).

use serde::{Deserialize, Serialize};

/// The longest text in a message, in bytes (16 KiB); longer ones are cut by their sender.
pub const MAX_MESSAGE_TEXT_BYTES: usize = 16 << 10;

/// Names a run: random, so that a worker which finds its coordinator's address again notices that another run lives there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunName(pub [u8; 16]);

/// Names a worker process: random, made when it starts, so that one that has lost its connection is known when it comes back.
/// Its process id would not do: in containers every worker may have the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ProcessName(pub [u8; 16]);

/// Names a lease. A worker answers with the name under which it was assigned the node.
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
    /// The program's version, for messages only: compatibility is the preamble's business.
    pub build: String,
    /// How many nodes it executes at a time; at least 1.
    pub threads: u32,
    /// Its process id, for messages; that of a local worker also tells its coordinator which one it is.
    pub process: u32,
    /// The same on every connection of this process.
    pub name: ProcessName,
    /// Whether a coordinator has started it, on its own machine.
    pub is_local: bool,
}

/// The coordinator's answer to [`Hello`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Welcome {
    /// The number of this connection in this run, for messages.
    pub worker: u64,
    /// The run. A worker that comes from another run, or from an earlier epoch of this one, drops its work.
    pub run: RunName,
    /// See [`LeaseName::epoch`].
    pub epoch: u64,
    /// How often the worker shall tell that it lives, in milliseconds.
    pub heartbeat_ms: u32,
    /// A worker that has not read a byte for this long, in milliseconds, shall take the connection for broken.
    pub silence_ms: u32,
    /// How long it may take to finish what it executes when it is asked to end, in milliseconds, unless it was told
    /// otherwise.
    pub drain_ms: u32,
}

/// A node to execute.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Assignment {
    /// Under which name to answer.
    pub lease: LeaseName,
    /// The node type.
    pub kind: String,
    /// For messages.
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
    /// How much of it is done, in thousandths, as far as it says.
    pub permille: u16,
}

/// What a coordinator says to a worker.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ToWorker {
    /// You are in. The first message.
    Welcome(Welcome),
    /// Execute this.
    Assign(Assignment),
    /// The output of this node is not wanted any more; do not answer.
    Cancel(LeaseName),
    /// A blob that was fetched; its parts follow.
    Blob {
        /// Its hash.
        hash: [u8; 32],
        /// Its length in bytes.
        length: u64,
    },
    /// Your answer for this lease has arrived; forget it.
    Acknowledge(LeaseName),
    /// I live. Comes as often as a worker shall tell the same.
    Heartbeat,
    /// The run is over; end.
    Stop {
        /// Why, for messages.
        reason: String,
    },
}

/// In which way a node failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FailureKind {
    /// Its inputs do not allow an output.
    Application,
    /// It panicked.
    Panic,
    /// The worker does not know its kind.
    UnknownKind,
}

/// What a worker says to its coordinator.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ToCoordinator {
    /// Who I am. The first message.
    Hello(Hello),
    /// I live, and execute these.
    Heartbeat {
        /// The nodes in execution.
        executing: Vec<Executing>,
    },
    /// I begin to execute this.
    Started(LeaseName),
    /// Send me this blob.
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
    /// This node has no output, and would have none on any worker.
    Failed {
        /// The lease.
        lease: LeaseName,
        /// In which way it failed.
        kind: FailureKind,
        /// What is wrong.
        message: String,
    },
    /// I leave because I was asked to, not because of what I executed.
    Goodbye,
    /// I was asked to end: I finish what I execute, as far as there is time, and begin with nothing more. What I have not said to
    /// have started may go elsewhere.
    Draining,
}

/// `text`, cut to [`MAX_MESSAGE_TEXT_BYTES`] at a character's edge.
#[must_use]
pub fn bounded_text(text: &str) -> String {
    text[..text.floor_char_boundary(MAX_MESSAGE_TEXT_BYTES)].to_owned()
}
