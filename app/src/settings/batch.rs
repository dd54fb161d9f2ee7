//! The settings of `lookalike batch`.

use super::{CaptureSettings, ClusterSettings, DisplayExposure, MetricsAddress, OldFiles, ProgressKind};
use lookalike::fit::Methods;
use std::{ffi::OsString, path::PathBuf};

/// Many fits as one run.
#[derive(Debug, Clone)]
pub struct BatchSettings {
    /// The file that lists the fits.
    pub manifest: PathBuf,
    /// The fits, in the order of the manifest; at least one, each with a name of its own.
    pub fits: Vec<BatchFit>,
    /// The folder of results.
    pub out: PathBuf,
    /// What happens to files that the folder holds.
    pub old_files: OldFiles,
    /// Where stage two, polish and the pictures of each fit are computed.
    pub stage_two: StageTwo,
    /// What happens when a fit fails.
    pub on_failure: OnFailure,
    /// Where metrics are served.
    pub metrics: Option<MetricsAddress>,
    /// Where workers come from.
    pub cluster: ClusterSettings,
    /// How progress is shown.
    pub progress: ProgressKind,
}

/// The Slurm job that `lookalike batch --slurm` or `lookalike study --slurm` submits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JobSettings {
    /// The user's command line, the command first.
    pub typed: Vec<OsString>,
    /// Options of `sbatch`.
    pub options: Vec<String>,
}

/// One photo of a batch, its light, and how to fit it.
#[derive(Debug, Clone)]
pub struct BatchFit {
    /// Its name, which is also the name of its folder: valid on any file system.
    pub name: String,
    /// The line of the manifest that lists it.
    pub line: usize,
    /// The photo with its scene.
    pub capture: CaptureSettings,
    /// How to fit.
    pub methods: Methods,
    /// Exposure before the metric.
    pub display_exposure: DisplayExposure,
    /// A final CSSIM above this makes the exit code 1; finite, at or above 0.
    pub max_cssim: Option<f64>,
}

/// Where stage two, polish and the pictures of a fit are computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum StageTwo {
    /// In the coordinator's process
    #[default]
    Coordinator,
    /// On workers, each fit on one of them at a time
    Workers,
}

/// What a batch does when one of its fits fails.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum OnFailure {
    /// Continue with the other fits.
    #[default]
    KeepGoing,
    /// Stop the batch.
    FailFast,
}
