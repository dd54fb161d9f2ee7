//! The harness of the suites: scene builders, in-process clusters, real processes.

use std::time::Duration;

/// How long a test waits for an event that normally comes within milliseconds, before it fails. Long, because other programs may occupy
/// every processor; a passing test never waits that long.
pub const PATIENCE: Duration = Duration::from_secs(120);

pub mod cluster;
pub mod faulted_fit;
pub mod gate;
pub mod journal;
pub mod light;
pub mod merl;
pub mod netns;
pub mod nodes;
pub mod overhead;
pub mod plan;
pub mod process;
pub mod program;
pub mod proxy;
pub mod raw_peer;
pub mod scene;
