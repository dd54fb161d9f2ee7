//! The settings of `lookalike fit`.

use super::{CaptureSettings, ClusterSettings, DisplayExposure, MetricsAddress, OldFiles, ProgressKind};
use lookalike::fit::Methods;
use std::path::PathBuf;

/// One photo, its light, and how to fit it.
#[derive(Debug, Clone)]
pub struct FitSettings {
    /// The photo with its scene.
    pub capture: CaptureSettings,
    /// How to fit, with which models.
    pub methods: Methods,
    /// Exposure before the metric.
    pub display_exposure: DisplayExposure,
    /// A final CSSIM above this makes the exit code 1; finite, at or above 0.
    pub max_cssim: Option<f64>,
    /// The folder of results.
    pub out: PathBuf,
    /// What happens to files that the folder holds.
    pub old_files: OldFiles,
    /// Where workers come from.
    pub cluster: ClusterSettings,
    /// How progress is shown.
    pub progress: ProgressKind,
    /// Where metrics are served.
    pub metrics: Option<MetricsAddress>,
}
