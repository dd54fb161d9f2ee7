//! `lookalike render`.

use crate::{cli::NotThereYet, settings::RenderSettings};
use std::process::ExitCode;

/// Renders a material.
pub(crate) fn run(settings: RenderSettings) -> anyhow::Result<ExitCode> {
    tracing::debug!(?settings);
    Err(NotThereYet { what: "lookalike render", instead: "this build has no renderer" }.into())
}
