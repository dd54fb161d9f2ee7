//! Commands that this version does not have. Their grammar is the contract already; running one is an error.

#![allow(dead_code, reason = "the fields are the grammar; nothing reads them before the command exists")]

use super::scene::{EnvironmentArgs, PhotoArgs, SphereArgs, ViewArgs};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

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
pub(crate) struct ReportArgs {
    /// Folder of the run
    #[arg(value_name = "DIR")]
    run: PathBuf,
}
