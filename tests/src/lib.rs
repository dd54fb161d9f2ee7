//! The harness of the suites: scene builders, in-process clusters, real processes.

pub mod cluster;
pub mod gate;
pub mod journal;
pub mod nodes;
pub mod plan;
pub mod process;
pub mod program;
pub mod scene;
pub mod stranger;
