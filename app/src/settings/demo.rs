//! The settings of `lookalike demo`.

use super::{OldFiles, ProgressKind, Workers};
use std::path::PathBuf;

/// A fit of the bundled scene.
#[derive(Debug, Clone, PartialEq)]
pub struct DemoSettings {
    /// The folder of results.
    pub out: PathBuf,
    /// What happens to files that the folder holds.
    pub old_files: OldFiles,
    /// Local worker processes; never 0.
    pub workers: Workers,
    /// The log filter of the local workers.
    pub log: Option<String>,
    /// How progress is shown.
    pub progress: ProgressKind,
}
