//! `lookalike worker`: an alias of `lookalike-worker`.

use lookalike::nodes;
use lookalike_worker::{Arguments, run_and_report};
use std::process::ExitCode;

#[allow(clippy::unnecessary_wraps, reason = "every command has this signature")]
pub(crate) fn run(arguments: Arguments) -> anyhow::Result<ExitCode> {
    Ok(run_and_report(&arguments.into_options(), nodes::registry()))
}
