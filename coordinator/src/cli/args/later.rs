//! Commands that this version does not have. Their grammar is the contract already; running one is an error.

#![allow(dead_code, reason = "the fields are the grammar; nothing reads them before the command exists")]

use super::{
    cluster::ClusterArgs,
    fit::DiagnosticsArgs,
    method::MethodArgs,
    scene::{EnvironmentArgs, PhotoArgs, SphereArgs, ViewArgs},
};
use clap::{Args, ValueEnum};
use std::{net::SocketAddr, path::PathBuf};

#[derive(Debug, Args)]
#[command(args_override_self = true)]
pub(crate) struct BatchArgs {
    /// TOML file that lists the fits
    #[arg(value_name = "MANIFEST.toml")]
    manifest: PathBuf,
    #[command(flatten)]
    method: MethodArgs,
    /// Folder of results, one subfolder per fit
    #[arg(long, short, value_name = "DIR", help_heading = "Output")]
    out: PathBuf,
    /// Go on with the other fits when one fails (the default)
    #[arg(long, conflicts_with = "fail_fast", help_heading = "Output")]
    keep_going: bool,
    /// End the run when one fit fails
    #[arg(long, help_heading = "Output")]
    fail_fast: bool,
    /// Go on with the run that is in the folder
    #[arg(long, help_heading = "Output")]
    resume: bool,
    #[command(flatten)]
    cluster: ClusterArgs,
    /// Where candidates are rendered and judged
    #[arg(long, value_enum, default_value_t, help_heading = "Workers")]
    stage_two: StageTwo,
    /// Submit the run to Slurm
    #[arg(long, help_heading = "Workers")]
    slurm: bool,
    #[command(flatten)]
    diagnostics: DiagnosticsArgs,
    /// IP address and port to serve metrics on
    #[arg(long, value_name = "ADDR", help_heading = "Diagnostics")]
    metrics: Option<SocketAddr>,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
enum StageTwo {
    /// On the coordinator
    #[default]
    Coordinator,
    /// On any one worker per fit
    Workers,
}

#[derive(Debug, Args)]
#[command(args_override_self = true)]
pub(crate) struct CheckArgs {
    #[command(flatten)]
    photo: PhotoArgs,
    #[command(flatten)]
    environment: EnvironmentArgs,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    sphere: SphereArgs,
}

#[derive(Debug, Args)]
#[command(args_override_self = true)]
pub(crate) struct ExportArgs {
    /// Folder of the run
    #[arg(value_name = "DIR")]
    run: PathBuf,
    /// Format to write
    #[arg(long, value_enum, help_heading = "Output")]
    format: Format,
    /// File to write
    #[arg(long, short, value_name = "FILE", help_heading = "Output")]
    out: PathBuf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    Mitsuba,
    #[value(name = "materialx")]
    MaterialX,
    Gltf,
    Usd,
    Merl,
    BrdfExplorer,
}

#[derive(Debug, Args)]
#[command(args_override_self = true)]
pub(crate) struct StudyArgs {
    /// TOML file that describes the study
    #[arg(value_name = "STUDY.toml")]
    study: PathBuf,
    /// Folder of results
    #[arg(long, short, value_name = "DIR", help_heading = "Output")]
    out: PathBuf,
}

#[derive(Debug, Args)]
#[command(args_override_self = true)]
pub(crate) struct ReportArgs {
    /// Folder of the run
    #[arg(value_name = "DIR")]
    run: PathBuf,
}
