//! The options of a worker: raw arguments, then typed options.

use std::fmt;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use clap::Args;

/// The flags of `lookalike-worker` and `lookalike worker`.
#[derive(Clone, Debug, Args)]
pub struct Arguments {
    /// The access file that the coordinator wrote (OUT/access.json)
    #[arg(long, value_name = "FILE")]
    pub access: PathBuf,

    /// How many nodes to compute at a time [default: one per core]
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,

    /// How long to try to reach the coordinator before giving up, such as 60s or 10min
    #[arg(long, value_name = "TIME", default_value_t = Time(RECONNECT_FOR))]
    pub reconnect_for: Time,

    /// How long to finish running nodes after SIGTERM or Ctrl-C; other workers then compute those that are not finished. A second
    /// signal ends the worker at once [default: the coordinator's --drain-time]
    #[arg(long, value_name = "TIME")]
    pub drain_time: Option<Time>,

    /// Connect to this HOST:PORT instead of the access file's; for workers on the coordinator's own machine
    #[arg(long, value_name = "ADDR", hide = true)]
    pub address: Option<String>,

    /// End when stdin ends: the coordinator holds the other end of the pipe
    #[arg(long, hide = true)]
    pub leash: bool,
}

/// The default time for which a worker tries to reach its coordinator.
const RECONNECT_FOR: Duration = Duration::from_mins(10);

/// A duration, written as in the help text: `60s`, `10min`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Time(pub Duration);

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

impl Arguments {
    /// The typed options, with defaults for arguments that were not given.
    #[must_use]
    pub fn into_options(self) -> WorkerOptions {
        let threads = self.threads.or_else(|| std::thread::available_parallelism().ok()).unwrap_or(NonZeroUsize::MIN);
        WorkerOptions {
            threads,
            reconnect_for: self.reconnect_for.0,
            drain_time: self.drain_time.map(|time| time.0),
            address: self.address,
            is_leashed: self.leash,
            ..WorkerOptions::new(self.access)
        }
    }
}

/// The options of a worker.
#[derive(Clone, Debug)]
pub struct WorkerOptions {
    /// The access file.
    pub access: PathBuf,
    /// Connect to this `HOST:PORT` instead of the access file's.
    pub address: Option<String>,
    /// How many nodes to compute at a time, and the size of the rayon pool.
    pub threads: NonZeroUsize,
    /// How long to try to reach the coordinator before giving up.
    pub reconnect_for: Duration,
    /// How long to finish running nodes when asked to end; `None` for the coordinator's setting.
    pub drain_time: Option<Duration>,
    /// Whether to end when stdin ends; a coordinator on this machine holds the other end of the pipe.
    pub is_leashed: bool,
    /// How many bytes of blobs to cache beyond those that assigned nodes need.
    pub cached_blob_bytes: usize,
    /// How many bytes of blobs (in encoded size) to keep decoded.
    pub decoded_blob_bytes: usize,
}

impl WorkerOptions {
    /// One thread, no leash, and the defaults of everything else.
    #[must_use]
    pub fn new(access: PathBuf) -> Self {
        Self {
            access,
            address: None,
            threads: NonZeroUsize::MIN,
            reconnect_for: RECONNECT_FOR,
            drain_time: None,
            is_leashed: false,
            cached_blob_bytes: 256 << 20,
            decoded_blob_bytes: 128 << 20,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Program {
        #[command(flatten)]
        arguments: Arguments,
    }

    #[test]
    fn arguments_and_options_have_the_same_defaults() {
        let parsed = |more: &[&str]| {
            let line = ["worker", "--access", "file"].iter().chain(more);
            Program::try_parse_from(line).unwrap().arguments.into_options()
        };
        let (given, own) = (parsed(&[]), WorkerOptions::new("file".into()));
        assert_eq!((given.reconnect_for, given.drain_time), (own.reconnect_for, own.drain_time));
        let given = parsed(&["--reconnect-for=90s", "--drain-time=2min"]);
        assert_eq!((given.reconnect_for, given.drain_time), (Duration::from_secs(90), Some(Duration::from_mins(2))));
    }
}
