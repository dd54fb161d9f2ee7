//! Submits a run as a Slurm job.

use crate::{
    outputs::print_result,
    settings::JobSettings,
    slurm::{SlurmJob, command_line},
    wrap::wrap,
};
use anyhow::Context;
use std::{env, path, path::Path, process::ExitCode};

/// Submits a run whose results go to the folder `out`. `check` reports problems of its inputs; `replace` removes old results, which the job
/// would refuse, once `sbatch` has found nothing wrong with the job.
pub(crate) fn submit(
    job: JobSettings,
    out: &Path,
    check: impl FnOnce() -> anyhow::Result<()>,
    replace: Option<impl FnOnce() -> anyhow::Result<()>>,
) -> anyhow::Result<ExitCode> {
    let job = SlurmJob {
        command: command_line(&job.typed)?,
        program: env::current_exe().context("cannot find the path of this program")?,
        folder: env::current_dir().context("cannot find the current folder")?,
        options: job.options,
        out: path::absolute(out).context("--out")?,
    };
    job.script()?;
    check()?;
    if let Some(replace) = replace {
        job.test("sbatch")?;
        replace()?;
    }
    if job.options.is_empty() {
        let note = "note: no options for sbatch were given after --, such as -- --nodes=4 --cpus-per-task=16, so the job gets the \
                    cluster's defaults, often one CPU";
        eprintln!("{}", wrap(note));
    }
    let submitted = job.submit("sbatch")?;
    eprintln!("{}", submitted.advice());
    print_result(&format!("{}\n", submitted.job)).context("cannot write to stdout")?;
    Ok(ExitCode::SUCCESS)
}
