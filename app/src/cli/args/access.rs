//! `lookalike access`.

use crate::settings::{AccessSettings, Advertise};
use anyhow::bail;
use clap::{Args, Subcommand};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct AccessArgs {
    #[command(subcommand)]
    command: AccessCommand,
}

#[derive(Debug, Subcommand)]
enum AccessCommand {
    /// Create an access file for workers and, beside it, the key for the coordinator
    #[command(args_override_self = true, after_long_help = EXAMPLE)]
    New {
        /// Host and port where workers will reach the coordinator, for example node7:4100
        #[arg(long, value_name = "HOST:PORT", value_parser = with_port)]
        address: Advertise,
        /// File to write, readable by its owner only; the key goes beside it, for example cluster.key.pem for cluster.json
        #[arg(long, short, value_name = "FILE", help_heading = "Output")]
        out: PathBuf,
    },
}

impl AccessArgs {
    pub(crate) fn into_settings(self) -> AccessSettings {
        let AccessCommand::New { address, out } = self.command;
        AccessSettings { address, out }
    }
}

/// Accepts a host with a port that can be connected to.
fn with_port(text: &str) -> anyhow::Result<Advertise> {
    let address: Advertise = text.parse()?;
    match address.port {
        None | Some(0) => bail!("expected HOST:PORT with a port from 1 to 65535"),
        Some(_) => Ok(address),
    }
}

const EXAMPLE: &str = "\
Copy the access file to the workers, and keep the key with the coordinator; both are valid for two years. Example:
  lookalike access new --address node7:4100 -o cluster.json
  lookalike fit ball.exr --env garden.hdr --out run --workers 0 \\
    --listen 10.0.0.7:4100 --access cluster.json
  lookalike worker --access cluster.json";
