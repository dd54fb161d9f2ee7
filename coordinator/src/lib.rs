//! The coordinator: the command line of Lookalike, and the process that plans a fit, hands its nodes to workers and
//! judges the candidates.

use std::process::ExitCode;

pub mod access;
mod batch;
mod cli;
pub mod comm;
mod commands;
pub mod core;
pub mod demo;
mod fitting;
pub mod inputs;
pub mod journal;
pub mod limits;
mod metrics;
mod outputs;
pub mod policy;
mod progress;
pub mod reactor;
pub mod recall;
mod rpc;
pub mod runner;
pub mod settings;
pub mod slurm;
pub mod spawn;
mod study;
pub mod tls;

pub use cli::Exit;

/// What only the fuzz targets call.
#[cfg(fuzzing)]
#[doc(hidden)]
pub mod fuzzing {
    use std::path::Path;

    /// How many fits a manifest lists, or what is wrong with it.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn manifest(path: &Path) -> Result<usize, String> {
        crate::cli::manifest(path, &[]).map(|fits| fits.len()).map_err(|error| format!("{error:#}"))
    }
}

/// The program `lookalike`: reads the process's arguments, runs the command they name, reports errors on stderr.
#[must_use]
pub fn main() -> ExitCode {
    cli::main(std::env::args_os().collect())
}
