//! Flags of the coordinator: where workers come from and how long it waits for them.

use super::policy::PolicyArgs;
use crate::settings::{Advertise, ClusterSettings, Workers};
use anyhow::bail;
use clap::Args;
use std::{net::SocketAddr, path::PathBuf};

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
    #[command(flatten)]
    policy: PolicyArgs,
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
            policy: self.policy.into_policy()?,
        })
    }
}
