//! `lookalike worker`.

use crate::{cli::NotThereYet, settings::WorkerSettings};
use std::process::ExitCode;

/// Computes for a coordinator until it says stop.
pub(crate) fn run(settings: WorkerSettings) -> anyhow::Result<ExitCode> {
    tracing::debug!(?settings);
    Err(NotThereYet { what: "lookalike worker", instead: "this build has no worker" }.into())
}
