//! The options of a worker: raw arguments, then typed options.

use std::num::NonZeroUsize;
use std::path::PathBuf;
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
    #[arg(long, value_name = "TIME", default_value = "10min", value_parser = humantime::parse_duration)]
    pub reconnect_for: Duration,

    /// How long to finish running nodes after SIGTERM or Ctrl-C; other workers then compute those that are not finished. A second
    /// signal ends the worker at once [default: the coordinator's --drain-time, 30s]
    #[arg(long, value_name = "TIME", value_parser = humantime::parse_duration)]
    pub drain_time: Option<Duration>,

    /// Connect to this HOST:PORT instead of the access file's; for workers on the coordinator's own machine
    #[arg(long, value_name = "ADDR", hide = true)]
    pub address: Option<String>,

    /// End when stdin ends: the coordinator holds the other end of the pipe
    #[arg(long, hide = true)]
    pub leash: bool,
}

impl Arguments {
    /// The typed options, with defaults for arguments that were not given.
    #[must_use]
    pub fn into_options(self) -> WorkerOptions {
        let threads = self.threads.or_else(|| std::thread::available_parallelism().ok()).unwrap_or(NonZeroUsize::MIN);
        WorkerOptions {
            threads,
            reconnect_for: self.reconnect_for,
            drain_time: self.drain_time,
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
    /// One thread, 10 minutes for reconnecting, no leash, and caches of 256 and 128 MiB.
    #[must_use]
    pub fn new(access: PathBuf) -> Self {
        Self {
            access,
            address: None,
            threads: NonZeroUsize::MIN,
            reconnect_for: Duration::from_mins(10),
            drain_time: None,
            is_leashed: false,
            cached_blob_bytes: 256 << 20,
            decoded_blob_bytes: 128 << 20,
        }
    }
}
