//! `lookalike study`.

use super::{cluster::ClusterArgs, fit::DiagnosticsArgs, old_files::OldFilesFlags};
use crate::settings::{JobSettings, StudySettings};
use clap::Args;
use std::{ffi::OsString, path::PathBuf};

#[derive(Debug, Args)]
#[command(args_override_self = true, after_long_help = EXAMPLES)]
pub(crate) struct StudyArgs {
    /// TOML file that names materials, lights and experiments
    #[arg(value_name = "STUDY.toml")]
    study: PathBuf,
    /// Folder for the results; it must not already hold a run, unless --resume or --force is given
    #[arg(long, short, value_name = "DIR", help_heading = "Output")]
    out: PathBuf,
    /// Resume the study in the folder without computing complete results again. If it is finished, only write its report again
    #[arg(long, help_heading = "Output")]
    resume: bool,
    /// Replace files that have the names of this run's files, and remove those of an earlier run (listed in run.written) that are
    /// unchanged; never an input, never through a symbolic link. With --slurm, when the job is submitted
    #[arg(long, conflicts_with = "resume", help_heading = "Output")]
    force: bool,
    #[command(flatten)]
    cluster: ClusterArgs,
    /// Submit the run to Slurm as a job that starts the coordinator and the workers, and return
    #[arg(long, conflicts_with_all = ["workers", "listen", "advertise", "access"], help_heading = "Workers")]
    slurm: bool,
    /// Options of sbatch, with --slurm, for example --nodes=4 --cpus-per-task=16 --time=2:00:00
    #[arg(last = true, requires = "slurm", value_name = "SBATCH_OPTION")]
    sbatch: Vec<String>,
    /// The whole command line, the command first.
    #[arg(skip)]
    pub(crate) typed: Vec<OsString>,
    #[command(flatten)]
    diagnostics: DiagnosticsArgs,
}

impl StudyArgs {
    pub(crate) fn into_settings(self) -> anyhow::Result<StudySettings> {
        let command = format!("lookalike study {} --out {}", self.study.display(), self.out.display());
        Ok(StudySettings {
            study: self.study,
            out: self.out,
            old_files: OldFilesFlags { resume: self.resume, force: self.force }.into(),
            metrics: self.diagnostics.metrics,
            cluster: self.cluster.into_settings()?,
            progress: self.diagnostics.progress,
            command,
        })
    }

    /// The Slurm job to submit, with --slurm.
    pub(crate) fn job(&self) -> Option<JobSettings> {
        self.slurm.then(|| JobSettings { typed: self.typed.clone(), options: self.sbatch.clone() })
    }
}

const EXAMPLES: &str = "\
Examples:
  lookalike study STUDY.toml --out study
  lookalike study STUDY.toml --out study --resume
  lookalike study STUDY.toml --out study --workers 0 --listen 10.0.0.1:4100
  lookalike study STUDY.toml --out study --slurm -- --nodes=4 --cpus-per-task=16 --time=2:00:00

where STUDY.toml is, for instance (its relative paths are relative to the file):
  materials = [\"merl/*.binary\"]           # measured materials in MERL's format
  probes = [\"grace_cross.hdr\", \"rnl_cross.hdr\", \"uffizi.hdr\"]
  held-out = [\"studio.hdr\"]               # lights for scoring matches, not for fits
  size = 128                              # columns and rows of the photos
  experiments = [\"methods\", \"held-out\"]  # all of them, if left out

docs/study.md has the whole grammar. The report is OUT/report.html, for people, and OUT/results.md, for a repository.";
