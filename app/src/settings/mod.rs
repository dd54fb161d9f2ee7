//! Settings: what a command is to do, in types that cannot hold nonsense.
//!
//! Raw arguments (`cli::args`, clap) become these structs in one place, with every default and rule applied; nothing
//! downstream validates again. One struct per command; the values they are made of each have a file with their
//! grammar (`FromStr`), its inverse (`Display`) and their bounds.
//!
//! What is deliberately absent: files are not opened here, and nothing here depends on the command line's grammar.

mod access;
mod batch;
mod camera;
mod choices;
mod circle;
mod cluster;
mod compare;
mod demo;
mod exposure;
mod fit;
mod gammas;
mod integrator;
mod metrics;
mod model;
mod render;
mod samples;
mod scene;
mod status;
mod study;

pub use access::AccessSettings;
pub use batch::{BatchFit, BatchSettings, JobSettings, OnFailure, StageTwo};
pub use camera::CameraSpec;
pub use choices::{CompressAtZero, EnvMapping, Judge, MetricKind, Preset, ProgressKind, Sampling, SearchKind, Start};
pub use circle::Circle;
pub use cluster::{Advertise, ClusterSettings, Workers};
pub use compare::CompareSettings;
pub use demo::DemoSettings;
pub use exposure::DisplayExposure;
pub use fit::{FitSettings, MethodSettings};
pub use gammas::Gammas;
pub use integrator::Integrator;
pub use metrics::MetricsAddress;
pub use model::{ModelName, ModelParams};
pub use render::{Material, RenderSettings};
pub use samples::Samples;
pub use scene::{EnvironmentSettings, ViewSettings};
pub use status::StatusSettings;
pub use study::StudySettings;
