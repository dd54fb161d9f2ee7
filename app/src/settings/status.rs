//! The settings of `lookalike status`.

use std::path::PathBuf;

/// The run, and the form of the output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StatusSettings {
    /// The folder of the run.
    pub run: PathBuf,
    /// Print JSON.
    pub json: bool,
}
