//! The settings of each command, in types that cannot hold invalid values.
//!
//! Raw arguments (`cli::args`, clap) become these structs in one place, with every default and rule applied; nothing
//! downstream validates again. One struct per command. Cameras, methods and layouts of maps are types of
//! the library, each with its grammar (`FromStr`), the inverse (`Display`), its bounds and its one default; the other values have a file each.
//!
//! What is deliberately absent: files are not opened here, and nothing here depends on the command line's grammar.

mod access;
mod batch;
mod choices;
mod cluster;
mod compare;
mod demo;
mod exposure;
mod fit;
mod metrics;
mod model;
mod old_files;
mod render;
mod scene;
mod status;
mod study;

pub use access::AccessSettings;
pub use batch::{BatchFit, BatchSettings, JobSettings, OnFailure, StageTwo};
pub use choices::{Preset, ProgressKind};
pub use cluster::{Advertise, ClusterSettings, Workers};
pub use compare::CompareSettings;
pub use demo::DemoSettings;
pub use exposure::DisplayExposure;
pub use fit::FitSettings;
pub use metrics::MetricsAddress;
pub use model::{FitModels, FitModelsParser, ModelBounds, ModelName, ModelParams, ModelParser};
pub use old_files::OldFiles;
pub use render::{Material, RenderSettings};
pub use scene::{CaptureSettings, EnvironmentSettings, ViewSettings};
pub use status::StatusSettings;
pub use study::StudySettings;
