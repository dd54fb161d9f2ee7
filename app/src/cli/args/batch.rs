//! `lookalike batch`.

use super::{
    cluster::ClusterArgs,
    fit::{DiagnosticsArgs, score},
    method::MethodArgs,
    old_files::OldFilesFlags,
    scene::CaptureArgs,
};
use crate::settings::{BatchFit, BatchSettings, JobSettings, OnFailure, Preset, StageTwo};
use clap::{Args, Parser};
use std::{ffi::OsString, path::PathBuf};

#[derive(Debug, Args)]
#[command(args_override_self = true, after_long_help = EXAMPLES)]
pub(crate) struct BatchArgs {
    /// TOML file that lists the fits
    #[arg(value_name = "MANIFEST.toml")]
    pub(crate) manifest: PathBuf,
    /// These override the manifest.
    #[command(flatten)]
    method: MethodArgs,
    /// The flags of the method on the command line, as typed.
    #[arg(skip)]
    pub(crate) given: Vec<OsString>,
    /// The whole command line, the command first.
    #[arg(skip)]
    pub(crate) typed: Vec<OsString>,
    /// Folder for the results, one subfolder per fit; it must not already hold a run, unless --resume or --force is given
    #[arg(long, short, value_name = "DIR", help_heading = "Output")]
    out: PathBuf,
    /// Continue with the other fits when one fails [default]
    #[arg(long, overrides_with = "fail_fast", help_heading = "Output")]
    keep_going: bool,
    /// Stop the run when one fit fails
    #[arg(long, overrides_with = "keep_going", help_heading = "Output")]
    fail_fast: bool,
    /// Resume the run in the folder: complete fits are kept, acknowledged results are not computed again, failed fits are
    /// retried. Starts a run if the folder has no run
    #[arg(long, help_heading = "Output")]
    resume: bool,
    /// Replace files that have the names of this run's files, and remove those of an earlier run (listed in run.written) that are
    /// unchanged; never an input, never through a symbolic link. With --slurm, when the job is submitted
    #[arg(long, conflicts_with = "resume", help_heading = "Output")]
    force: bool,
    #[command(flatten)]
    cluster: ClusterArgs,
    /// Where candidates are rendered, judged and polished; the results are the same
    #[arg(long, value_name = "WHERE", value_enum, default_value_t, help_heading = "Workers")]
    stage_two: StageTwo,
    /// Submit the run to Slurm as a job that starts the coordinator and the workers, and return
    #[arg(long, conflicts_with_all = ["workers", "listen", "advertise", "access"], help_heading = "Workers")]
    slurm: bool,
    /// Options of sbatch, with --slurm, for example --nodes=4 --cpus-per-task=16 --time=2:00:00
    #[arg(last = true, requires = "slurm", value_name = "SBATCH_OPTION")]
    sbatch: Vec<String>,
    #[command(flatten)]
    diagnostics: DiagnosticsArgs,
}

impl BatchArgs {
    /// The settings of a batch of these fits.
    pub(crate) fn into_settings(self, fits: Vec<BatchFit>) -> anyhow::Result<BatchSettings> {
        let DiagnosticsArgs { progress, metrics } = self.diagnostics;
        Ok(BatchSettings {
            manifest: self.manifest,
            fits,
            out: self.out,
            old_files: OldFilesFlags { resume: self.resume, force: self.force }.into(),
            stage_two: self.stage_two,
            on_failure: if self.fail_fast { OnFailure::FailFast } else { OnFailure::KeepGoing },
            metrics,
            cluster: self.cluster.into_settings()?,
            progress,
        })
    }

    /// The Slurm job to submit, with --slurm.
    pub(crate) fn job(&self) -> Option<JobSettings> {
        self.slurm.then(|| JobSettings { typed: self.typed.clone(), options: self.sbatch.clone() })
    }
}

/// One fit of a manifest: the flags of `lookalike fit` without those of outputs and workers, which belong to the whole batch.
#[derive(Debug, Parser)]
#[command(name = "fit", no_binary_name = true, args_override_self = true, disable_help_flag = true)]
pub(crate) struct EntryArgs {
    #[command(flatten)]
    capture: CaptureArgs,
    #[command(flatten)]
    method: MethodArgs,
    /// Count the fit as missed if its final CSSIM is above X
    #[arg(long, value_name = "X", value_parser = score, allow_negative_numbers = true)]
    max_cssim: Option<f64>,
}

impl EntryArgs {
    pub(crate) fn preset(&self) -> Option<Preset> {
        self.method.preset
    }

    /// The settings of the fit `name`, from a line of the manifest.
    pub(crate) fn into_settings(self, name: String, line: usize) -> anyhow::Result<BatchFit> {
        Ok(BatchFit {
            name,
            line,
            capture: self.capture.into_settings()?,
            display_exposure: self.method.display_exposure.clone(),
            methods: self.method.into_methods()?,
            max_cssim: self.max_cssim,
        })
    }
}

const EXAMPLES: &str = "\
Examples:
  lookalike batch balls.toml --out runs
  lookalike batch balls.toml --out runs --seed 3 --fail-fast
  lookalike batch balls.toml --out runs --resume
  lookalike batch balls.toml --out runs --workers 0 --listen 10.0.0.1:4100 --stage-two workers
  lookalike batch balls.toml --out runs --metrics 9100
  lookalike batch balls.toml --out runs --slurm -- --nodes=4 --cpus-per-task=16 --time=2:00:00

where balls.toml is, for instance (its relative paths are relative to the file):
  photos = \"balls/*.exr\"                  # every photo under every light with every model
  environments = [\"garden.hdr\"]
  models = [\"ggx\", \"cook-torrance\"]

  [defaults]                              # any flag of lookalike fit
  camera = \"perspective:30\"
  samples = 512

  [[fit]]                                 # one more
  name = \"gold-again\"
  photo = \"gold.exr\"
  env = \"attic.hdr\"
  sphere = [128, 128, 100]
  max-cssim = 0.05

docs/batch.md has the whole grammar, docs/cluster.md more on Slurm. The exit code is 4 if a fit failed, \
else 1 if one missed its max-cssim, else 0.";
