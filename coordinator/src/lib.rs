//! The coordinator: the command line of Lookalike, and the process that plans a fit, hands its nodes to workers and
//! judges the candidates.

use std::process::ExitCode;

mod cli;
mod commands;
pub mod demo;
pub mod inputs;
pub mod settings;

pub use cli::Exit;

/// The program `lookalike`: reads the process's arguments, runs the command they name, reports errors on stderr.
#[must_use]
pub fn main() -> ExitCode {
    cli::main(std::env::args_os().collect())
}
