//! `lookalike demo`.

use crate::{cli::NotThereYet, settings::DemoSettings};
use std::process::ExitCode;

/// Fits the bundled scene.
pub(crate) fn run(settings: DemoSettings) -> anyhow::Result<ExitCode> {
    tracing::debug!(?settings);
    Err(NotThereYet { what: "lookalike demo", instead: "this build cannot fit" }.into())
}
