//! The settings of `lookalike status`.

use std::path::PathBuf;

/// Which run, and for whom.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StatusSettings {
    /// The folder of the run.
    pub run: PathBuf,
    /// Print JSON.
    pub json: bool,
}
