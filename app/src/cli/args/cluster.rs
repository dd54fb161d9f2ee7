//! Flags of the coordinator: where its workers come from.

use super::policy::PolicyArgs;
use crate::settings::{Advertise, ClusterSettings, Workers};
use anyhow::bail;
use clap::Args;
use std::{net::SocketAddr, path::PathBuf};

#[derive(Debug, Args)]
#[command(next_help_heading = "Workers")]
pub(crate) struct ClusterArgs {
    /// Worker processes to start on this machine: auto starts one per core. 0 starts none, so that only workers on other
    /// machines compute; they join through --listen
    #[arg(long, value_name = "N", default_value_t, allow_negative_numbers = true)]
    workers: Workers,
    /// IP address and port where workers on other machines join, for example 10.0.0.1:4100; port 0 lets the system choose
    /// [default: 127.0.0.1:0]
    #[arg(long, value_name = "ADDR")]
    listen: Option<SocketAddr>,
    /// HOST or HOST:PORT that workers connect to, if it is not the address of --listen; it is written to the access file
    /// [default: the address listened on]
    #[arg(long, value_name = "A")]
    advertise: Option<Advertise>,
    /// Access file from lookalike access new, with its key beside it: workers can then be started before the run
    /// [default: a new one, OUT/access.json]
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
                "--listen {listen} accepts connections on every interface, but workers need one address to connect to; give \
                 the name or address of this machine with --advertise HOST"
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
