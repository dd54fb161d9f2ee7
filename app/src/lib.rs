//! The program `lookalike`: its command line, and what its commands do. The engine that runs a job graph on workers is
//! `lookalike_coordinator`; the science is `lookalike`.

use std::process::ExitCode;

mod batch;
mod cli;
mod commands;
pub mod demo;
mod exit;
mod fit;
pub mod inputs;
mod outputs;
mod problems;
mod progress;
mod run;
pub mod settings;
pub mod slurm;
mod study;
mod wrap;

pub use exit::Exit;

/// Entry points of the fuzz targets.
#[cfg(fuzzing)]
#[doc(hidden)]
pub mod fuzzing {
    use std::path::Path;

    /// The number of fits in a manifest.
    ///
    /// # Errors
    /// The problems of the manifest.
    pub fn manifest(path: &Path) -> Result<usize, String> {
        crate::cli::manifest(path, &[]).map(|fits| fits.len()).map_err(|error| format!("{error:#}"))
    }
}

/// The program `lookalike`: reads the process's arguments, runs the command they name, reports errors on stderr.
#[must_use]
pub fn main() -> ExitCode {
    cli::main(std::env::args_os().collect())
}
