//! The settings of `lookalike study`.

use super::{ClusterSettings, MetricsAddress, OldFiles, ProgressKind};
use std::path::PathBuf;

/// A study: experiments on measured materials under known lights, as one run.
#[derive(Debug, Clone, PartialEq)]
pub struct StudySettings {
    /// The file that describes it.
    pub study: PathBuf,
    /// The folder of results.
    pub out: PathBuf,
    /// What happens to files that the folder holds.
    pub old_files: OldFiles,
    /// Where metrics are served.
    pub metrics: Option<MetricsAddress>,
    /// Where workers come from.
    pub cluster: ClusterSettings,
    /// How progress is shown.
    pub progress: ProgressKind,
    /// The command line, which the report shows.
    pub command: String,
}
