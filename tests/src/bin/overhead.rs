//! Measures the overhead of the runner: see `lookalike_tests::overhead`.

use std::process::ExitCode;

fn main() -> ExitCode {
    lookalike_tests::overhead::main()
}
