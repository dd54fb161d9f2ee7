//! `lookalike batch`: many fits as one run, on this machine or as a Slurm job.

use super::submit;
use crate::{
    batch,
    settings::{BatchSettings, JobSettings, OldFiles},
};
use std::process::ExitCode;

pub(crate) fn run(settings: BatchSettings) -> anyhow::Result<ExitCode> {
    batch::run(settings)
}

/// Submits the batch.
pub(crate) fn submit(settings: &BatchSettings, job: JobSettings) -> anyhow::Result<ExitCode> {
    let replace = (settings.old_files == OldFiles::Replace).then_some(|| batch::replace_old(settings));
    submit::submit(job, &settings.out, || batch::check_job(settings), replace)
}
