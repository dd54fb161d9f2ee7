//! One test binary of modules, so that the suite links once.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may panic and say what they skip; clippy.toml's exceptions do not reach their helper functions"
)]

mod access;
mod bad_input;
mod batch;
mod chaos;
mod cli;
mod cluster;
mod compare;
mod crowd;
#[cfg(unix)]
mod deploy;
mod faults;
mod fit;
mod hostile;
mod network;
mod out_folder;
mod overhead;
mod physics;
mod program;
#[cfg(feature = "slow")]
mod recovery;
mod render;
mod resume;
mod sim;
mod study;
mod tidy;
