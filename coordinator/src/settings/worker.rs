//! The settings of `lookalike worker`.

use std::{num::NonZeroUsize, path::PathBuf, time::Duration};

/// Which coordinator to serve, and with how much of this machine.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkerSettings {
    /// The access file of the coordinator.
    pub access: PathBuf,
    /// Threads that compute; none means one per core.
    pub threads: Option<NonZeroUsize>,
    /// How long to go on trying when the coordinator does not answer.
    pub reconnect_for: Duration,
}
