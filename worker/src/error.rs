//! Why a worker ended before its coordinator ended the run.

use std::error::Error;
use std::io;
use std::path::PathBuf;
use std::time::Duration;

use lookalike::protocol::AccessError;
use thiserror::Error;

use crate::wire::WireError;

/// Why a worker ended before its coordinator ended the run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WorkerError {
    /// The access file cannot be read.
    #[error("cannot read the access file {}", path.display())]
    AccessFile {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// The file is not an access file.
    #[error("the access file {} is not usable", path.display())]
    AccessContent {
        /// The file.
        path: PathBuf,
        /// The error in it.
        source: AccessError,
    },
    /// The coordinator refuses this worker, or the two are incompatible. A retry would fail again.
    #[error("cannot join the coordinator at {address}")]
    Refused {
        /// Where the coordinator should be.
        address: String,
        /// Why: [`WireError::is_final`].
        source: WireError,
    },
    /// The coordinator cannot be reached any more.
    #[error("gave up on the coordinator at {address}: no connection for {} s", after.as_secs())]
    CoordinatorLost {
        /// Where the coordinator should be.
        address: String,
        /// How long the worker tried.
        after: Duration,
        /// The last error.
        source: WireError,
    },
    /// The compute threads cannot be started.
    #[error("cannot start the compute threads")]
    Pool(#[from] rayon::ThreadPoolBuildError),
    /// The system provides no event loop, thread or signal handler.
    #[error("cannot start the worker's own threads")]
    Runtime(#[source] io::Error),
}

impl WorkerError {
    /// The exit code of the process: 2 if a retry would fail too, otherwise 3.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::AccessFile { .. } | Self::AccessContent { .. } | Self::Refused { .. } => 2,
            Self::CoordinatorLost { .. } | Self::Pool(_) | Self::Runtime(_) => 3,
        }
    }
}

/// The message of an error and its causes in one line.
#[must_use]
pub fn with_causes(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text = format!("{text}: {error}");
        cause = error.source();
    }
    text
}
