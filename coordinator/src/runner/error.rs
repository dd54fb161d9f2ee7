//! Reasons why a run ended without its result.

use std::io;
use std::net::SocketAddr;

use thiserror::Error;

use crate::access::CredentialsError;
use crate::journal::JournalError;
use crate::policy::PolicyError;
use crate::reactor::Stop;
use crate::spawn::SpawnError;

/// Reasons why a run ended without its result.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RunError {
    /// The policy is invalid.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// There are neither local workers nor an address on which others could join.
    #[error(
        "no worker can join: expected at least one local worker, or an address to listen on for others, found neither; use --workers N or --listen ADDR"
    )]
    NoWorkersPossible,
    /// The coordinator listens on every address of the machine, so it cannot tell workers which one to connect to.
    #[error("listening on {listen} gives workers no host name to connect to; add --advertise HOST[:PORT]")]
    NothingToAdvertise {
        /// The address to listen on.
        listen: SocketAddr,
    },
    /// The coordinator cannot listen.
    #[error("cannot listen on {listen}; check that the address belongs to this machine and that the port is free")]
    Listen {
        /// The address.
        listen: SocketAddr,
        /// The error of the system.
        source: io::Error,
    },
    /// The coordinator cannot listen at the address to which the run's workers connect.
    #[error(
        "cannot listen on {listen}, the address to which the workers of this run connect; end the process that uses the port, or choose another one with --listen IP:PORT and copy the new access file to the remote workers"
    )]
    PortTaken {
        /// The address.
        listen: SocketAddr,
        /// The error of the system.
        source: io::Error,
    },
    /// The journal cannot be written, or the run in it cannot be resumed.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The access file is not usable or cannot be written.
    #[error(transparent)]
    Credentials(#[from] CredentialsError),
    /// The coordinator's key does not match its certificate.
    #[error("the coordinator's key file is not usable: {0}; make a new access file with `lookalike access new`")]
    Tls(#[source] rustls::Error),
    /// The access file made beforehand names an address of another machine, so `--listen` must be given.
    #[error(
        "workers with this access file connect to {address}; give the address of this machine to listen on with --listen IP:PORT"
    )]
    ListenWhere {
        /// The address in the access file.
        address: String,
    },
    /// The operating system provides no random bytes.
    #[error("the system provides no random bytes for the name of the run: {0}")]
    Randomness(io::Error),
    /// Signal handlers cannot be installed.
    #[error("cannot listen for Ctrl-C and SIGTERM")]
    Signals(#[source] io::Error),
    /// A local worker process cannot be started at all.
    #[error(transparent)]
    Spawn(#[from] SpawnError),
    /// The run cannot continue.
    #[error(transparent)]
    Stop(#[from] Stop),
    /// The user interrupted the run.
    #[error("interrupted")]
    Interrupted,
}

impl RunError {
    /// The exit code of the program (design section 10): 2 for bad input or usage, 130 if the user interrupted it, otherwise 3
    /// for a failed run.
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
            Self::Stop(stop) => stop.exit_code(),
            Self::Interrupted => 130,
            _ => 3,
        }
    }
}
