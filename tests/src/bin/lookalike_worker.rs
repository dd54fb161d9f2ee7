//! The real `lookalike-worker` as a program of this crate, so that cargo passes its path to the tests.

use std::process::ExitCode;

use lookalike::nodes;

fn main() -> ExitCode {
    lookalike_worker::main_with(nodes::registry())
}
