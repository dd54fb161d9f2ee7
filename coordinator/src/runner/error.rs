//! Why a run ended without its result.

use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use lookalike::graph::{BlobHash, FailureReason, NodeFailure, PlanError};
use thiserror::Error;

use crate::access::CredentialsError;
use crate::events::{NodeName, Site};
use crate::journal::JournalError;
use crate::policy::PolicyError;

/// Why a run ended without its result.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RunError {
    /// The policy makes no sense.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// Neither local workers nor an address where others could join.
    #[error(
        "no worker can ever join: expected at least one local worker, or an address to listen on for others, found neither; use --workers N or --listen ADDR"
    )]
    NoWorkersPossible,
    /// The address to listen on is every address of the machine, and nobody knows what the others call it.
    #[error("listening on {listen} tells workers no host name to connect to; add --advertise HOST[:PORT]")]
    NothingToAdvertise {
        /// The address to listen on.
        listen: SocketAddr,
    },
    /// The coordinator cannot listen.
    #[error("cannot listen on {listen}; is the address this machine's, and the port free?")]
    Listen {
        /// The address.
        listen: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// The coordinator cannot listen where the workers of its run look for it.
    #[error(
        "cannot listen on {listen}, where the workers of this run look for their coordinator; end the process that has the port, or name another one with --listen IP:PORT, which workers elsewhere have to be told"
    )]
    PortTaken {
        /// The address.
        listen: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// The run cannot be written down, or not gone on with.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// There is no usable access file, or none can be written.
    #[error(transparent)]
    Credentials(#[from] CredentialsError),
    /// The coordinator's key is not that of its certificate.
    #[error("the coordinator's key file is not usable: {0}; make a new access file with `lookalike access new`")]
    Tls(#[source] rustls::Error),
    /// The access file made beforehand says where workers connect to, but not where that arrives.
    #[error(
        "workers with this access file connect to {address}; say on which address of this machine they arrive with --listen IP:PORT"
    )]
    ListenWhere {
        /// What the access file says.
        address: String,
    },
    /// The operating system gives no random bytes.
    #[error("the system gives no random bytes for the name of the run: {0}")]
    Randomness(io::Error),
    /// Nobody can be told to stop.
    #[error("cannot listen for Ctrl-C and SIGTERM")]
    Signals(#[source] io::Error),
    /// A local worker process cannot be started at all.
    #[error("cannot start a worker process of {}", program.display())]
    Spawn {
        /// The program.
        program: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// No worker has come.
    #[error("no worker has come in {} s; check that workers can reach the address in the access file, or wait longer with --wait-for-workers", waited.as_secs())]
    NoWorkerCame {
        /// How long there was work but no worker.
        waited: Duration,
    },
    /// All workers are gone, and no new one has come.
    #[error("all workers were lost, and no other has come in {} s; see why they ended, or wait longer with --grace", waited.as_secs())]
    LostAllWorkers {
        /// How long there was work but no worker.
        waited: Duration,
    },
    /// The local workers die whenever they are started.
    #[error("the local worker processes keep dying, the last one with {last_status}; see their lines on stderr")]
    LocalWorkersKeepDying {
        /// How the last one ended.
        last_status: String,
    },
    /// Two computations of one node gave different outputs.
    #[error(
        "two results of {name} differ ({first} from {first_site}, {second} from {second_site}), so neither can be trusted; use the same build everywhere, check the memory of these machines, and report this"
    )]
    ResultsDiffer {
        /// The node.
        name: Box<NodeName>,
        /// Where the first result came from.
        first_site: Site,
        /// The first result.
        first: NodeAnswer,
        /// Where the second result came from.
        second_site: Site,
        /// The second result.
        second: NodeAnswer,
    },
    /// A result is not what its node or its recomputation gives.
    #[error(
        "the result of {name} from {site} is wrong: {error}; use the same build everywhere, check the memory of that machine, and report this"
    )]
    WrongResult {
        /// The node.
        name: Box<NodeName>,
        /// Where the result came from.
        site: Site,
        /// What is wrong with it.
        error: PlanError,
    },
    /// The planner cannot go on, by default because a node failed.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The user interrupted the run.
    #[error("interrupted")]
    Interrupted,
}

/// What a computation of a node came to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NodeAnswer {
    /// An output of this name.
    Output(BlobHash),
    /// An error.
    Failure(Box<NodeFailure>),
}

impl fmt::Display for NodeAnswer {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Output(hash) => write!(formatter, "output {hash:?}"),
            Self::Failure(failure) => write!(formatter, "the error {:?}", failure.to_string()),
        }
    }
}

impl RunError {
    /// The exit code of the program (design section 10): 2 for bad input or usage, 130 when interrupted, else 3: the
    /// cluster failed.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Policy(_)
            | Self::NoWorkersPossible
            | Self::NothingToAdvertise { .. }
            | Self::Listen { .. }
            | Self::PortTaken { .. }
            | Self::ListenWhere { .. }
            | Self::Tls(_) => 2,
            Self::Credentials(error) => error.exit_code(),
            Self::Journal(error) => error.exit_code(),
            // What a node says of its inputs is about the user's; a panic or an unknown kind is our own mistake.
            Self::Plan(PlanError::NodeFailed {
                reason: FailureReason::Node(NodeFailure::Application { .. }), ..
            }) => 2,
            Self::Interrupted => 130,
            _ => 3,
        }
    }
}
