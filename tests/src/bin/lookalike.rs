//! The real `lookalike` as a program of this crate, so that cargo passes its path to the tests.

use std::process::ExitCode;

fn main() -> ExitCode {
    lookalike_app::main()
}
