//! `lookalike batch`: many fits as one run, here or as a job of Slurm.

use crate::{
    batch,
    outputs::print_result,
    settings::{BatchSettings, JobSettings},
    slurm::{SlurmJob, command_line},
};
use anyhow::Context;
use std::{env, path, process::ExitCode};

pub(crate) fn run(settings: BatchSettings) -> anyhow::Result<ExitCode> {
    batch::run(settings)
}

/// Submits the batch. What can be told to be wrong is told now, and not when the job's turn comes.
pub(crate) fn submit(settings: &BatchSettings, job: JobSettings) -> anyhow::Result<ExitCode> {
    let job = SlurmJob {
        command: command_line(&job.typed)?,
        program: env::current_exe().context("the system does not tell where this program is")?,
        folder: env::current_dir().context("the current folder cannot be told")?,
        options: job.options,
        out: path::absolute(&settings.out).context("--out")?,
    };
    job.script()?;
    batch::check(settings)?;
    if job.options.is_empty() {
        eprintln!(
            "note: no options of sbatch behind a lone --, such as -- --nodes=4 --cpus-per-task=16: the job gets what the \
             cluster gives by itself, often one CPU"
        );
    }
    let submitted = job.submit("sbatch")?;
    eprintln!("{}", submitted.advice());
    print_result(&format!("{}\n", submitted.job)).context("cannot write to stdout")?;
    Ok(ExitCode::SUCCESS)
}
