//! `lookalike batch`: many fits as one run.

use crate::{batch, settings::BatchSettings};
use std::process::ExitCode;

pub(crate) fn run(settings: BatchSettings) -> anyhow::Result<ExitCode> {
    batch::run(settings)
}
