//! `lookalike status`.

use crate::settings::StatusSettings;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(args_override_self = true, after_long_help = EXAMPLES)]
pub(crate) struct StatusArgs {
    /// Folder of the run: its --out
    #[arg(value_name = "DIR")]
    run: PathBuf,
    /// Print JSON; docs/journal.md describes it
    #[arg(long, help_heading = "Output")]
    json: bool,
}

impl StatusArgs {
    pub(crate) fn into_settings(self) -> StatusSettings {
        StatusSettings { run: self.run, json: self.json }
    }
}

const EXAMPLES: &str = "\
The exit code is 0 if the folder has a run, whatever its state, and 2 if it has none.

Examples:
  lookalike status run
  lookalike status run --json";
