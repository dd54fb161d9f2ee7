//! `lookalike study`: the paper's experiments as one run, on this machine or as a Slurm job.

use super::submit;
use crate::{
    settings::{JobSettings, StudySettings},
    study,
};
use std::process::ExitCode;

pub(crate) fn run(settings: StudySettings) -> anyhow::Result<ExitCode> {
    study::run(settings)
}

/// Submits the study.
pub(crate) fn submit(settings: &StudySettings, job: JobSettings) -> anyhow::Result<ExitCode> {
    submit::submit(job, &settings.out, || study::prepare_job(settings))
}
