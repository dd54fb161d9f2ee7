//! The harness of the suites: scene builders, in-process clusters, real processes.

use std::time::Duration;

/// How long a test waits for an event that normally comes within milliseconds. It fails after that. So long because other programs may
/// keep every processor busy, and because a test that passes never waits for it.
pub const PATIENCE: Duration = Duration::from_secs(120);

pub mod cluster;
pub mod gate;
pub mod journal;
pub mod light;
pub mod merl;
pub mod netns;
pub mod nodes;
pub mod ordeal;
pub mod overhead;
pub mod plan;
pub mod process;
pub mod program;
pub mod proxy;
pub mod scene;
pub mod stranger;
