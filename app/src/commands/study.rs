//! `lookalike study`: the paper's experiments as one run, on this machine or as a Slurm job.

use super::submit;
use crate::{
    settings::{JobSettings, OldFiles, StudySettings},
    study,
};
use std::process::ExitCode;

pub(crate) fn run(settings: StudySettings) -> anyhow::Result<ExitCode> {
    study::run(settings)
}

/// Submits the study.
pub(crate) fn submit(settings: &StudySettings, job: JobSettings) -> anyhow::Result<ExitCode> {
    let replace = (settings.old_files == OldFiles::Replace).then_some(|| study::replace_old(settings));
    submit::submit(job, &settings.out, || study::check_job(settings), replace)
}
