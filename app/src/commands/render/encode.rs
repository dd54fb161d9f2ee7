//! Encodes a rendering and its metadata as a file.

use super::material::LoadedMaterial;
use crate::{
    inputs::{LoadedEnvironment, LoadedGeometry},
    settings::RenderSettings,
};
use anyhow::{Context, bail};
use lookalike::{
    image::{Image, metadata as keys, openexr, pfm, png},
    math::{narrow, widen},
    metric::auto_exposure,
    render::image::Rendering,
    scene::Camera,
};
use std::path::Path;

/// The file formats of renderings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    /// Radiance with coverage and metadata.
    OpenExr,
    /// Radiance alone.
    Pfm,
    /// Display values with metadata.
    Png,
}

impl Format {
    /// The format for a file's extension.
    pub(super) fn of(path: &Path) -> anyhow::Result<Self> {
        match path.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("exr") => Ok(Self::OpenExr),
            Some("pfm") => Ok(Self::Pfm),
            Some("png") => Ok(Self::Png),
            _ => bail!("cannot write {}: expected a name that ends in .exr, .pfm or .png", path.display()),
        }
    }
}

/// A description of what was rendered, for the metadata.
#[derive(Debug)]
pub(super) struct Subject<'a> {
    pub(super) settings: &'a RenderSettings,
    pub(super) material: &'a LoadedMaterial,
    pub(super) shape: &'a LoadedGeometry,
    pub(super) light: &'a LoadedEnvironment,
}

/// The content of a file.
#[derive(Debug)]
pub(super) struct Encoded {
    pub(super) bytes: Vec<u8>,
    /// The display exposure that the pixels are multiplied by.
    pub(super) exposure: Option<f64>,
}

impl Subject<'_> {
    /// The bytes of the file.
    pub(super) fn encode(&self, format: Format, rendering: &Rendering) -> anyhow::Result<Encoded> {
        let Rendering { image, coverage, .. } = rendering;
        let exposure = exposure(rendering);
        let metadata = self.metadata(exposure);
        let (bytes, exposure) = match format {
            Format::OpenExr => (openexr::write(image, Some(coverage), &metadata), None),
            Format::Pfm => (pfm::write(image), None),
            Format::Png => {
                let exposure = exposure.unwrap_or(1.0);
                (png::write(&exposed(image, exposure), &metadata), Some(exposure))
            }
        };
        Ok(Encoded { bytes: bytes.with_context(|| self.settings.out.display().to_string())?, exposure })
    }

    fn metadata(&self, exposure: Option<f64>) -> Vec<(String, String)> {
        let Self { settings, material, shape, light } = self;
        let environment =
            format!("{}, {}, rotated by {} degrees", light.source, light.mapping, settings.environment.rotation_deg);
        let mut entries = vec![
            (keys::SOFTWARE, format!("lookalike {VERSION}")),
            (keys::VERSION, VERSION.to_owned()),
            (keys::CONVENTIONS, CONVENTIONS.to_owned()),
            (keys::MODEL, material.model.to_owned()),
            (keys::ENVIRONMENT, environment),
            (keys::CAMERA, shape.geometry.camera().to_string()),
            (keys::SAMPLES, settings.samples.to_string()),
            (keys::SEED, settings.seed.to_string()),
        ];
        entries.extend(material.parameters.iter().map(|parameters| (keys::PARAMETERS, parameters.clone())));
        entries.extend(material.file.iter().map(|file| (keys::BRDF, file.to_string())));
        entries.extend(exposure.map(|exposure| (keys::DISPLAY_EXPOSURE, exposure.to_string())));
        entries.push((keys::COMMENTS, self.shape()));
        entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    }

    fn shape(&self) -> String {
        let camera = match self.shape.geometry.camera() {
            Camera::Orthographic => "seen by parallel rays",
            Camera::Perspective { .. } => "seen by a pinhole camera",
        };
        match (&self.shape.normals, self.shape.geometry.circle()) {
            (Some(file), _) => format!("the normals of {file}, lit as if convex, {camera}"),
            (None, Some(circle)) => format!("a unit sphere in the circle {circle} (pixels: x, y, radius), {camera}"),
            (None, None) => camera.to_owned(),
        }
    }
}

/// The automatic display exposure; `None` for a black object.
fn exposure(rendering: &Rendering) -> Option<f64> {
    auto_exposure(&rendering.image, &rendering.coverage).ok()
}

fn exposed(image: &Image, exposure: f64) -> Image {
    let pixels = image.pixels().iter().map(|&pixel| narrow(widen(pixel) * exposure)).collect();
    Image::from_pixels(image.width(), image.height(), pixels)
}

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Design section 3 in one line.
const CONVENTIONS: &str = "right-handed world, +Y up, camera on +Z looking along -Z; linear Rec. 709 radiance (PNG: times the \
                           display exposure, clipped, sRGB-encoded) times coverage, over black; alpha channel: coverage; rows from \
                           the top; direct light only";
