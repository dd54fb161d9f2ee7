//! The real `lookalike-worker` under a name of its own, so that cargo hands its path to the suites.

use std::process::ExitCode;

use lookalike::nodes;

fn main() -> ExitCode {
    lookalike_worker::main_with(nodes::registry())
}
