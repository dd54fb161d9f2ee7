//! The real `lookalike` under a name of its own, so that cargo hands its path to the suites.

use std::process::ExitCode;

fn main() -> ExitCode {
    lookalike_app::main()
}
