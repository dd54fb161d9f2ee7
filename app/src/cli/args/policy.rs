//! Flags of the coordinator: how long it waits, whom it takes for lost, and what it does about slow and dangerous nodes.

use anyhow::bail;
use clap::Args;
use lookalike_coordinator::policy::{Policy, Speculation};
use std::{fmt, str::FromStr, time::Duration};

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
    /// How often a worker tells that it lives
    #[arg(long, value_name = "T", default_value_t = Time(Policy::default().heartbeat))]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    heartbeat: Time,
    /// A worker that was not heard of for this long is lost, and so is one that reads nothing for this long; at least two
    /// heartbeats
    #[arg(long, value_name = "T", default_value_t = Time(Policy::default().lost_after))]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    lost_after: Time,
    /// How many nodes a worker is given beyond its threads, so that it never waits for the next one
    #[arg(long, value_name = "N", default_value_t = Policy::default().spare_leases)]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    spare_leases: usize,
    /// After so many deaths of workers that were executing a node, it runs alone on a fresh worker
    #[arg(long, value_name = "N", default_value_t = Policy::default().suspect_after)]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    suspect_after: u32,
    /// A node that runs alone fails after so many deaths of its workers
    #[arg(long, value_name = "N", default_value_t = Policy::default().node_crashes)]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    node_crashes: u32,
    /// Whether an idle worker runs a slow node too, and the first answer counts: on, off, or how many times the median of its kind a
    /// slow node takes (on: 2)
    #[arg(long, value_name = "on|off|FACTOR", default_value = "on")]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    speculate: Speculate,
    /// A node that has not run for this long is not slow
    #[arg(long, value_name = "T", default_value_t = Time(Policy::default().speculation.after))]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    speculate_after: Time,
    /// Share of nodes on workers, searches left out, from 0 to 1, to run again on another worker and compare bit for bit
    #[arg(long, value_name = "F", default_value_t = Policy::default().verify_fraction, allow_negative_numbers = true)]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    verify_fraction: f64,
    /// How long a worker that is asked to end may take to finish what it executes, unless it was told otherwise
    #[arg(long, value_name = "T", default_value_t = Time(Policy::default().drain_time))]
    #[arg(help_heading = "Policy", hide_short_help = true)]
    drain_time: Time,
}

/// A duration, written as in the help text: `60s`, `10min`.
#[derive(Clone, Copy, Debug)]
struct Time(Duration);

impl fmt::Display for Time {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.as_secs() {
            _ if self.0.subsec_nanos() > 0 => humantime::format_duration(self.0).fmt(formatter),
            seconds if seconds >= 120 && seconds % 60 == 0 => write!(formatter, "{}min", seconds / 60),
            seconds => write!(formatter, "{seconds}s"),
        }
    }
}

impl FromStr for Time {
    type Err = humantime::DurationError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        humantime::parse_duration(text).map(Self)
    }
}

/// How much slower than usual a slow node is; none: no node is slow.
#[derive(Clone, Copy, Debug)]
struct Speculate(Option<f64>);

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
