//! Why the reactor ends a run.

use std::fmt;
use std::time::Duration;

use lookalike::graph::{BlobHash, FailureReason, NodeFailure, PlanError};
use thiserror::Error;

use crate::events::{NodeName, Site};

/// Why the reactor ends a run without its result.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Stop {
    /// No worker has connected.
    #[error("no worker connected in {} s; check that workers can reach the address in the access file, or wait longer with --wait-for-workers", waited.as_secs())]
    NoWorkerCame {
        /// How long there was work but no worker.
        waited: Duration,
    },
    /// All workers are lost, and no other has connected.
    #[error("all workers were lost, and no other connected in {} s; see why they ended, or wait longer with --grace", waited.as_secs())]
    LostAllWorkers {
        /// How long there was work but no worker.
        waited: Duration,
    },
    /// The local workers died repeatedly soon after their start, and no other worker can join.
    #[error("the local worker processes keep dying, the last one with {last_status}; see their messages on stderr")]
    LocalWorkersKeepDying {
        /// How the last one ended.
        last_status: String,
    },
    /// Two computations of one node had different results.
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
    /// A result is wrong, as a check of its node or a recomputation shows.
    #[error(
        "the result of {name} from {site} is wrong: {error}; use the same build everywhere, check the memory of that machine, and report this"
    )]
    WrongResult {
        /// The node.
        name: Box<NodeName>,
        /// Where the result came from.
        site: Site,
        /// The fault.
        error: PlanError,
    },
    /// The planner cannot continue, by default because a node failed.
    #[error(transparent)]
    Plan(#[from] PlanError),
}

impl Stop {
    /// The exit code of the program: 2 if a node failed because of the user's input, otherwise 3.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            // A panic or an unknown kind is a bug of this program.
            Self::Plan(PlanError::NodeFailed {
                reason: FailureReason::Node(NodeFailure::Application { .. }), ..
            }) => 2,
            _ => 3,
        }
    }
}

/// The answer of a computation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NodeAnswer {
    /// The hash of an output.
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
