//! Flags of the coordinator: how long it waits for workers, when a worker is lost, and how it treats slow nodes and nodes that kill
//! their workers.

use anyhow::bail;
use clap::Args;
use lookalike_coordinator::policy::{Policy, Speculation};
use lookalike_worker::Time;
use std::{fmt, str::FromStr};

#[derive(Debug, Args)]
pub(crate) struct PolicyArgs {
    /// How long to wait for the first worker, such as 10min or 90s
    #[arg(long, value_name = "T", default_value_t = Time(Policy::default().wait_for_workers))]
    #[arg(help_heading = "Workers")]
    wait_for_workers: Time,
    /// How long to wait for another worker after losing the last
    #[arg(long, value_name = "T", default_value_t = Time(Policy::default().grace))]
    #[arg(help_heading = "Workers")]
    grace: Time,
    /// How often workers and coordinator send each other a heartbeat
    #[arg(long, value_name = "T", default_value_t = Time(Policy::default().heartbeat))]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    heartbeat: Time,
    /// Declare a worker lost after it has sent or read nothing for this long; at least two heartbeats
    #[arg(long, value_name = "T", default_value_t = Time(Policy::default().lost_after))]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    lost_after: Time,
    /// How many nodes beyond its threads a worker is assigned in advance, so that it never waits for one
    #[arg(long, value_name = "N", default_value_t = Policy::default().spare_leases)]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    spare_leases: usize,
    /// Run a node alone on a fresh worker after this many workers have died while they executed it
    #[arg(long, value_name = "N", default_value_t = Policy::default().suspect_after)]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    suspect_after: u32,
    /// Fail a node after this many workers have died while it ran alone on them
    #[arg(long, value_name = "N", default_value_t = Policy::default().node_crashes)]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    node_crashes: u32,
    /// Run a slow node on an idle worker too and take the first result: on, off, or a factor. A node is slow once it has run this factor
    /// times the median time of its kind; on is the default factor
    #[arg(long, value_name = "on|off|FACTOR", default_value_t = Speculate(Speculation::default().factor))]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    speculate: Speculate,
    /// Shortest running time of a node that counts as slow
    #[arg(long, value_name = "T", default_value_t = Time(Policy::default().speculation.after))]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    speculate_after: Time,
    /// Share of the nodes on workers, from 0 to 1, that a second worker computes too, to compare the results bit for bit. Searches are
    /// left out, because the coordinator recomputes the costs of their results
    #[arg(long, value_name = "F", default_value_t = Policy::default().verify_fraction, allow_negative_numbers = true)]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    verify_fraction: f64,
    /// How long a worker that is asked to end may take to finish its running nodes, unless the worker has a --drain-time of its own
    #[arg(long, value_name = "T", default_value_t = Time(Policy::default().drain_time))]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    drain_time: Time,
}

/// The factor above the median time from which a node is slow; `None`: no node is slow.
#[derive(Clone, Copy, Debug)]
struct Speculate(Option<f64>);

impl fmt::Display for Speculate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(factor) => factor.fmt(formatter),
            None => formatter.write_str("off"),
        }
    }
}

impl FromStr for Speculate {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        Ok(Self(match text {
            "on" => Speculation::default().factor,
            "off" => None,
            factor => match factor.parse() {
                Ok(factor) => Some(factor),
                Err(_) => bail!("expected on, off, or a factor such as 3"),
            },
        }))
    }
}

impl PolicyArgs {
    pub(crate) fn into_policy(self) -> anyhow::Result<Policy> {
        let policy = Policy {
            heartbeat: self.heartbeat.0,
            lost_after: self.lost_after.0,
            spare_leases: self.spare_leases,
            suspect_after: self.suspect_after,
            node_crashes: self.node_crashes,
            speculation: Speculation { factor: self.speculate.0, after: self.speculate_after.0 },
            verify_fraction: self.verify_fraction,
            drain_time: self.drain_time.0,
            wait_for_workers: self.wait_for_workers.0,
            grace: self.grace.0,
            ..Policy::default()
        };
        policy.check()?;
        Ok(policy)
    }
}
