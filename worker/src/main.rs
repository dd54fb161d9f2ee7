//! `lookalike-worker`: argument parsing only; everything else is in the library.

use std::process::ExitCode;

use lookalike::nodes;

fn main() -> ExitCode {
    lookalike_worker::main_with(nodes::registry())
}
