//! The settings of `lookalike compare`.

use super::DisplayExposure;
use lookalike::metric::MetricKind;
use std::path::PathBuf;

/// Two images and how to measure their difference.
#[derive(Debug, Clone, PartialEq)]
pub struct CompareSettings {
    /// The reference image.
    pub reference: PathBuf,
    /// The image to judge.
    pub image: PathBuf,
    /// Which pixels count.
    pub mask: Option<PathBuf>,
    /// Where to write the map of differences, PNG.
    pub map: Option<PathBuf>,
    /// The measure.
    pub metric: MetricKind,
    /// Exposure before the measure.
    pub display_exposure: DisplayExposure,
    /// Print JSON, not text.
    pub json: bool,
}
