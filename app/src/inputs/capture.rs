//! The photo of a fit with its mask, shape and light.

use super::{
    InputFile, LoadedEnvironment, LoadedGeometry, LoadedMask, LoadedPhoto, file::cannot_use, load_environment,
    load_mask, load_normals, load_photo, sphere_geometry,
};
use crate::settings::{CaptureSettings, EnvironmentSettings};
use anyhow::Context;
use lookalike::{
    image::Encoding,
    light::Mapping,
    scene::{Capture, CaptureInput, CircleSource, Geometry, Mask, Placement, SceneError},
};
use serde_json::{Value, json};
use std::path::Path;

/// A checked capture with the origins of its parts.
#[derive(Debug, Clone)]
pub struct LoadedCapture {
    /// Photo, geometry and light.
    pub capture: Capture,
    /// The photo's file.
    pub photo: InputFile,
    /// Whether the photo held radiance or display values.
    pub encoding: Encoding,
    /// The map's file.
    pub environment: InputFile,
    /// The map's layout, given or recognised.
    pub mapping: Mapping,
    /// How far the map was turned about +Y, in degrees.
    pub rotation_deg: f64,
    /// The mask's file.
    pub mask: Option<InputFile>,
    /// The normal map's file.
    pub normals: Option<InputFile>,
    /// Where the sphere's circle came from; `None` for a normal map.
    pub circle_source: Option<CircleSource>,
    /// Warnings about each file and about the files together.
    pub warnings: Vec<String>,
}

impl LoadedCapture {
    /// The `inputs` of `fit.json`.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let mut environment = self.environment.to_json();
        environment["mapping"] = json!(self.mapping.to_string());
        environment["rotation_deg"] = json!(self.rotation_deg);
        let mut inputs = json!({ "photo": self.photo.to_json(), "environment": environment });
        for (role, file) in [("mask", &self.mask), ("normals", &self.normals)] {
            if let Some(file) = file {
                inputs[role] = file.to_json();
            }
        }
        inputs
    }
}

/// Reads the photo of a fit with its mask, its shape and its light, and checks them against each other.
///
/// # Errors
/// Those of the loaders, and of [`Capture::new`] if the parts do not match each other or no pixel can be fitted.
pub fn load_capture(files: &CaptureSettings) -> anyhow::Result<LoadedCapture> {
    load_capture_under(files, load_environment)
}

/// As [`load_capture`], but `light` loads the environment map; it may return one that is already in memory.
///
/// # Errors
/// Those of [`load_capture`] and of `light`.
pub fn load_capture_under(
    files: &CaptureSettings,
    light: impl FnOnce(&EnvironmentSettings) -> anyhow::Result<LoadedEnvironment>,
) -> anyhow::Result<LoadedCapture> {
    let LoadedPhoto { image, alpha, clipped, encoding, source, mut warnings, .. } =
        load_photo(&files.photo, files.layer.as_deref())?;
    let (width, height) = (image.width(), image.height());
    let mask = files.mask.as_deref().map(|path| same_size(path, width, height)).transpose()?;
    let mask_values = mask.as_ref().map(|loaded| &loaded.mask);
    // Alpha that is no coverage tells nothing.
    let alpha = alpha.and_then(|alpha| Mask::new(width, height, alpha).ok());
    let (shape, placement) = shape(files, mask_values, alpha.as_ref(), (width, height))?;
    let LoadedEnvironment { environment, mapping, source: map, warnings: of_map } = light(&files.environment)?;

    warnings.extend(of_map);
    warnings.extend(shape.warnings);
    warnings.extend(placement.iter().filter_map(|placement| placement.warning.clone()));
    let (mask_source, mask) = mask.map(|loaded| (loaded.source, loaded.mask)).unzip();
    let input = CaptureInput { photo: image, clipped, mask, geometry: shape.geometry, environment };
    let capture = Capture::new(input).with_context(|| cannot_use(&files.photo, "photo"))?;
    // The list already has the warnings of the normal map, with the name of its file.
    let of_normals = capture.geometry().normal_map().map_or(&[][..], |map| map.warnings());
    warnings.extend(capture.warnings().iter().filter(|text| !of_normals.contains(text)).cloned());
    Ok(LoadedCapture {
        capture,
        photo: source,
        encoding,
        environment: map,
        mapping,
        rotation_deg: files.environment.rotation_deg,
        mask: mask_source,
        normals: shape.normals,
        circle_source: placement.map(|placement| placement.source),
        warnings,
    })
}

fn same_size(path: &Path, width: usize, height: usize) -> anyhow::Result<LoadedMask> {
    let loaded = load_mask(path)?;
    let (found_width, found_height) = (loaded.mask.width(), loaded.mask.height());
    if (found_width, found_height) != (width, height) {
        let error = SceneError::Size { what: "mask", width, height, found_width, found_height };
        return Err(error).with_context(|| cannot_use(path, "mask"));
    }
    Ok(loaded)
}

/// The sphere of the photo, or the shape of a normal map of the photo's size.
fn shape(
    files: &CaptureSettings,
    mask: Option<&Mask>,
    alpha: Option<&Mask>,
    (width, height): (usize, usize),
) -> anyhow::Result<(LoadedGeometry, Option<Placement>)> {
    let Some(path) = &files.view.normals else {
        let place = || -> Result<(Geometry, Placement), SceneError> {
            let placement = Placement::choose(files.sphere, mask, alpha, (width, height))?;
            Ok((sphere_geometry(width, height, placement.circle, &files.view)?, placement))
        };
        let (geometry, placement) = place().context("cannot place the sphere in the photo")?;
        let loaded = LoadedGeometry { geometry, normals: None, warnings: Vec::new() };
        return Ok((loaded, Some(placement)));
    };
    let loaded = load_normals(path, files.view.camera)?;
    let (found_width, found_height) = (loaded.geometry.width(), loaded.geometry.height());
    if (found_width, found_height) != (width, height) {
        let error = SceneError::Size { what: "normal map", width, height, found_width, found_height };
        return Err(error).with_context(|| cannot_use(path, "normal map"));
    }
    Ok((loaded, None))
}
