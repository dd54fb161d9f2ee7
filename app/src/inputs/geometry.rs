//! The object's shape and the camera.

use super::file::{InputFile, cannot_use, read_with};
use crate::settings::ViewSettings;
use anyhow::Context;
use lookalike::{
    image::{Image, ImageError, decode, decode_normals},
    math::narrow,
    scene::{Camera, Circle, Geometry, SceneError},
};
use std::path::Path;

/// A geometry with its origin.
#[derive(Debug, Clone)]
pub struct LoadedGeometry {
    /// Shape and camera.
    pub geometry: Geometry,
    /// The normal map, if the shape is not the built-in sphere.
    pub normals: Option<InputFile>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// The built-in sphere in `circle` of an image of `width` x `height` pixels.
///
/// # Errors
/// If the image is too small, or circle or camera are out of range.
pub fn sphere_geometry(
    width: usize,
    height: usize,
    circle: Circle,
    view: &ViewSettings,
) -> Result<Geometry, SceneError> {
    Geometry::sphere(width, height, circle, view.camera)
}

/// Reads a map of normals; the geometry has the size of the map.
///
/// # Errors
/// If the file cannot be read or decoded, or most of its vectors are not unit normals that face the camera.
pub fn load_normals(path: &Path, camera: Camera) -> anyhow::Result<LoadedGeometry> {
    let map = read_with(path, ROLE, normals)?;
    let geometry = Geometry::normals(&map, camera).with_context(|| cannot_use(path, ROLE))?;
    let mut warnings: Vec<String> = geometry
        .normal_map()
        .map_or(&[][..], |map| map.warnings())
        .iter()
        .map(|text| format!("{}: {text}", path.display()))
        .collect();
    warnings.push("a shape from normals is lit as if convex: it neither shadows itself nor reflects itself".to_owned());
    Ok(LoadedGeometry { geometry, normals: Some(InputFile::of_image(path, &map)), warnings })
}

/// The vectors of a map. The strict reader refuses a map with a smoothed edge; such a map is read as an image, and the scene checks it.
fn normals(name: &str, bytes: &[u8]) -> Result<Image, ImageError> {
    match decode_normals(name, bytes) {
        Ok(plane) => {
            let (width, height) = (plane.width(), plane.height());
            Ok(Image::from_pixels(width, height, plane.into_values().into_iter().map(narrow).collect()))
        }
        Err(error @ ImageError::Normal { .. }) => decode(name, bytes).map(|decoded| decoded.image).map_err(|_| error),
        Err(error) => Err(error),
    }
}

const ROLE: &str = "normal map";
