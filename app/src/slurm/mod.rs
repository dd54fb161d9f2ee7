//! A batch or a study as a Slurm job (design section 8, "Beyond one machine"): the job script with the command line in it, and its
//! submission. Slurm decides where the job runs, with how much and until when; its options are passed on unchanged.

mod command_line;
mod script;

pub use command_line::command_line;

use crate::exit::Exit;
use anyhow::{Context, bail};
use lookalike_coordinator::atomic;
use std::{
    fs, io,
    path::{Path, PathBuf},
    process::{Command, Output},
};

/// A run that is to be a job of Slurm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SlurmJob {
    /// The program that coordinator and workers run, by a path that is the same on all nodes.
    pub program: PathBuf,
    /// The folder that relative paths in `command` start from.
    pub folder: PathBuf,
    /// The command and its flags, without the program's name and without those that say where workers are.
    pub command: Vec<String>,
    /// Options of `sbatch`, as its own command line takes them.
    pub options: Vec<String>,
    /// The folder of results.
    pub out: PathBuf,
}

/// A job that Slurm accepted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Submitted {
    /// Its number.
    pub job: String,
    /// The script that was submitted; `sbatch` takes it again as it is.
    pub script: PathBuf,
    /// Where the job's messages go.
    pub log: PathBuf,
}

impl Submitted {
    /// What the user can do now, for stderr.
    #[must_use]
    pub fn advice(&self) -> String {
        let (job, log) = (&self.job, self.log.display());
        let out = self.script.parent().unwrap_or(&self.script).display();
        format!(
            "job {job} is submitted; its log is {log}\n\
             squeue --jobs={job} shows the job, lookalike status {out} the progress of the run\n\
             scancel {job} stops it; sbatch {} resumes it",
            self.script.display()
        )
    }
}

impl SlurmJob {
    /// Writes the job script and lets `sbatch` check it without submitting it.
    ///
    /// # Errors
    /// Those of [`SlurmJob::submit`].
    pub fn test(&self, sbatch: &str) -> anyhow::Result<()> {
        let script = self.write()?;
        let output = Command::new(sbatch).arg("--test-only").arg(&script).current_dir(&self.folder).output();
        let output = output.map_err(|error| not_started(&error, sbatch, &script))?;
        // What it says of a job that it would accept is no warning.
        if output.status.success() {
            return Ok(());
        }
        refused(&output, sbatch).context("the job would not be accepted, so nothing was removed or submitted")
    }

    /// Writes the job script into the folder of results and submits it with `sbatch`, a name or a path.
    ///
    /// # Errors
    /// When the script cannot be written, `sbatch` cannot be run, or it refuses the job; its own message is in the error.
    pub fn submit(&self, sbatch: &str) -> anyhow::Result<Submitted> {
        let script = self.write()?;
        let output = Command::new(sbatch).arg("--parsable").arg(&script).current_dir(&self.folder).output();
        let output = output.map_err(|error| not_started(&error, sbatch, &script))?;
        refused(&output, sbatch).with_context(|| {
            format!("the job was not submitted; correct its script {} and submit it with sbatch", script.display())
        })?;
        let job = job_number(&output, sbatch)?;
        Ok(Submitted { log: self.out.join(format!("slurm-{job}.out")), job, script })
    }

    /// Writes the job script; returns its path.
    fn write(&self) -> anyhow::Result<PathBuf> {
        let text = self.script()?;
        let path = self.out.join(SCRIPT_FILE);
        for path in [path.clone(), atomic::draft_of(&path)] {
            if !is_free(&path).with_context(|| format!("cannot read {}", path.display()))? {
                bail!(
                    "{} is not a job script of this program, which would replace it: choose another --out, or move it elsewhere",
                    path.display()
                );
            }
        }
        let cannot = || format!("cannot write the job script {}", path.display());
        fs::create_dir_all(&self.out).with_context(cannot)?;
        atomic::write(&path, text.as_bytes()).with_context(cannot)?;
        Ok(path)
    }
}

/// Whether a job script may be written to this path: nothing is there, or a script that an earlier submission wrote.
fn is_free(path: &Path) -> io::Result<bool> {
    let is_ours = |text: &str| {
        text.is_empty()
            || (text.starts_with("#!/usr/bin/env bash\n") && text.lines().take(4).any(|it| it.contains("Lookalike")))
    };
    match fs::symlink_metadata(path) {
        Ok(there) => Ok(there.is_file() && is_ours(&String::from_utf8_lossy(&fs::read(path)?))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(true),
        Err(error) => Err(error),
    }
}

/// The error of `sbatch`, if it refused the job. Its warnings about an accepted job are printed.
fn refused(output: &Output, sbatch: &str) -> anyhow::Result<()> {
    let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    if !output.status.success() {
        let words = if said.is_empty() { output.status.to_string() } else { said };
        return Err(anyhow::anyhow!("{sbatch}: {words}").context(Exit::RunFailed));
    }
    if !said.is_empty() {
        eprintln!("{said}");
    }
    Ok(())
}

/// The job number in the output of `sbatch --parsable`: its last line, up to a semicolon, which a cluster's name may follow. Some sites
/// print a greeting first.
fn job_number(output: &Output, sbatch: &str) -> anyhow::Result<String> {
    let answer = String::from_utf8_lossy(&output.stdout);
    let last = answer.lines().map(str::trim).rfind(|line| !line.is_empty()).unwrap_or_default();
    let number = last.split(';').next().unwrap_or_default();
    if number.is_empty() || !number.bytes().all(|byte| byte.is_ascii_digit()) {
        bail!("{sbatch} accepted the job, but its number is not in {:?}; look it up with squeue", answer.trim());
    }
    Ok(number.to_owned())
}

fn not_started(error: &io::Error, sbatch: &str, script: &Path) -> anyhow::Error {
    if error.kind() == io::ErrorKind::NotFound {
        anyhow::anyhow!(
            "cannot find {sbatch}, which submits jobs to Slurm; run this on a login node of the cluster, or submit the job \
             script {} there",
            script.display()
        )
    } else {
        anyhow::anyhow!("cannot run {sbatch}: {error}")
    }
}

/// The name of the job script in the folder of results.
const SCRIPT_FILE: &str = "lookalike.sbatch";

#[cfg(test)]
#[cfg(unix)]
mod tests;
