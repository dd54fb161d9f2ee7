//! Coordinator and worker with the node types of the cluster suite, for tests that kill or interrupt real processes.

use std::process::ExitCode;

fn main() -> ExitCode {
    lookalike_tests::program::main()
}
