//! The grammar of the command line, as clap definitions. Each command turns itself into its settings.
//!
//! Help texts are part of the contract: one sentence of purpose, units, defaults, and an example in `--help`.

mod access;
mod batch;
mod choice;
mod cluster;
mod compare;
mod fit;
mod method;
mod old_files;
mod policy;
mod render;
mod scene;
mod status;
mod study;

pub(crate) use batch::{BatchArgs, EntryArgs};
pub(crate) use fit::FitArgs;
pub(crate) use method::MethodArgs;

use crate::settings::{DemoSettings, OldFiles, Preset, ProgressKind, Workers};
use anyhow::bail;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Finds the parameters of an analytic BRDF that make a rendering look like a photograph.
#[derive(Debug, Parser)]
#[command(name = "lookalike", bin_name = "lookalike", version = VERSION, after_help = TOP_NOTES, after_long_help = TOP_EXAMPLES)]
pub(crate) struct Cli {
    /// Log filter for stderr: error, warn, info, debug, trace, off, or directives such as `lookalike=debug`
    #[arg(long, global = true, value_name = "LEVEL", env = "RUST_LOG", default_value = "warn", value_parser = log_filter)]
    #[arg(help_heading = "Diagnostics", overrides_with = "log")]
    pub(crate) log: String,
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Fit a bundled scene with local workers, as a first try
    Demo(DemoArgs),
    /// Fit a BRDF model to a photo of an object under known light
    Fit(Box<FitArgs>),
    /// Fit many photos as one run
    Batch(Box<BatchArgs>),
    /// Show the state of a run: running, stopped or finished
    Status(status::StatusArgs),
    /// Render a sphere, or a map of normals, of one material under one light
    Render(render::RenderArgs),
    /// Measure how different two images look
    Compare(compare::CompareArgs),
    /// Reproduce the paper's tables and figures on measured materials, and compare with other methods
    Study(Box<study::StudyArgs>),
    /// Create an access file, so that workers can be started before their run
    Access(access::AccessArgs),
    /// Compute for a coordinator, like the program lookalike-worker
    #[command(after_long_help = "Example:\n  lookalike worker --access run/access.json --threads 8")]
    Worker(lookalike_worker::Arguments),
}

impl Command {
    /// The preset that the command line names.
    pub(crate) fn preset(&self) -> Option<Preset> {
        match self {
            Self::Fit(args) => args.method.preset,
            _ => None,
        }
    }
}

#[derive(Debug, Args)]
#[command(args_override_self = true, after_long_help = "Example:\n  lookalike demo --out /tmp/demo")]
pub(crate) struct DemoArgs {
    /// Folder for the results; only files of an earlier demo are replaced there
    #[arg(long, short, value_name = "DIR", default_value = "lookalike-demo", help_heading = "Output")]
    out: PathBuf,
    /// Replace files that have the names of the demo's files, and remove unchanged files of an earlier run of any command (listed in
    /// run.written)
    #[arg(long, help_heading = "Output")]
    force: bool,
    /// Worker processes to start: auto starts one per core
    #[arg(long, value_name = "N", default_value_t, help_heading = "Workers")]
    workers: Workers,
    /// How progress is shown on stderr
    #[arg(long, value_enum, default_value_t, help_heading = "Diagnostics")]
    progress: ProgressKind,
}

impl DemoArgs {
    pub(crate) fn into_settings(self) -> anyhow::Result<DemoSettings> {
        if self.workers == Workers::Count(0) {
            bail!("the demo computes with local workers only; give --workers 1 or more");
        }
        let old_files = if self.force { OldFiles::Replace } else { OldFiles::ReplaceDemo };
        Ok(DemoSettings { out: self.out, old_files, workers: self.workers, progress: self.progress, log: None })
    }
}

/// Accepts a filter of `tracing_subscriber`.
fn log_filter(text: &str) -> Result<String, tracing_subscriber::filter::ParseError> {
    tracing_subscriber::EnvFilter::try_new(text).map(|_| text.to_owned())
}

const VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\nconventions: right-handed world, +Y up, camera on +Z; lat-long maps with +Z at the centre; linear Rec. 709; \
     alpha = roughness^2; pixels from the top left",
);

const TOP_NOTES: &str = "\
Every command except batch, study and access also takes a TOML file whose keys are its flags: lookalike fit fit.toml. \
Flags win over the file.";

const TOP_EXAMPLES: &str = "\
Every command except batch, study and access also takes a TOML file whose keys are its flags and positional arguments. Flags \
win over the file; relative paths in the file are relative to it.

Results go to stdout, everything for people to stderr. Exit codes: 0 done; 1 done, but --max-cssim was missed; 2 bad \
input or usage; 3 the run failed; 4 some fits of a batch failed, the others are complete; 130 interrupted.

Examples:
  lookalike demo
  lookalike fit ball.exr --env garden.hdr --out run
  lookalike fit fit.toml --seed 3
  lookalike compare run/reference.png run/match.png --json";
