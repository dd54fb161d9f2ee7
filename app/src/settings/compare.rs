//! The settings of `lookalike compare`.

use super::DisplayExposure;
use lookalike::metric::MetricKind;
use std::path::{Path, PathBuf};

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

impl CompareSettings {
    /// The files that it reads.
    pub(crate) fn files(&self) -> Vec<&Path> {
        let others = [self.mask.as_deref(), self.display_exposure.file()].into_iter().flatten();
        [self.reference.as_path(), &self.image].into_iter().chain(others).collect()
    }
}
