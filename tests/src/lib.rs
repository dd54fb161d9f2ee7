//! The harness of the suites: scene builders, in-process clusters, real processes.

pub mod scene;
