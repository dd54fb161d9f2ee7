//! `lookalike fit`.

use super::{cluster::ClusterArgs, method::MethodArgs, old_files::OldFilesFlags, scene::CaptureArgs};
use crate::settings::{FitSettings, MetricsAddress, ProgressKind};
use anyhow::bail;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(args_override_self = true, after_long_help = EXAMPLES)]
pub(crate) struct FitArgs {
    #[command(flatten)]
    capture: CaptureArgs,
    #[command(flatten)]
    pub(crate) method: MethodArgs,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    cluster: ClusterArgs,
    #[command(flatten)]
    diagnostics: DiagnosticsArgs,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
struct OutputArgs {
    /// Folder for the results; it must not already hold a run, unless --resume or --force is given
    #[arg(long, short, value_name = "DIR")]
    out: PathBuf,
    /// Exit with code 1 if the final CSSIM is above X, for example 0.05; 0 is a perfect match
    #[arg(long, value_name = "X", value_parser = score, allow_negative_numbers = true)]
    max_cssim: Option<f64>,
    /// Resume the run in the folder without computing its acknowledged results again. Starts a run if the folder has no run; only
    /// checks the results of a finished one
    #[arg(long)]
    resume: bool,
    /// Replace files that have the names of this run's files, and remove those of an earlier run (listed in run.written) that are
    /// unchanged; never an input, never through a symbolic link
    #[arg(long, conflicts_with = "resume")]
    force: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Diagnostics")]
pub(crate) struct DiagnosticsArgs {
    /// How progress is shown on stderr
    #[arg(long, value_name = "PROGRESS", value_enum, default_value_t)]
    pub(super) progress: ProgressKind,
    /// Serve metrics for Prometheus at IP:PORT, or at PORT of the loopback interface, for example 9100
    #[arg(long, value_name = "ADDR")]
    pub(super) metrics: Option<MetricsAddress>,
}

impl FitArgs {
    pub(crate) fn into_settings(self) -> anyhow::Result<FitSettings> {
        Ok(FitSettings {
            capture: self.capture.into_settings()?,
            display_exposure: self.method.display_exposure.clone(),
            methods: self.method.into_methods()?,
            max_cssim: self.output.max_cssim,
            out: self.output.out,
            old_files: OldFilesFlags { resume: self.output.resume, force: self.output.force }.into(),
            cluster: self.cluster.into_settings()?,
            progress: self.diagnostics.progress,
            metrics: self.diagnostics.metrics,
        })
    }
}

/// Accepts a score of the metric: finite, at or above 0.
pub(super) fn score(text: &str) -> anyhow::Result<f64> {
    match text.parse::<f64>() {
        Ok(score) if score.is_finite() && score >= 0.0 => Ok(score),
        _ => bail!("expected a number at or above 0"),
    }
}

const EXAMPLES: &str = "\
Examples:
  lookalike fit ball.exr --env garden.hdr --out run
  lookalike fit ball.exr --env garden.hdr --sphere 128,128,100 --camera perspective:30 --out run
  lookalike fit ball.exr --env grace_cross.hdr --preset paper --out run
  lookalike fit ball.exr --env garden.hdr --out run --workers 0 --listen 10.0.0.1:4100
  lookalike fit ball.exr --env garden.hdr --out run --resume
  lookalike fit fit.toml --seed 3

where fit.toml is, for instance (its relative paths are relative to the file):
  photo = \"ball.exr\"
  env = \"garden.hdr\"
  out = \"run\"
  sphere = [128, 128, 100]
  polish = \"off\"";
