//! `lookalike`: everything is in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    lookalike_app::main()
}
