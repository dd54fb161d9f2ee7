//! `lookalike worker`.

use crate::settings::WorkerSettings;
use clap::Args;
use std::{num::NonZeroUsize, path::PathBuf, time::Duration};

#[derive(Debug, Args)]
#[command(
    args_override_self = true,
    after_long_help = "Example:\n  lookalike worker --access run/access.json --threads 8"
)]
pub(crate) struct WorkerArgs {
    /// Access file of the coordinator, written by `lookalike fit` as OUT/access.json
    #[arg(long, value_name = "FILE", help_heading = "Workers")]
    access: PathBuf,
    /// Threads that compute [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Workers")]
    threads: Option<NonZeroUsize>,
    /// How long to go on trying when the coordinator does not answer, such as 10min or 90s
    #[arg(long, value_name = "T", default_value = "10min", value_parser = humantime::parse_duration)]
    #[arg(help_heading = "Workers")]
    reconnect_for: Duration,
}

impl WorkerArgs {
    pub(crate) fn into_settings(self) -> WorkerSettings {
        WorkerSettings { access: self.access, threads: self.threads, reconnect_for: self.reconnect_for }
    }
}
