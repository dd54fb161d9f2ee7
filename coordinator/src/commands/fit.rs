//! `lookalike fit`.

use crate::{cli::NotThereYet, settings::FitSettings};
use std::process::ExitCode;

/// Fits a model to a photo.
pub(crate) fn run(settings: FitSettings) -> anyhow::Result<ExitCode> {
    tracing::debug!(?settings);
    Err(NotThereYet { what: "lookalike fit", instead: "this build cannot fit" }.into())
}
