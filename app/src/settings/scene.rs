//! The scene of a photo: the light, the shape of the object and the camera.

use lookalike::{
    light::Mapping,
    scene::{Camera, Circle},
};
use std::path::{Path, PathBuf};

/// A photo and its scene: mask, light, shape and camera.
#[derive(Debug, Clone, PartialEq)]
pub struct CaptureSettings {
    /// The photo.
    pub photo: PathBuf,
    /// The layer of an OpenEXR photo. `None`: the one that looks like a picture by its name.
    pub layer: Option<String>,
    /// Which pixels show the object. `None`: all that the silhouette covers.
    pub mask: Option<PathBuf>,
    /// The light.
    pub environment: EnvironmentSettings,
    /// Camera and shape.
    pub view: ViewSettings,
    /// The circle of the sphere. `None`: found as [`Placement`](lookalike::scene::Placement) says.
    pub sphere: Option<Circle>,
}

impl CaptureSettings {
    /// All files that the capture is read from.
    pub(crate) fn files(&self) -> Vec<&Path> {
        let others = [&self.mask, &self.view.normals].into_iter().filter_map(|path| path.as_deref());
        [self.photo.as_path(), &self.environment.path].into_iter().chain(others).collect()
    }
}

/// The environment map.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentSettings {
    /// The image file.
    pub path: PathBuf,
    /// Its layout. `None`: the layout that its shape implies (2:1 lat-long, 3:4 cross; any other shape is an error).
    pub mapping: Option<Mapping>,
    /// Rotation of the map about +Y in degrees, finite.
    pub rotation_deg: f64,
}

/// The object's shape and the camera.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewSettings {
    /// The projection.
    pub camera: Camera,
    /// World-space unit normals that replace the built-in sphere.
    pub normals: Option<PathBuf>,
}
