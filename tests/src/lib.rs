//! The harness of the suites: scene builders, in-process clusters, real processes.

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
