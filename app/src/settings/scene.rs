//! What surrounds the object and how it is seen: shared by `fit`, `check` and `render`.

use super::{CameraSpec, EnvMapping};
use std::path::PathBuf;

/// The environment map.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentSettings {
    /// The image file.
    pub path: PathBuf,
    /// Its layout; none means by its shape (2:1 is lat-long, 3:4 is a cross, all else is an error).
    pub mapping: Option<EnvMapping>,
    /// Rotation of the map about +Y in degrees, finite.
    pub rotation_deg: f64,
}

/// The object's shape and the camera.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewSettings {
    /// The projection.
    pub camera: CameraSpec,
    /// World-space unit normals that replace the built-in sphere.
    pub normals: Option<PathBuf>,
}
