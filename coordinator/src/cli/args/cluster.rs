//! Flags of the coordinator: where workers come from and how long it waits for them.

use crate::settings::{Advertise, ClusterSettings, Workers};
use anyhow::bail;
use clap::Args;
use std::{net::SocketAddr, path::PathBuf, time::Duration};

#[derive(Debug, Args)]
#[command(next_help_heading = "Workers")]
pub(crate) struct ClusterArgs {
    /// Local worker processes to start: auto is one per core, 0 waits for remote ones
    #[arg(long, value_name = "N", default_value_t, allow_negative_numbers = true)]
    workers: Workers,
    /// IP address and port to listen on for workers; port 0 lets the system choose [default: 127.0.0.1:0]
    #[arg(long, value_name = "ADDR")]
    listen: Option<SocketAddr>,
    /// What the access file tells workers to connect to: HOST or HOST:PORT [default: the address listened on]
    #[arg(long, value_name = "A")]
    advertise: Option<Advertise>,
    /// Access file made beforehand with lookalike access new, its key beside it [default: a new one, OUT/access.json]
    #[arg(long, value_name = "FILE", conflicts_with = "advertise")]
    access: Option<PathBuf>,
    /// How long to wait for the first worker, such as 10min or 90s
    #[arg(long, value_name = "T", default_value = "10min", value_parser = humantime::parse_duration)]
    wait_for_workers: Duration,
    /// How long to wait for another worker after losing the last
    #[arg(long, value_name = "T", default_value = "60s", value_parser = humantime::parse_duration)]
    grace: Duration,
}

impl ClusterArgs {
    pub(crate) fn into_settings(self) -> anyhow::Result<ClusterSettings> {
        let everywhere = self.listen.filter(|listen| listen.ip().is_unspecified());
        if let (Some(listen), None, None) = (everywhere, &self.advertise, &self.access) {
            bail!(
                "--listen {listen} accepts connections on every interface but is no address to connect to; say under which \
                 name workers reach this machine with --advertise HOST"
            );
        }
        Ok(ClusterSettings {
            workers: self.workers,
            log: None,
            listen: self.listen,
            advertise: self.advertise,
            access: self.access,
            wait_for_workers: self.wait_for_workers,
            grace: self.grace,
        })
    }
}
