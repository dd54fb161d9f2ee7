//! The settings of `lookalike fit`.

use super::{
    Circle, ClusterSettings, CompressAtZero, DisplayExposure, EnvironmentSettings, Gammas, Integrator, Judge,
    MetricsAddress, ModelName, Preset, ProgressKind, Samples, Sampling, SearchKind, Start, ViewSettings,
};
use std::{num::NonZeroUsize, path::PathBuf};

/// One photo, its light, and how to fit it.
#[derive(Debug, Clone, PartialEq)]
pub struct FitSettings {
    /// The photo.
    pub photo: PathBuf,
    /// Which pixels show the object; none means all that the silhouette covers.
    pub mask: Option<PathBuf>,
    /// The light.
    pub environment: EnvironmentSettings,
    /// Camera and shape.
    pub view: ViewSettings,
    /// Where the sphere lies; none means fitted to the mask, else the inscribed circle.
    pub sphere: Option<Circle>,
    /// How to fit.
    pub method: MethodSettings,
    /// Exposure before the metric.
    pub display_exposure: DisplayExposure,
    /// A final CSSIM above this makes the exit code 1; finite, at or above 0.
    pub max_cssim: Option<f64>,
    /// The folder of results.
    pub out: PathBuf,
    /// Go on with the run that is in the folder, if there is one.
    pub resume: bool,
    /// Replace files with our names in the folder, never an input of the run.
    pub force: bool,
    /// Who computes.
    pub cluster: ClusterSettings,
    /// How progress is shown.
    pub progress: ProgressKind,
    /// Where metrics are served.
    pub metrics: Option<MetricsAddress>,
}

/// The method of design section 1 and its options.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodSettings {
    /// The bundle that was asked for; its values are already in the other fields.
    pub preset: Option<Preset>,
    /// The BRDF model.
    pub model: ModelName,
    /// The exponents of stage one.
    pub gammas: Gammas,
    /// The pixels of stage one.
    pub samples: Samples,
    /// How these pixels are drawn.
    pub sampling: Sampling,
    /// How many independent pixel subsets are searched.
    pub subsets: NonZeroUsize,
    /// How the cost is minimised.
    pub search: SearchKind,
    /// How the searches render their pixels.
    pub integrator: Integrator,
    /// Where the searches start.
    pub start: Start,
    /// What compression does near zero.
    pub compress_at_zero: CompressAtZero,
    /// Whether stage three runs.
    pub polish: bool,
    /// The score that selects and polishes.
    pub judge: Judge,
    /// The seed of every random choice.
    pub seed: u64,
}

impl Default for MethodSettings {
    /// The defaults of the command line.
    fn default() -> Self {
        Self {
            preset: None,
            model: ModelName::default(),
            gammas: Gammas::default(),
            samples: Samples::default(),
            sampling: Sampling::default(),
            subsets: NonZeroUsize::MIN,
            search: SearchKind::default(),
            integrator: Integrator::default(),
            start: Start::default(),
            compress_at_zero: CompressAtZero::default(),
            polish: true,
            judge: Judge::default(),
            seed: 0,
        }
    }
}
